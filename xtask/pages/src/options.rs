//! Tables of options in docs/interface.md and the keywords that Python shares with them, from the command lines of the programs.

use anyhow::{Context, Result};
use clap::{Arg, ArgAction, Command, CommandFactory};
use xtask::workspace;

const PAGE: &str = "docs/interface.md";
const PYTHON: &str = "python/package/sonel/__init__.py";

/// Options that every command has: the page explains them once.
const COMMON: [&str; 4] = ["quiet", "threads", "help", "version"];

/// Keywords of `trace` and `Map.render` in Python that mean what the option of that name means, in the same words.
const KEYWORDS: [(&str, &[&str]); 2] = [
    (
        "sonel-trace",
        &[
            "packets", "seed", "batches", "survival", "mode", "spectral", "duration", "effects", "until",
            "at_most", "memory",
        ],
    ),
    (
        "sonel-render",
        &[
            "grid",
            "bin",
            "estimator",
            "effects",
            "order",
            "batches",
            "radius",
            "rays",
            "directions",
            "materials",
            "memory",
        ],
    ),
];

/// Writes the tables and keywords.
pub(crate) fn run() -> Result<()> {
    workspace::write(PAGE, page(&workspace::read(PAGE)?)?)?;
    workspace::write(PYTHON, python(&workspace::read(PYTHON)?)?)
}

fn programs() -> [Command; 4] {
    [
        sonel_trace::Program::command(),
        sonel_render::Arguments::command(),
        sonel_view::Arguments::command(),
        sonel_analyze::Arguments::command(),
    ]
}

/// The page with the tables of the programs in place of its own.
fn page(page: &str) -> Result<String> {
    let mut page = page.to_owned();
    for mut program in programs() {
        program.build();
        let name = program.get_name().to_owned();
        let commands = program.get_subcommands().filter(|command| command.get_name() != "help");
        let commands = commands.map(|command| (format!("{name} {}", command.get_name()), table(command)));
        let tables = std::iter::once((name.clone(), table(&program))).chain(commands);
        for (name, table) in tables.filter_map(|(name, table)| Some((name, table?))) {
            page = workspace::with_block(&page, &name, &table)?;
        }
    }
    Ok(page)
}

/// The options of `command`; none where it has no own ones.
fn table(command: &Command) -> Option<String> {
    let own =
        |arg: &&Arg| !arg.is_positional() && !arg.is_hide_set() && !COMMON.contains(&arg.get_id().as_str());
    let rows: Vec<String> = command.get_arguments().filter(own).map(row).collect();
    (!rows.is_empty()).then(|| format!("| option | meaning | default |\n|---|---|---|\n{}", rows.concat()))
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

/// The module with the sentences of the programs for the shared keywords.
fn python(module: &str) -> Result<String> {
    let mut module = module.to_owned();
    for (program, keywords) in KEYWORDS {
        let program =
            programs().into_iter().find(|command| command.get_name() == program).context("no program")?;
        for keyword in keywords {
            let arg = program.get_arguments().find(|arg| arg.get_id() == *keyword);
            let arg = arg.with_context(|| format!("no option {keyword}"))?;
            module = with_entry(&module, program.get_name(), keyword, &in_python(arg))?;
        }
    }
    Ok(module)
}

/// The sentence of `arg` with options as keywords: `until` for --until.
fn in_python(arg: &Arg) -> String {
    let (meaning, default) = sentence(arg);
    let meaning = with_options(&meaning, |option| format!("`{}`", option.replace('-', "_")));
    if default.is_empty() { format!("{meaning}.") } else { format!("{meaning} (default {default}).") }
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

/// `module` with `sentence` below `keyword` in the section Parameters of the docstring that names `program`, wrapped.
fn with_entry(module: &str, program: &str, keyword: &str, sentence: &str) -> Result<String> {
    let lost = || format!("{PYTHON}: no parameter {keyword} in the docstring about {program}");
    let start = module.find(&format!("that of {program} with the options")).with_context(lost)?;
    let end = start + module[start..].find("\"\"\"").with_context(lost)?;
    let find = |indent: usize| {
        let line = format!("\n{}{keyword}\n", " ".repeat(indent));
        Some((start + module[start..end].find(&line)? + line.len(), indent + 4))
    };
    let (at, indent) = find(4).or_else(|| find(8)).with_context(lost)?;
    let (before, rest) = module.split_at(at);
    let deeper = " ".repeat(indent);
    let length: usize =
        rest.split_inclusive('\n').take_while(|line| line.starts_with(&deeper)).map(str::len).sum();
    Ok(format!("{before}{}{}", wrapped(sentence, indent), &rest[length..]))
}

/// Lines of at most 120 columns after `indent` blanks.
fn wrapped(text: &str, indent: usize) -> String {
    let mut lines = vec![" ".repeat(indent)];
    for word in text.split(' ') {
        let line = lines.last_mut().expect("a line");
        if line.trim().is_empty() {
            line.push_str(word);
        } else if line.chars().count() + 1 + word.chars().count() <= 120 {
            line.push(' ');
            line.push_str(word);
        } else {
            lines.push(" ".repeat(indent) + word);
        }
    }
    lines.join("\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `cargo pages options` has been run.
    #[test]
    fn page_and_keywords_say_what_the_programs_say() {
        let own = workspace::read(PAGE).unwrap();
        assert!(own == page(&own).unwrap(), "{PAGE} is behind: run `cargo pages options`");
        let own = workspace::read(PYTHON).unwrap();
        assert!(own == python(&own).unwrap(), "{PYTHON} is behind: run `cargo pages options`");
    }

    #[test]
    fn a_changed_sentence_is_noticed() {
        let own = workspace::read(PAGE).unwrap();
        let other = own.replace("| `--seed", "| another `--seed");
        assert_ne!(other, page(&other).unwrap());
        let own = workspace::read(PYTHON).unwrap();
        let other = own.replace("\n    seed\n        ", "\n    seed\n        another ");
        assert_ne!(other, python(&other).unwrap());
    }

    #[test]
    fn sentences_speak_of_keywords() {
        let arg = Arg::new("rays").long("rays").help("Rays; with --until, the maximum [default: 3].");
        assert_eq!(in_python(&arg), "Rays; with `until`, the maximum (default 3).");
    }
}
