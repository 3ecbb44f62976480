//! Tables of options in docs/interface.md, from the command lines of the programs.

use anyhow::Result;
use clap::{Arg, ArgAction, Command, CommandFactory};
use xtask::workspace;

const PAGE: &str = "docs/interface.md";

/// Options that every command has: the page explains them once.
const COMMON: [&str; 4] = ["quiet", "threads", "help", "version"];

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

/// A command with the rows of its options.
type Rows = (String, Vec<String>);

/// The page with the tables of the programs in place of its own. What several commands have is in a table of its own.
fn page(page: &str) -> Result<String> {
    let mut commands: Vec<Rows> = Vec::new();
    for mut program in programs() {
        program.build();
        let name = program.get_name().to_owned();
        commands.push((name.clone(), rows(&program)));
        let others = program.get_subcommands().filter(|command| command.get_name() != "help");
        commands.extend(others.map(|command| (format!("{name} {}", command.get_name()), rows(command))));
    }
    let is_shared = |row: &&String| commands.iter().filter(|(_, rows)| rows.contains(row)).count() > 1;
    let mut shared: Vec<String> = Vec::new();
    let mut page = page.to_owned();
    for (name, rows) in commands.iter().filter(|(_, rows)| !rows.is_empty()) {
        let (also, own): (Vec<&String>, Vec<&String>) = rows.iter().partition(is_shared);
        let mut block = if own.is_empty() { String::new() } else { table(own) };
        if !also.is_empty() {
            let names = also.iter().filter_map(|row| row.split(" | ").next()?.strip_prefix("| "));
            let space = if block.is_empty() { "" } else { "\n" };
            block = format!(
                "{block}{space}[Shared](#shared-options): {}.\n",
                names.collect::<Vec<_>>().join("; ")
            );
        }
        page = workspace::with_block(&page, name, &block)?;
        let new: Vec<String> = also.into_iter().filter(|row| !shared.contains(row)).cloned().collect();
        shared.extend(new);
    }
    workspace::with_block(&page, "shared", &table(shared.iter().collect()))
}

fn table(rows: Vec<&String>) -> String {
    format!(
        "| option | meaning | default |\n|---|---|---|\n{}",
        rows.into_iter().map(String::as_str).collect::<String>()
    )
}

/// The options of `command`.
fn rows(command: &Command) -> Vec<String> {
    let own =
        |arg: &&Arg| !arg.is_positional() && !arg.is_hide_set() && !COMMON.contains(&arg.get_id().as_str());
    command.get_arguments().filter(own).map(row).collect()
}

fn row(arg: &Arg) -> String {
    let (meaning, default) = sentence(arg);
    let default = if arg.is_required_set() { "required".to_owned() } else { default };
    let cell = |text: &str| text.replace('|', "\\|");
    let [meaning, default] =
        [meaning, default].map(|text| cell(&with_options(&text, |option| format!("`--{option}`"))));
    format!("| {} | {meaning} | {default} |\n", cell(&spelling(arg)))
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

/// What the option means, and its default.
fn sentence(arg: &Arg) -> (String, String) {
    let help = arg.get_long_help().or_else(|| arg.get_help()).map(ToString::to_string).unwrap_or_default();
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

    #[test]
    fn a_changed_sentence_is_noticed() {
        let own = workspace::read(PAGE).unwrap();
        let other = own.replace("| `--seed", "| another `--seed");
        assert_ne!(other, page(&other).unwrap());
    }
}
