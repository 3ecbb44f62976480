//! Builds the documentation and accepts no warning, but lets brackets hold units and citations.
//!
//! rustdoc takes `[Hz]` and `[Schroeder1965]` for links to items. STYLE.md gives them another meaning, so links that do not
//! resolve are reported unless they are one of these.

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::tidy::is_citation_key;
use crate::workspace;

/// Units in brackets that are identifiers to rustdoc; others (`[1/m]`) it does not take for links.
const UNITS: [&str; 20] = [
    "B", "Hz", "J", "K", "MHz", "MiB", "Pa", "W", "dB", "dm", "kHz", "kPa", "m", "mm", "ms", "m²", "m³",
    "rad", "s", "sr",
];

/// Documents every crate of ours; an error if rustdoc has anything to say.
pub fn check() -> Result<()> {
    let mut doc = workspace::cargo(&["doc", "--workspace", "--no-deps", "--message-format=json"]);
    doc.env("RUSTDOCFLAGS", "--force-warn rustdoc::broken_intra_doc_links");
    let output = doc.stderr(std::process::Stdio::inherit()).output().context("cannot run cargo doc")?;
    let messages = String::from_utf8(output.stdout).context("cargo doc printed no UTF-8")?;
    let complaints: Vec<_> = messages.lines().filter_map(complaint).collect();
    for text in &complaints {
        println!("{text}");
    }
    ensure!(output.status.success(), "cargo doc: {}", output.status);
    ensure!(complaints.is_empty(), "cargo doc: {} warnings", complaints.len());
    Ok(())
}

/// What a line of cargo's JSON says to a human, if it is a warning or an error that counts.
fn complaint(line: &str) -> Option<String> {
    let message: Value = serde_json::from_str(line).ok()?;
    if message["reason"] != "compiler-message" {
        return None;
    }
    let message = &message["message"];
    let counts = matches!(message["level"].as_str(), Some("warning" | "error"));
    // Summaries ("3 warnings emitted") have no place in a file.
    let located = message["spans"].as_array().is_some_and(|spans| !spans.is_empty());
    (counts && located && !is_bracket_of_ours(message))
        .then(|| message["rendered"].as_str().unwrap_or_default().to_owned())
}

fn is_bracket_of_ours(message: &Value) -> bool {
    let text = message["message"].as_str().unwrap_or_default();
    let target = text.strip_prefix("unresolved link to `").and_then(|rest| rest.strip_suffix('`'));
    message["code"]["code"] == "rustdoc::broken_intra_doc_links"
        && target.is_some_and(|target| UNITS.contains(&target) || is_citation_key(target))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn warning(code: &str, text: &str) -> String {
        serde_json::json!({"reason": "compiler-message", "message": {
            "level": "warning", "code": {"code": code}, "message": text, "rendered": text,
            "spans": [{"file_name": "a.rs"}],
        }})
        .to_string()
    }

    #[test]
    fn units_and_citations_pass() {
        for target in ["Hz", "m³", "Schroeder1965"] {
            let line = warning("rustdoc::broken_intra_doc_links", &format!("unresolved link to `{target}`"));
            assert_eq!(complaint(&line), None, "{target}");
        }
        assert_eq!(complaint("{\"reason\": \"build-finished\", \"success\": true}"), None);
    }

    #[test]
    fn broken_links_and_other_warnings_count() {
        for (code, text) in [
            ("rustdoc::broken_intra_doc_links", "unresolved link to `Reciever`"),
            ("rustdoc::invalid_html_tags", "unclosed HTML tag `B`"),
            ("rustdoc::private_intra_doc_links", "unresolved link to `Hz`"),
        ] {
            assert_eq!(complaint(&warning(code, text)).as_deref(), Some(text));
        }
    }
}
