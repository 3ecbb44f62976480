//! Tables of options in docs/interface.md, from the command lines of the programs.

use anyhow::Result;
use clap::{Arg, ArgAction, Command, CommandFactory};
use xtask::workspace;

const PAGE: &str = "docs/interface.md";

/// Options that the page explains once for all commands.
const COMMON: [&str; 5] = ["output", "quiet", "threads", "help", "version"];

/// Writes the tables.
pub(crate) fn run() -> Result<()> {
    workspace::write(PAGE, page(&workspace::read(PAGE)?)?)
}

fn programs() -> [Command; 4] {
    [
        sonel_trace::Program::command(),
        sonel_render::Arguments::command(),
        sonel_view::Arguments::command(),
        sonel_analyze::Arguments::command(),
    ]
}

/// An option as a row of a table, with the commands that have it: names of their programs and their own.
struct Row {
    cells: String,
    commands: Vec<(String, String)>,
}

/// The page with the tables of the programs in place of its own. What several programs have is in a table of its own.
fn page(page: &str) -> Result<String> {
    let rows = rows();
    let is_of = |row: &Row, name: &str| row.commands.iter().all(|(program, _)| program == name);
    let mut page = page.to_owned();
    for program in programs() {
        let name = program.get_name();
        page = workspace::with_block(&page, name, &table(rows.iter().filter(|row| is_of(row, name))))?;
    }
    let shared = rows.iter().filter(|row| !is_of(row, &row.commands[0].0));
    workspace::with_block(&page, "shared", &table(shared))
}

/// The options of all commands, each once.
fn rows() -> Vec<Row> {
    let mut rows: Vec<Row> = Vec::new();
    for mut program in programs() {
        program.build();
        let name = program.get_name().to_owned();
        let others = program.get_subcommands().filter(|command| command.get_name() != "help");
        for command in std::iter::once(&program).chain(others) {
            let label = (name.clone(), command.get_name().to_owned());
            let own = |arg: &&Arg| {
                !arg.is_positional() && !arg.is_hide_set() && !COMMON.contains(&arg.get_id().as_str())
            };
            for cells in command.get_arguments().filter(own).map(cells) {
                match rows.iter_mut().find(|row| row.cells == cells) {
                    Some(row) => row.commands.push(label.clone()),
                    None => rows.push(Row { cells, commands: vec![label.clone()] }),
                }
            }
        }
    }
    rows
}

/// Rows with a column of commands, unless all are of one command.
fn table<'a>(rows: impl Iterator<Item = &'a Row> + Clone) -> String {
    let first = rows.clone().next().map(|row| &row.commands);
    let is_plain = rows.clone().all(|row| Some(&row.commands) == first);
    let names = |row: &Row| {
        row.commands.iter().map(|(_, command)| format!("`{command}`")).collect::<Vec<_>>().join(", ")
    };
    if is_plain {
        let rows: String = rows.map(|row| format!("{}\n", row.cells)).collect();
        return format!("| option | meaning | default |\n|---|---|---|\n{rows}");
    }
    let rows: String = rows.map(|row| format!("{} {} |\n", row.cells, names(row))).collect();
    format!("| option | meaning | default | of |\n|---|---|---|---|\n{rows}")
}

/// The cells of an option, without those of its commands.
fn cells(arg: &Arg) -> String {
    let (meaning, default) = sentence(arg);
    let default = if arg.is_required_set() { "required".to_owned() } else { default };
    let cell = |text: &str| text.replace('|', "\\|");
    let [meaning, default] =
        [meaning, default].map(|text| cell(&with_options(&text, |option| format!("`--{option}`"))));
    format!("| {} | {meaning} | {default} |", cell(&spelling(arg)))
}

/// `-o`, `--output MAP`: how it is written.
fn spelling(arg: &Arg) -> String {
    let short = arg.get_short().map(|short| format!("`-{short}`, ")).unwrap_or_default();
    let value = match arg.get_value_names() {
        Some(names) if arg.get_action().takes_values() => format!(" {}", names.join(" ")),
        _ => String::new(),
    };
    format!("{short}`--{}{value}`", arg.get_long().unwrap_or_default())
}

/// What the option means, as `-h` says it, and its default.
fn sentence(arg: &Arg) -> (String, String) {
    let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    let (help, stated) = match help.split_once(" [default: ") {
        Some((before, rest)) => {
            let (default, after) = rest.split_once(']').unwrap_or((rest, ""));
            (format!("{before}{after}"), default.to_owned())
        }
        None => (help, String::new()),
    };
    let values = arg.get_default_values().iter().map(|value| value.to_string_lossy());
    let default = match arg.get_action() {
        ArgAction::SetTrue | ArgAction::Count => stated,
        _ if stated.is_empty() => values.collect::<Vec<_>>().join(", "),
        _ => stated,
    };
    (help.trim_end_matches('.').to_owned(), default)
}

/// `text` with the names of options in it as `spell` writes them, their dashes included.
fn with_options(text: &str, spell: impl Fn(&str) -> String) -> String {
    let word = |word: &str| match word.split_once("--") {
        Some((before, rest)) => {
            let is_part = |letter: char| letter.is_ascii_lowercase() || letter == '-';
            let end = rest.find(|letter| !is_part(letter)).unwrap_or(rest.len());
            format!("{before}{}{}", spell(&rest[..end]), &rest[end..])
        }
        None => word.to_owned(),
    };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `cargo pages options` has been run.
    #[test]
    fn the_page_says_what_the_programs_say() {
        let own = workspace::read(PAGE).unwrap();
        assert!(own == page(&own).unwrap(), "{PAGE} is behind: run `cargo pages options`");
    }

    /// `-h` and the tables have a few words for each option, `--help` a paragraph.
    #[test]
    fn every_option_has_a_short_text() {
        let is_short = |row: &str| row.split(" | ").nth(1).is_some_and(|text| text.split(' ').count() <= 8);
        let long: Vec<String> =
            rows().into_iter().map(|row| row.cells).filter(|row| !is_short(row)).collect();
        assert!(long.is_empty(), "a paragraph belongs behind an empty line: {long:#?}");
        assert!(!is_short("| `--seed N` | The seed of all random numbers in this very run | 1 |"));
    }

    #[test]
    fn a_changed_sentence_is_noticed() {
        let own = workspace::read(PAGE).unwrap();
        let other = own.replace("| `--seed", "| another `--seed");
        assert_ne!(other, page(&other).unwrap());
    }
}
