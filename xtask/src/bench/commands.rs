//! What commands with default options cost, of this build and of others: CPU seconds of one run in turn with the others.
//!
//! Clocks of processors differ from run to run by up to a quarter: only rows of one run are compared, each the least of some repetitions.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use xtask::workspace;

const FOLDER: &str = "target/bench";
/// Times that each row is run by each build.
const TIMES: usize = 2;
/// Sources of the scene that is checked.
const SOURCES: usize = 12;

/// Words of one command, program first.
type Words = Vec<String>;

/// Commands that stand for one use.
struct Row {
    name: &'static str,
    /// Run first, and not timed.
    before: Vec<Words>,
    timed: Vec<Words>,
    /// The file whose size is shown.
    file: Option<String>,
}

/// Runs all rows with the programs of this build and of the `others`, folders of programs, and prints seconds and ratios.
pub(super) fn compare(others: &[String]) -> Result<()> {
    let mut builds = vec![workspace::programs(workspace::Profile::Release)?];
    for other in others {
        builds.push(fs::canonicalize(other).with_context(|| format!("no folder of programs: {other}"))?);
    }
    println!("{:<34} {:>9}  others over it", "CPU seconds", "this");
    for row in rows()? {
        let mut least = vec![f64::INFINITY; builds.len()];
        let mut size = String::new();
        for _ in 0..TIMES {
            for (number, (build, least)) in builds.iter().zip(&mut least).enumerate() {
                match row.seconds(build) {
                    Ok(seconds) => *least = least.min(seconds),
                    // Another build need not know everything that scenes say.
                    Err(error) if number > 0 => eprintln!("{}: {error:#}", row.name),
                    Err(error) => return Err(error),
                }
            }
        }
        if let Some(file) = &row.file {
            let bytes = workspace::root().join(file).metadata()?.len();
            write!(size, "  {} MB", bytes / 1_000_000)?;
        }
        let ratios = least[1..].iter().map(|other| match other.is_finite() {
            true => format!("  {other:.2} ({:.2})", other / least[0]),
            false => "  cannot".to_owned(),
        });
        println!("{:<34} {:9.2}{}{size}", row.name, least[0], ratios.collect::<String>());
    }
    Ok(())
}

impl Row {
    /// User CPU seconds of the timed commands by the programs in `build`.
    fn seconds(&self, build: &Path) -> Result<f64> {
        let _ = fs::remove_dir_all(workspace::root().join(FOLDER));
        fs::create_dir_all(workspace::root().join(FOLDER))?;
        fs::write(workspace::root().join(format!("{FOLDER}/sources.toml")), many_sources()?)?;
        self.before.iter().try_for_each(|words| timed(build, words).map(drop))?;
        self.timed.iter().map(|words| timed(build, words)).sum()
    }
}

/// User CPU seconds of one command.
fn timed(build: &Path, words: &Words) -> Result<f64> {
    let program: PathBuf = build.join(&words[0]);
    let line = r#"TIMEFORMAT=%U; time "$@" >/dev/null 2>"$ERRORS""#;
    let mut bash = workspace::command("bash", &["-c", line, "bash"]);
    let errors = workspace::root().join(FOLDER).join("errors");
    bash.arg(&program).args(&words[1..]).env("ERRORS", &errors);
    let output = bash.output().context("bash measures the time")?;
    let said = || fs::read_to_string(&errors).unwrap_or_default();
    ensure!(output.status.success(), "{words:?}: {}{}", output.status, said());
    let text = String::from_utf8_lossy(&output.stderr);
    text.trim().parse().with_context(|| format!("no time: {text}"))
}

fn rows() -> Result<Vec<Row>> {
    let words = |line: String| -> Words { line.split(' ').map(str::to_owned).collect() };
    let trace =
        |scene: &str| words(format!("sonel-trace scenes/{scene}/scene.toml -o {FOLDER}/a.sonelmap --quiet"));
    let render =
        |more: &str| words(format!("sonel-render {FOLDER}/a.sonelmap -o {FOLDER}/a.npz --quiet{more}"));
    let parameters = || words(format!("sonel-analyze parameters {FOLDER}/a.npz --quiet"));
    let default = |name, scene: &str| Row {
        name,
        before: Vec::new(),
        timed: vec![trace(scene), render(""), parameters()],
        file: None,
    };
    let plot = format!(
        "sonel-analyze plot {FOLDER}/a.npz --what map --parameter c80 --band 1000 -o {FOLDER}/a.svg --quiet"
    );
    Ok(vec![
        default("hall, 6 receivers", "hall"),
        default("church, 5 receivers, 2 designs", "church"),
        default("classroom, 2 designs", "classroom"),
        default("office", "office"),
        Row {
            name: "office, a grid of receivers",
            before: Vec::new(),
            timed: vec![trace("office"), render(" --grid 1:19:10,1:9:5,1.2"), parameters()],
            file: None,
        },
        Row {
            name: "hall, render at all seats",
            before: vec![trace("hall")],
            timed: vec![render(" --audience seats --spacing 1.3")],
            file: Some(format!("{FOLDER}/a.npz")),
        },
        Row {
            name: "hall, map of C80 at some seats",
            before: vec![trace("hall"), render(" --audience seats --spacing 4")],
            timed: vec![words(plot)],
            file: None,
        },
        Row {
            name: "hall, check with 12 sources",
            before: Vec::new(),
            timed: vec![words(format!("sonel-trace check {FOLDER}/sources.toml"))],
            file: None,
        },
    ])
}

/// The hall with more sources on its stage.
fn many_sources() -> Result<String> {
    let mut text =
        workspace::read("scenes/hall/scene.toml")?.replace("\"hall.obj\"", "\"../../scenes/hall/hall.obj\"");
    for number in 1..SOURCES {
        let across = number as f64 - 6.0;
        write!(text, "\n[[sources]]\nname = \"s{number}\"\nposition = [{across}.25, 5.5, 2.4]\n")?;
    }
    Ok(text)
}
