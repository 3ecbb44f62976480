//! `sonel-analyze plot`: echogram, decay and parameters of responses as SVG.

use std::io::Write;
use std::path::Path;

use anyhow::{Context, bail};
use sonel_analysis::plot::{self, Panel, Sheet};
use sonel_analysis::{ReceiverParameters, parameters};
use sonel_console::Outcome;
use sonel_console::output::{Kind, Output, has_ending};
use sonel_echogram::Response;

use crate::arguments::{Plot, What};
use crate::open;

/// Panels side by side.
const COLUMNS: usize = 3;

/// Draws what is asked for.
///
/// # Errors
/// When a response is unusable or lacks the source or receiver asked for, or the output has another ending or cannot be
/// written.
pub fn run(arguments: &Plot, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let output = &arguments.output;
    if !has_ending(output, "svg") {
        bail!("{} does not end in .svg: plots are drawn as SVG only", output.display());
    }
    let subjects: Vec<Subject> =
        arguments.responses.iter().map(|path| Subject::open(path, arguments)).collect::<Result<_, _>>()?;
    for subject in &subjects {
        subject.log_what_is_left_out(log)?;
    }
    let wanted = |what| arguments.what.is_empty() || arguments.what.contains(&what);
    let mut rows = Vec::new();
    if wanted(What::Echogram) {
        rows.extend(in_rows(subjects.iter().map(|subject| subject.panel(plot::echogram)).collect()));
    }
    if wanted(What::Decay) {
        rows.extend(in_rows(subjects.iter().map(|subject| subject.panel(plot::decay)).collect()));
    }
    let parameters: Vec<(String, ReceiverParameters)> = if wanted(What::Parameters) {
        subjects.iter().map(Subject::parameters).collect()
    } else {
        Vec::new()
    };
    if !parameters.is_empty() {
        let named: Vec<_> = parameters.iter().map(|(name, parameters)| (name.clone(), parameters)).collect();
        rows.extend(in_rows(plot::parameters(&named)));
    }
    let scene = subjects[0].response.metadata["scene"].as_str().unwrap_or_default().to_owned();
    let mut target = Output::create(output, Kind::DRAWING, &arguments.responses)?;
    plot::svg(&Sheet { title: scene, rows }, target.writer())
        .with_context(|| format!("cannot write {}; an older file there is untouched", output.display()))?;
    target.publish()?;
    writeln!(log, "written to {}; lines and points with 95 % intervals", output.display())?;
    Ok(Outcome::Done)
}

/// A source at a receiver of a response.
struct Subject {
    name: String,
    response: Response,
    source: usize,
    receiver: usize,
}

impl Subject {
    fn open(path: &Path, arguments: &Plot) -> anyhow::Result<Self> {
        let response = open::response(path)?;
        let find = |what: &str, names: &[String], wanted: Option<&String>| match wanted {
            None if names.is_empty() => bail!("{} holds no {what}", path.display()),
            None => Ok(0),
            Some(wanted) => names.iter().position(|name| name == wanted).with_context(|| {
                format!("{} has no {what} \"{wanted}\"; it has {}", path.display(), names.join(", "))
            }),
        };
        let source = find("source", &response.source_names, arguments.source.as_ref())?;
        let receiver = find("receiver", &response.receiver_names, arguments.receiver.as_ref())?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { name, response, source, receiver })
    }

    fn panel(&self, of: impl Fn(&Response, usize, usize) -> Panel) -> Panel {
        let panel = of(&self.response, self.source, self.receiver);
        Panel { title: format!("{}, {}", panel.title, self.name), ..panel }
    }

    fn parameters(&self) -> (String, ReceiverParameters) {
        let at = self.source * self.response.receivers() + self.receiver;
        (self.name.clone(), parameters(&self.response).swap_remove(at))
    }

    fn log_what_is_left_out(&self, log: &mut dyn Write) -> std::io::Result<()> {
        let (sources, receivers) = (self.response.sources(), self.response.receivers());
        if sources * receivers == 1 {
            return Ok(());
        }
        writeln!(
            log,
            "note: {}: {sources} sources and {receivers} receivers; drawn are \"{}\" and \"{}\": choose others with --source and --receiver",
            self.name, self.response.source_names[self.source], self.response.receiver_names[self.receiver]
        )
    }
}

fn in_rows(panels: Vec<Panel>) -> Vec<Vec<Panel>> {
    panels.chunks(COLUMNS).map(<[Panel]>::to_vec).collect()
}
