//! Builds the documentation and accepts no warning, but lets bare brackets hold units, shapes and citations.
//!
//! rustdoc takes `[Hz]` and `[Schroeder1965]` for links to items. Here links to items have backticks (STYLE.md), so an
//! unresolved link counts if it has them or an explicit target. That citations resolve is checked by `cargo xtask tidy`.

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use xtask::workspace;

/// Documents every crate of ours; an error if rustdoc has anything to say.
pub(crate) fn check() -> Result<()> {
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
    (counts && located && !is_bare_bracket(message))
        .then(|| message["rendered"].as_str().unwrap_or_default().to_owned())
}

/// Whether the warning is about a word in brackets without backticks.
fn is_bare_bracket(message: &Value) -> bool {
    let unresolved = message["message"].as_str().is_some_and(|text| text.starts_with("unresolved link to"));
    let place = &message["spans"][0]["text"][0];
    let before = place["highlight_start"].as_u64().and_then(|column| (column as usize).checked_sub(2));
    let line = place["text"].as_str().unwrap_or_default();
    unresolved
        && message["code"]["code"] == "rustdoc::broken_intra_doc_links"
        && before.and_then(|at| line.chars().nth(at)) == Some('[')
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A warning about the word between the bars.
    fn warning(code: &str, line: &str) -> String {
        let start = line.chars().position(|c| c == '|').unwrap() + 1;
        let line = line.replace('|', "");
        serde_json::json!({"reason": "compiler-message", "message": {
            "level": "warning", "code": {"code": code}, "message": "unresolved link to `x`", "rendered": line,
            "spans": [{"text": [{"text": line, "highlight_start": start}]}],
        }})
        .to_string()
    }

    #[test]
    fn bare_brackets_pass() {
        for line in ["/// Path [|m|].", "//! See [|Schroeder1965|].", "/// ρ by [source][|receiver|]"] {
            assert_eq!(complaint(&warning("rustdoc::broken_intra_doc_links", line)), None, "{line}");
        }
        assert_eq!(complaint("{\"reason\": \"build-finished\", \"success\": true}"), None);
    }

    #[test]
    fn broken_links_and_other_warnings_count() {
        for (code, line) in [
            ("rustdoc::broken_intra_doc_links", "/// A [`|Reciever|`]."),
            ("rustdoc::broken_intra_doc_links", "/// A [seat](|Reciever|)."),
            ("rustdoc::private_intra_doc_links", "/// A [|Hz|]."),
        ] {
            assert!(complaint(&warning(code, line)).is_some(), "{line}");
        }
    }
}
