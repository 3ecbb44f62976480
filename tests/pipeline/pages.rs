//! Commands on the pages are commands: every option of every example is one.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Parser;

/// Fewest commands that the pages have: the test cannot pass by finding none.
const LEAST: usize = 55;

fn pages(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder of pages") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            pages(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "md") {
            found.push(path);
        }
    }
}

/// Words of a command as a shell divides them, up to a comment or another command.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut word, mut quote, mut is_begun) = (Vec::new(), String::new(), None, false);
    for letter in line.chars() {
        match (quote, letter) {
            (Some(mark), letter) if letter == mark => quote = None,
            (Some(_), letter) => word.push(letter),
            (None, '"' | '\'') => (quote, is_begun) = (Some(letter), true),
            (None, '|' | ';' | '>' | '&') => break,
            (None, '#') if !is_begun => break,
            (None, letter) if letter.is_whitespace() => {
                if is_begun {
                    words.push(std::mem::take(&mut word));
                }
                is_begun = false;
            }
            (None, letter) => {
                word.push(letter);
                is_begun = true;
            }
        }
    }
    if is_begun {
        words.push(word);
    }
    words
}

/// Commands of the programs in the fenced blocks of a page.
fn commands(page: &str) -> Vec<Vec<String>> {
    let mut is_block = false;
    let mut found = Vec::new();
    for line in page.replace("\\\n", " ").lines() {
        if line.starts_with("```") {
            is_block = !is_block;
            continue;
        }
        let line = line.trim_start_matches("$ ").trim_start_matches("target/release/");
        let line =
            line.split_once("--bin ").map_or(line.to_owned(), |(_, rest)| rest.replacen(" -- ", " ", 1));
        let words = words(&line);
        if is_block && words.first().is_some_and(|word| word.starts_with("sonel-")) {
            found.push(words);
        }
    }
    found
}

fn parse(words: &[String]) -> Result<(), clap::Error> {
    match words[0].as_str() {
        "sonel-trace" => sonel_trace::Program::try_parse_from(words).map(drop),
        "sonel-render" => sonel_render::Arguments::try_parse_from(words).map(drop),
        "sonel-view" => sonel_view::Arguments::try_parse_from(words).map(drop),
        "sonel-analyze" => sonel_analyze::Arguments::try_parse_from(words).map(drop),
        other => panic!("{other} is no program"),
    }
}

#[test]
fn every_command_on_a_page_is_one() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut files = vec![root.join("README.md")];
    pages(&root.join("docs"), &mut files);
    let (mut count, mut wrong) = (0, Vec::new());
    for file in files {
        for words in commands(&fs::read_to_string(&file).unwrap()) {
            count += 1;
            if let Err(error) = parse(&words) {
                wrong.push(format!("{}: {}\n{error}", file.display(), words.join(" ")));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(count >= LEAST, "only {count} commands found");
}

#[test]
fn a_wrong_option_is_found() {
    let [right, wrong] = ["--packets 2k", "--pakets 2k"].map(|option| {
        let page = format!("```\nsonel-trace a.toml -o \"b c.sonelmap\" {option}    # words\n```\n");
        commands(&page).remove(0)
    });
    assert_eq!(right.len(), 6);
    assert!(parse(&right).is_ok() && parse(&wrong).is_err());
}
