//! `sonel-analyze plot`: curves and parameters of responses, early reflections, and plans of their receivers, as SVG or PNG.

mod plans;

use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use sonel::analysis::modulation::Talk;
use sonel::analysis::receiver::parameters_at;
use sonel::analysis::{Parameter, ReceiverParameters};
use sonel::drawing::plot::{self, Panel, PlotError, Sheet};
use sonel::echograms::Echograms;
use sonel::names::band;
use sonel_console::Outcome;
use sonel_console::artifact::{Artifact, stem};
use sonel_console::output::{Kind, Output, has_ending};
use sonel_console::quantity::counted;

use crate::arguments::{Plot, What};
use crate::open;

/// Panels side by side.
const COLUMNS: usize = 3;
/// What is drawn where nothing is asked for.
const USUAL: [What; 3] = [What::Echogram, What::Decay, What::Parameters];

/// Draws what is asked for.
///
/// # Errors
/// When a file is unusable, a response lacks the source, receiver or band asked for, or the output has another ending or cannot be
/// written.
pub(crate) fn run(arguments: &Plot, log: &mut dyn Write) -> anyhow::Result<Outcome> {
    let target = Target::create(&arguments.output)?;
    let wanted =
        |what| if arguments.what.is_empty() { &USUAL[..] } else { &arguments.what[..] }.contains(&what);
    let (responses, map) = sorted(&arguments.files)?;
    if map.is_some() && !wanted(What::Map) {
        bail!("only --what map uses a map: add it, or omit the map");
    }
    let subjects: Vec<Subject> =
        responses.iter().map(|path| Subject::open(path, arguments)).collect::<Result<_, _>>()?;
    for subject in &subjects {
        subject.log_what_is_left_out(arguments, log)?;
    }
    let mut sheet =
        Sheet::new(subjects[0].response.provenance.scene.as_deref().unwrap_or_default(), Vec::new());
    if wanted(What::Echogram) {
        sheet.rows.extend(in_rows(subjects.iter().map(|subject| subject.panel(plot::echogram)).collect()));
    }
    if wanted(What::Decay) {
        sheet.rows.extend(in_rows(subjects.iter().map(|subject| subject.panel(plot::decay)).collect()));
    }
    if wanted(What::Early) {
        let panels: Vec<Panel> =
            subjects.iter().map(|subject| subject.early(arguments.band)).collect::<Result<_, _>>()?;
        sheet.rows.extend(panels.into_iter().map(|panel| vec![panel]));
    }
    if wanted(What::Parameters) {
        let read: Vec<(String, ReceiverParameters)> = subjects.iter().map(Subject::parameters).collect();
        let named: Vec<_> = read.iter().map(|(name, parameters)| (name.clone(), parameters)).collect();
        sheet.rows.extend(in_rows(plot::parameters(&named)));
    }
    if wanted(What::Map) {
        sheet.plans = Some(plans::of(&subjects, map.as_deref(), arguments, log)?);
    }
    target.draw(&sheet)?;
    writeln!(log, "written to {}", arguments.output.display())?;
    Ok(Outcome::Done)
}

/// A drawing to be written.
pub(crate) struct Target {
    output: Output,
    draw: fn(&Sheet, &mut dyn Write) -> Result<(), PlotError>,
}

impl Target {
    /// SVG or PNG, as the ending of `output` asks for.
    pub(crate) fn create(output: &Path) -> anyhow::Result<Self> {
        if has_ending(output, "svg") {
            return Ok(Self { output: Output::create(output, Kind::DRAWING, &[])?, draw: plot::svg });
        }
        if has_ending(output, "png") {
            return Ok(Self { output: Output::create(output, Kind::DRAWN_PICTURE, &[])?, draw: plot::png });
        }
        bail!("{} ends neither in .svg nor in .png: plots are drawn as SVG or PNG", output.display())
    }

    /// Draws `sheet` and puts the file in its place.
    pub(crate) fn draw(self, sheet: &Sheet) -> anyhow::Result<()> {
        let Self { output, draw } = self;
        output.write(|out| draw(sheet, out))
    }
}

/// Responses, and the map where there is one.
fn sorted(files: &[PathBuf]) -> anyhow::Result<(Vec<&Path>, Option<PathBuf>)> {
    let (mut responses, mut map) = (Vec::new(), None);
    for path in files {
        match open::kind(path)? {
            Artifact::Response => responses.push(path.as_path()),
            Artifact::Map if map.is_some() => {
                bail!("{} is a second map: give the map of the first response alone", path.display())
            }
            Artifact::Map => map = Some(path.clone()),
        }
    }
    if responses.is_empty() {
        bail!("no response among the files: make one from the map with sonel-render");
    }
    Ok((responses, map))
}

/// A source at a receiver of a response.
struct Subject {
    path: PathBuf,
    name: String,
    response: Echograms,
    talk: Option<Talk>,
    source: usize,
    receiver: usize,
}

impl Subject {
    fn open(path: &Path, arguments: &Plot) -> anyhow::Result<Self> {
        let response = arguments.heard.heard(open::response(path)?)?;
        let talk = arguments.heard.talk();
        let find = |what: &str, names: &[String], wanted: Option<&String>| match wanted {
            None if names.is_empty() => bail!("{} holds no {what}", path.display()),
            None => Ok(0),
            Some(wanted) => open::place_of(path, what, names, wanted),
        };
        // A measurement is of one source at one receiver, whatever they are called.
        let named = |name: &'_ Option<String>| name.clone().filter(|_| !response.is_measured());
        let source = find("source", &response.source_names, named(&arguments.source).as_ref())?;
        let receiver = find("receiver", &response.receiver_names, named(&arguments.receiver).as_ref())?;
        Ok(Self { path: path.to_owned(), name: stem(path), response, talk, source, receiver })
    }

    fn panel(&self, of: impl Fn(&Echograms, usize, usize) -> Panel) -> Panel {
        self.named(of(&self.response, self.source, self.receiver))
    }

    fn named(&self, panel: Panel) -> Panel {
        Panel { title: format!("{}, {}", panel.title, self.name), ..panel }
    }

    fn early(&self, band_hz: Option<f64>) -> anyhow::Result<Panel> {
        let band = band_hz.map(|wanted| self.band(wanted)).transpose()?;
        let panel = plot::early(&self.response, (self.source, self.receiver), band);
        panel.map(|panel| self.named(panel)).with_context(|| {
            format!(
                "{} lists no arrival with energy from \"{}\" at \"{}\": only scattered or refracted sound arrives; choose another \
                 --receiver, or draw --what echogram",
                self.path.display(),
                self.response.source_names[self.source],
                self.response.receiver_names[self.receiver]
            )
        })
    }

    /// The band with this nominal centre [Hz].
    fn band(&self, wanted: f64) -> anyhow::Result<usize> {
        let none = format!("{} has no band", self.path.display());
        Ok(band(&self.response.center_frequency_hz, wanted, &none)?)
    }

    fn parameters(&self) -> (String, ReceiverParameters) {
        let (talk, pair) = (self.talk.as_ref(), [(self.source, self.receiver)]);
        (self.name.clone(), parameters_at(&self.response, talk, &Parameter::ALL, &pair).swap_remove(0))
    }

    fn log_what_is_left_out(&self, arguments: &Plot, log: &mut dyn Write) -> std::io::Result<()> {
        let (sources, receivers) = (self.response.sources(), self.response.receivers());
        let only_map = arguments.what.iter().all(|what| *what == What::Map) && !arguments.what.is_empty();
        let (source, receiver) =
            (&self.response.source_names[self.source], &self.response.receiver_names[self.receiver]);
        if only_map && sources > 1 {
            writeln!(log, "note: {}: source \"{source}\"; choose another with --source", self.name)?;
        } else if !only_map && sources * receivers > 1 {
            writeln!(
                log,
                "note: {}: {} and {}; drawn are \"{source}\" and \"{receiver}\": choose others with --source \
                 and --receiver",
                self.name,
                counted(sources, "source"),
                counted(receivers, "receiver")
            )?;
        }
        Ok(())
    }
}

fn in_rows(panels: Vec<Panel>) -> Vec<Vec<Panel>> {
    panels.chunks(COLUMNS).map(<[Panel]>::to_vec).collect()
}
