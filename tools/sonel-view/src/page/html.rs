//! The file around a page: its JSON, the scripts that draw it, and their libraries.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;

use super::Page;

/// What draws charts and the room (assets/README.md).
const LIBRARIES: [&str; 2] =
    [include_str!("../../assets/plot.min.js"), include_str!("../../assets/three.min.js")];
/// What the page does: the later ones use the earlier ones.
const SCRIPTS: [&str; 7] = [
    include_str!("../../assets/words.js"),
    include_str!("../../assets/charts.js"),
    include_str!("../../assets/room.js"),
    include_str!("../../assets/report.js"),
    include_str!("../../assets/listener.js"),
    include_str!("../../assets/sound.js"),
    include_str!("../../assets/page.js"),
];
const STYLE: &str = include_str!("../../assets/page.css");
const BODY: &str = include_str!("../../assets/page.html");

/// Text in HTML, not in attributes.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Text that scripts unpack: numbers take a quarter of their space, programs two fifths.
fn packed(id: &str, text: &str) -> String {
    let mut packing = GzEncoder::new(Vec::new(), Compression::default());
    packing.write_all(text.as_bytes()).expect("memory takes everything");
    let packed = STANDARD.encode(packing.finish().expect("memory takes everything"));
    format!("<script type=\"text/plain\" id=\"{id}\">{packed}</script>\n")
}

impl Page {
    /// One file that opens offline in any browser.
    pub(crate) fn to_html(&self) -> String {
        let content = serde_json::to_string(self).expect("keys are texts");
        let (title, scripts) = (escaped(&self.title), SCRIPTS.join("\n"));
        let (libraries, content) = (packed("libraries", &LIBRARIES.join("\n")), packed("content", &content));
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"generator\" content=\"sonel-view\">\
             <meta name=\"viewport\" content=\"width=device-width\">\
             <title>{title}</title>\n<style>{STYLE}</style>\n<script>{scripts}</script></head>\n\
             <body><main><h1>{title}</h1>\n{BODY}</main>\n{libraries}{content}<script>start()</script></body></html>\n"
        )
    }
}
