//! The HTML around texts, tables and charts. Everything that comes from files is escaped here.

use std::io::Write;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde_json::Value;

/// What draws charts and the room (assets/README.md).
const LIBRARIES: [&str; 2] =
    [include_str!("../../assets/plotly-basic.min.js"), include_str!("../../assets/three.min.js")];
/// What the page does: the later ones use the earlier ones.
const SCRIPTS: [&str; 5] = [
    include_str!("../../assets/words.js"),
    include_str!("../../assets/room.js"),
    include_str!("../../assets/listener.js"),
    include_str!("../../assets/sound.js"),
    include_str!("../../assets/page.js"),
];
const STYLE: &str = include_str!("../../assets/page.css");
const VIEW: &str = include_str!("../../assets/view.html");

/// Colours of series, those of plotly.js.
const COLORS: [&str; 10] = [
    "#1f77b4", "#ff7f0e", "#2ca02c", "#d62728", "#9467bd", "#8c564b", "#e377c2", "#7f7f7f", "#bcbd22",
    "#17becf",
];

/// Colour of a series by its index.
pub(super) fn color(index: usize) -> &'static str {
    COLORS[index % COLORS.len()]
}

/// A page being written.
pub(super) struct Document {
    title: String,
    /// What stands below the title.
    head: String,
    body: String,
    contents: String,
    /// Charts of plotly.js, in the order of their places.
    charts: Vec<Value>,
    /// What the scripts show beside them.
    shown: Value,
}

/// Text with the characters that HTML and the labels of plotly.js reserve replaced; not for attributes.
pub(super) fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            _ => out.push(letter),
        }
    }
    out
}

/// Text that scripts unpack: numbers take a quarter of their space, programs two fifths.
fn packed(id: &str, text: &str) -> String {
    let mut packing = GzEncoder::new(Vec::new(), Compression::default());
    packing.write_all(text.as_bytes()).expect("memory takes everything");
    let packed = STANDARD.encode(packing.finish().expect("memory takes everything"));
    format!("<script type=\"text/plain\" id=\"{id}\">{packed}</script>\n")
}

impl Document {
    /// A page whose scripts show the room and the pairs of `shown`.
    pub(super) fn new(title: &str, shown: Value) -> Self {
        let (head, body, contents) = Default::default();
        Self { title: escaped(title), head, body, contents, charts: Vec::new(), shown }
    }

    /// Sets the line below the title.
    pub(super) fn head(&mut self, text: &str) {
        self.head = format!("<p>{}</p>\n", escaped(text));
    }

    /// Begins a section.
    pub(super) fn section(&mut self, title: &str) {
        let anchor: String = title.chars().filter(char::is_ascii_alphanumeric).collect();
        self.contents.push_str(&format!("<a href=\"#{anchor}\">{title}</a>"));
        self.body.push_str(&format!("<h2 id=\"{anchor}\">{title}</h2>\n"));
    }

    /// A paragraph of plain text.
    pub(super) fn text(&mut self, text: &str) {
        self.body.push_str(&format!("<p>{}</p>\n", escaped(text)));
    }

    /// A paragraph in small print.
    pub(super) fn note(&mut self, text: &str) {
        self.body.push_str(&format!("<p class=\"note\">{}</p>\n", escaped(text)));
    }

    /// A list of plain texts.
    pub(super) fn list(&mut self, items: &[String]) {
        let items: String = items.iter().map(|item| format!("<li>{}</li>", escaped(item))).collect();
        self.body.push_str(&format!("<ul>{items}</ul>\n"));
    }

    /// A table of plain texts; `class` is "" or "long" for columns of text.
    pub(super) fn table(&mut self, class: &str, head: &[String], rows: &[Vec<String>]) {
        let row = |cells: &[String], tag: &str| {
            let cells: String =
                cells.iter().map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell))).collect();
            format!("<tr>{cells}</tr>")
        };
        let body: String = rows.iter().map(|cells| row(cells, "td")).collect();
        let head =
            if head.is_empty() { String::new() } else { format!("<thead>{}</thead>", row(head, "th")) };
        self.body.push_str(&format!(
            "<div class=\"scroll\"><table class=\"{class}\">{head}<tbody>{body}</tbody></table></div>\n"
        ));
    }

    /// A table that is folded on the screen and whole in print.
    pub(super) fn folded(&mut self, title: &str, head: &[String], rows: &[Vec<String>]) {
        self.body.push_str(&format!(
            "<details class=\"fold\"><summary>{}</summary></details>\n<div>",
            escaped(title)
        ));
        self.table("", head, rows);
        self.body.push_str("</div>\n");
    }

    /// A drawing, SVG of ours, with a title for those who cannot see it.
    pub(super) fn drawing(&mut self, title: &str, svg: &str) {
        let title = escaped(title).replace('"', "&quot;");
        self.body.push_str(&format!(
            "<figure class=\"scroll\"><img alt=\"{title}\" src=\"data:image/svg+xml;base64,{}\"></figure>\n",
            STANDARD.encode(svg)
        ));
    }

    /// Charts side by side, each `{"data": …, "layout": …}` of plotly.js, below the names of series where the charts have no legends of their own.
    pub(super) fn charts(&mut self, names: &[String], charts: &[Value]) {
        let keys = names.iter().enumerate().map(|(index, name)| {
            format!("<span><b style=\"color:{}\">■</b> {}</span>", color(index), escaped(name))
        });
        let keys: String = keys.collect();
        let keys = if keys.is_empty() { keys } else { format!("<p class=\"note keys\">{keys}</p>") };
        let first = self.charts.len();
        let places: String = (first..first + charts.len())
            .map(|index| format!("<div id=\"chart{index}\" class=\"chart\"></div>"))
            .collect();
        self.body.push_str(&format!("<div class=\"grid\">{keys}{places}</div>\n"));
        self.charts.extend_from_slice(charts);
    }

    /// Data for programs that read the page: JSON, packed by gzip and written in base64.
    pub(super) fn data(&mut self, id: &str, value: &Value) {
        self.body.push_str(&packed(id, &value.to_string()));
    }

    /// The whole document.
    pub(super) fn finish(self) -> String {
        let Self { title, head, body, contents, charts, mut shown } = self;
        shown["charts"] = charts.into();
        let (libraries, content) =
            (packed("libraries", &LIBRARIES.join("\n")), packed("content", &shown.to_string()));
        let scripts = SCRIPTS.join("\n");
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"generator\" content=\"sonel-view\">\
             <meta name=\"viewport\" content=\"width=device-width\">\
             <title>{title}</title>\n<style>{STYLE}</style>\n<script>{scripts}</script></head>\n\
             <body><h1>{title}</h1>\n{head}<nav><a href=\"#view\">Room</a>{contents}</nav>\n{VIEW}\n{body}\
             {libraries}{content}<script>start()</script></body></html>\n"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn print_can_repeat_the_head_of_a_table() {
        let mut page = Document::new("", Value::Null);
        page.table("", &["f".to_owned()], &[vec!["1".to_owned()]]);
        let table = "<thead><tr><th>f</th></tr></thead><tbody><tr><td>1</td></tr></tbody>";
        assert!(page.body.contains(table), "{}", page.body);
    }
}
