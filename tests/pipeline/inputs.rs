//! A file that is read is never an output: every input of every program against every output.

use std::path::{Path, PathBuf};

use clap::builder::ValueParser;
use clap::{Arg, Command, CommandFactory};
use sonel_console::inputs::{OUTPUTS, REPLACEABLE, named_by};

const FILE: &str = "same.file";

/// Programs and their commands, each with the words that call it.
fn commands() -> Vec<(Vec<String>, Command)> {
    let programs = [
        sonel_trace::Program::command(),
        sonel_render::Arguments::command(),
        sonel_view::Arguments::command(),
        sonel_analyze::Arguments::command(),
    ];
    let with_commands = |program: Command| {
        let words = vec![program.get_name().to_owned()];
        let below: Vec<_> = program
            .get_subcommands()
            .map(|below| ([words.clone(), vec![below.get_name().to_owned()]].concat(), below.clone()))
            .collect();
        std::iter::once((words, program)).chain(below)
    };
    programs.into_iter().flat_map(with_commands).collect()
}

fn is_path(argument: &Arg) -> bool {
    argument.get_value_parser().type_id() == ValueParser::path_buf().type_id()
}

fn is_output(argument: &Arg) -> bool {
    OUTPUTS.contains(&argument.get_id().as_str())
}

/// The words of an argument with a value.
fn given(argument: &Arg, value: &str) -> Vec<String> {
    match argument.get_long() {
        Some(long) => vec![format!("--{long}"), value.to_owned()],
        None => vec![value.to_owned()],
    }
}

/// Files that are inputs where `words` are given; whatever else is required may be missing.
fn named(words: &[String]) -> Vec<PathBuf> {
    let programs = commands().into_iter().filter(|(call, _)| call[..] == words[..1]);
    let parsed =
        programs.filter_map(|(_, program)| program.ignore_errors(true).try_get_matches_from(words).ok());
    parsed.flat_map(|matches| named_by(&matches)).collect()
}

#[test]
fn every_input_of_every_program_is_kept_from_every_output() {
    let mut pairs = 0;
    for (call, command) in commands() {
        let (outputs, inputs): (Vec<&Arg>, Vec<&Arg>) = command
            .get_arguments()
            .filter(|argument| is_path(argument))
            .partition(|argument| is_output(argument));
        for (input, output) in
            inputs.iter().flat_map(|input| outputs.iter().map(move |output| (input, output)))
        {
            let words = [call.clone(), given(output, FILE), given(input, FILE)].concat();
            let is_kept = named(&words).contains(&PathBuf::from(FILE));
            assert_eq!(is_kept, input.get_id().as_str() != REPLACEABLE, "{words:?}");
            pairs += 1;
        }
        for output in outputs {
            let words = [call.clone(), given(output, FILE)].concat();
            assert!(!named(&words).iter().any(|path| path == Path::new(FILE)), "{words:?}");
        }
    }
    assert!(pairs >= 20, "{pairs}");
}

#[test]
fn files_in_values_are_inputs() {
    let words = ["sonel-render", "a.sonelmap", "--set", "sources.stage.directivity=same.file", "-o", "a.npz"];
    assert!(named(&words.map(str::to_owned)).contains(&PathBuf::from(FILE)));
}

#[test]
fn arguments_that_are_written_are_listed_as_outputs() {
    for (call, command) in commands() {
        for argument in command.get_arguments().filter(|argument| is_path(argument)) {
            let help = argument.get_help().map(ToString::to_string).unwrap_or_default();
            let is_written =
                ["to write", "Write the mesh", "Folder "].iter().any(|words| help.contains(words));
            assert_eq!(is_written, is_output(argument), "{call:?} {}: {help}", argument.get_id());
        }
    }
}
