//! `sonel-trace materials`: searches the shipped library and material files.

use std::io::Write;
use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use sonel::analysis::report::aligned;
use sonel::scenes::library::{LibraryEntry, Octaves, read_file, shipped};
use sonel_console::{Common, Outcome, input};

/// Octaves that are printed [Hz].
const OCTAVES: [f64; 8] = [63.0, 125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0];

/// Search the material library; exit code 1 if nothing matches
///
/// Prints absorption (α) and scattering (s) of every material whose name, text, group or source has all words. The key
/// `library` of a scene takes these names.
#[derive(Debug, Clone, Args)]
#[command(
    after_long_help = "Examples:\n  sonel-trace materials carpet felt\n  sonel-trace materials --file Material.Li8 concrete"
)]
pub(crate) struct Words {
    /// Words that must all occur [default: all materials are printed].
    #[arg(value_name = "WORD")]
    words: Vec<String>,
    /// Search this material file; repeatable [default: the library].
    ///
    /// A file of CATT, ODEON (.Li8) or pyroomacoustics (.json).
    #[arg(long, value_name = "FILE")]
    file: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) common: Common,
}

/// Prints what matches.
///
/// # Errors
/// When a file cannot be read.
pub(crate) fn run(words: &Words, out: &mut dyn Write) -> anyhow::Result<Outcome> {
    let mut entries = Vec::new();
    for path in &words.file {
        let name = path.display().to_string();
        let bytes = input::read(path).with_context(|| format!("cannot read {name}"))?;
        entries.extend(read_file(&name, &bytes)?);
    }
    if words.file.is_empty() {
        entries = shipped().to_vec();
    }
    let mut found: Vec<&LibraryEntry> = entries.iter().filter(|entry| entry.matches(&words.words)).collect();
    found.sort_by_key(|entry| !is_called(entry, &words.words));
    if found.is_empty() {
        writeln!(out, "none of {} materials matches {}", entries.len(), words.words.join(" "))?;
        return Ok(Outcome::Missed);
    }
    write!(out, "{}", table(&found))?;
    Ok(Outcome::Done)
}

/// Whether name or text of `entry` has all `words` as whole words: such entries are printed first.
fn is_called(entry: &LibraryEntry, words: &[String]) -> bool {
    let text = format!("{} {}", entry.name, entry.text).to_lowercase();
    let whole: Vec<&str> = text.split(|letter: char| !letter.is_alphanumeric()).collect();
    words.iter().all(|word| whole.contains(&word.to_lowercase().as_str()))
}

fn table(entries: &[&LibraryEntry]) -> String {
    let centers = OCTAVES.map(|hz| hz.to_string());
    let headings =
        [vec!["name".to_owned(), String::new()], centers.to_vec(), vec!["what it is, source".to_owned()]];
    let (mut rows, mut is_held) = (Vec::new(), false);
    for entry in entries {
        let lists = [("α", &entry.absorption), ("s", &entry.scattering)];
        let lists = lists.into_iter().filter_map(|(symbol, octaves)| Some((symbol, octaves.as_ref()?)));
        for (i, (symbol, octaves)) in lists.enumerate() {
            is_held |= OCTAVES.iter().any(|hz| octaves.at(*hz).1);
            let (name, text) = if i == 0 {
                (entry.name.as_str(), format!("{}; {}", entry.text, entry.source))
            } else {
                Default::default()
            };
            let begin = [name.to_owned(), symbol.to_owned()];
            rows.push(begin.into_iter().chain(cells(octaves)).chain([text]).collect::<Vec<_>>());
        }
    }
    let note = if is_held { "*: held from the nearest octave of the source\n" } else { "" };
    aligned(headings.concat(), rows, 2..2 + OCTAVES.len()) + note
}

/// Two digits and, where a value is held, a star.
fn cells(octaves: &Octaves) -> impl Iterator<Item = String> {
    OCTAVES
        .map(|hz| octaves.at(hz))
        .into_iter()
        .map(|(value, held)| format!("{value:.2}{}", if held { "*" } else { " " }))
}
