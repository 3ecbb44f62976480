//! Options, names and files that a person would choose and a random generator would not (docs/stability.md).

use clap::CommandFactory;

use crate::{SCENE, render, test_folder, trace};

/// The message of a refusal.
fn refusal(result: anyhow::Result<String>) -> String {
    format!("{:#}", result.expect_err("no sensible choice"))
}

#[test]
fn numbers_below_zero_are_named_with_what_is_allowed() {
    let folder = test_folder();
    for (option, value, words) in [
        ("--packets", "-5", "is not a count"),
        ("--seed", "-1", "invalid value '-1' for '--seed"),
        ("--batches", "-1", "-1 is not in 1..=4096"),
        ("--threads", "-1", "give 1 … 1024 threads"),
    ] {
        let error = refusal(trace(&folder, "a.sonelmap", &[option, value]));
        assert!(error.contains(words), "{option}: {error}");
    }
    trace(&folder, "a.sonelmap", &["--packets", "200"]).expect("a valid scene");
    for (option, value, words) in [
        ("--bin", "-1", "give a width above 0"),
        ("--rays", "-1", "is not a count"),
        ("--rays", "0", "give 1 … 4294967295 rays"),
        ("--radius", "-1", "must be above 0 m"),
        ("--humidity", "-1", "outside 0 … 100"),
        ("--grid", "0:5:1000,0:4:1000,1", "1000000 points are more than 100000"),
    ] {
        let error = refusal(render(&folder, "a.sonelmap", "a.npz", &[option, value]));
        assert!(error.contains(words), "{option}: {error}");
    }
    render(&folder, "a.sonelmap", "a.npz", &["--rays", "1k"]).expect("a count as everywhere");
}

#[test]
fn endings_of_other_files_and_streams_are_no_outputs() {
    let folder = test_folder();
    for target in ["room.npz", "scene.toml", "room.CSV"] {
        let error = refusal(trace(&folder, target, &["--packets", "200"]));
        assert!(error.contains("choose such a name") || error.contains("is an input"), "{target}: {error}");
    }
    for target in ["room", "Größe, 1.sonelmap", "Saal mit Leerzeichen.map"] {
        trace(&folder, target, &["--packets", "200"]).expect("a name like any other");
    }
    assert!(refusal(render(&folder, "room", "room.csv", &[])).contains("a response ends in .npz"));
    render(&folder, "room", "response", &["--rays", "64"]).expect("a name like any other");
}

#[test]
fn examples_of_the_help_fit_a_terminal_of_80_columns() {
    fn check(command: &clap::Command) {
        let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        for line in help.lines().filter(|line| line.starts_with("  ")) {
            assert!(line.chars().count() <= 80, "{}: {line}", command.get_name());
        }
        command.get_subcommands().for_each(check);
    }
    check(&sonel_trace::Program::command());
    check(&sonel_render::Arguments::command());
    check(&sonel_analyze::Arguments::command());
}

#[test]
fn a_limit_without_unit_is_said_to_have_none() {
    let error = refusal(trace(&test_folder(), "a.sonelmap", &["--until", "level<0.1"]));
    assert!(error.contains("the limit of level has no unit: write level<0.1dB"), "{error}");
}

#[test]
fn lists_of_receivers_are_read_line_by_line() {
    let folder = test_folder();
    trace(&folder, "a.sonelmap", &["--packets", "200"]).expect("a valid scene");
    let file = folder.path("list.csv").display().to_string();
    let with = |text: &str| {
        folder.write("list.csv", text);
        render(&folder, "a.sonelmap", "a.npz", &["--receivers", &file, "--rays", "64"])
    };
    for (text, words) in [
        ("", "the header is \"\""),
        ("name;x;y;z\na;1;2;1\n", "must be \"name,x,y,z\""),
        ("name,x,y,z\n", "list.csv: no receivers"),
        ("name,x,y,z\na,1,2\nb,1,2,1,5\n", "list.csv:3: write a name and three numbers"),
        ("name,x,y,z\na,\"1,5\",2,1\n", "list.csv:2: write a name and three numbers"),
        ("name,x,y,z\na,nan,2,1\n", "not finite"),
    ] {
        let error = refusal(with(text));
        assert!(error.contains(words), "{text}: {error}");
    }
    with("\u{feff}Name,X,Y,Z\r\n\"Reihe 3, Platz \"\"5\"\"\",2,2,1\r\n\r\n")
        .expect("as a spreadsheet writes it");
}

#[test]
fn third_octaves_without_their_width_are_recognised() {
    let folder = test_folder();
    let thirds = SCENE.replace("[250, 500, 1000]", "[800, 1000, 1250]");
    folder.write("scene.toml", &thirds);
    let error = refusal(trace(&folder, "a.sonelmap", &[]));
    assert!(error.contains("these are third octaves; add width = \"third\""), "{error}");
    assert_eq!(error.lines().count(), 1, "{error}");
}

/// `--until` of both programs and the `--parameter` of a plan.
#[test]
fn help_lists_the_parameters_that_are_read() {
    let analyze = sonel_analyze::Arguments::command();
    let mut commands: Vec<clap::Command> = analyze.get_subcommands().cloned().collect();
    commands.extend([sonel_trace::Arguments::command(), sonel_render::Arguments::command()]);
    let arguments = commands.iter().flat_map(clap::Command::get_arguments);
    let helps = arguments.filter_map(|argument| argument.get_long_help()).map(ToString::to_string);
    let lists: Vec<String> = helps.filter(|help| help.contains("level, ")).collect();
    assert_eq!(lists.len(), 3, "{lists:#?}");
    let names = sonel::study::target::names();
    for list in lists {
        assert!(list.replace(" or ", ", ").contains(&names), "{list}");
    }
}
