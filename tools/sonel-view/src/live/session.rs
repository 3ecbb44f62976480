//! What a served page works on: a scene, the map of its last trace, and who asks for what.

use std::collections::HashMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, SystemTime};

use anyhow::bail;
use rayon::{ThreadPool, ThreadPoolBuilder};
use serde_json::{Value, json};
use sonel::analysis::average::single_number;
use sonel::analysis::{Parameter, ParameterValue, ReceiverParameters};
use sonel::scenes::library;
use sonel::{
    Axis, Channels, Grid, Head, Map, Observer, ReceiverPoint, RenderOptions, Rendered, Response, Scene,
    Severity, Silent, SoundOptions, TraceOptions,
};
use sonel_console::heard::HeardArguments;
use sonel_console::spelled;

use super::answer::{Answer, Refusal};
use super::edit;
use super::wishes::{Changed, LISTENER, Plane, Render, Save, Search, changes};
use crate::arguments::Arguments;
use crate::files::Files;
use crate::page::number::Number;
use crate::page::pair::{self, Pair};
use crate::page::room::Room;
use crate::page::{self, Live, Page, Subject, Traced};

/// Most places of a plane: each takes a rendering and a few milliseconds.
const MOST_PLACES: f64 = 2000.0;
/// Windows whose newest request is known.
const MOST_WINDOWS: usize = 256;
/// Packets of the map that is there at once.
const FIRST_PACKETS: u64 = 512;
/// Order up to which its image sources are sought: in rooms of a hundred surfaces all orders that fit take longer than everything else. With order 3 levels
/// in hall, church and office are 7 … 17 % more certain; of the hall it takes a quarter of the time.
const FIRST_ORDER: u32 = 2;
/// Surfaces of a box, whose image sources are known without a search.
const BOX: usize = 6;
/// How much of a response is heard at once [s]: a decay by 18 dB in a church of 5 s, by 45 dB in a hall of 2 s. All of
/// it takes a church twice the time.
const FIRST_SOUND: f64 = 1.5;
/// How long a trace waits before it looks again whether it may go on.
const MOMENT: Duration = Duration::from_millis(2);
/// Entries of the library that a search finds.
const MOST_ENTRIES: usize = 60;

/// The scene, its map and the windows.
pub(super) struct Session {
    /// The scene file, where there is one.
    pub(super) scene: Option<PathBuf>,
    /// The file of the map, where there is one.
    pub(super) map_file: Option<PathBuf>,
    /// Packets of a trace.
    pub(super) packets: Option<u64>,
    token: String,
    head: Head,
    pub(super) heard: HeardArguments,
    state: Mutex<State>,
    /// Number of the newest request of each window, by kind.
    newest: Mutex<HashMap<String, Arc<AtomicU64>>>,
    traces: Arc<AtomicU64>,
    /// Shared with each request for first numbers that is worked on: traces wait for these.
    hurry: Arc<()>,
    /// Threads of traces: what is asked meanwhile does not wait for their chunks.
    tracers: ThreadPool,
}

/// What traces and editors change.
#[derive(Default)]
struct State {
    page: String,
    /// Number of pages so far: one that is older is loaded anew.
    pages: u64,
    /// Files of the scene, and when they were written.
    files: Vec<(PathBuf, Option<SystemTime>)>,
    /// The scene, as it was read or changed: that of the map, if there is one.
    scene: Option<Arc<Scene>>,
    /// The map, once there is one.
    map: Option<Arc<Map>>,
    /// Number of maps so far.
    maps: u64,
    /// Order up to which image sources are sought, while the map is one that is there at once.
    order: Option<u32>,
    /// Part of the trace that is done, while there is one.
    share: Option<f64>,
    /// Why the last trace failed.
    failure: Option<String>,
    /// What traces and checks have to say.
    messages: Vec<String>,
}

impl Session {
    /// Reads the scene or takes the map of `files`.
    ///
    /// # Errors
    /// When the scene is invalid.
    pub(super) fn open(files: Files, arguments: &Arguments, token: &str) -> anyhow::Result<Arc<Self>> {
        let packets = arguments.packets;
        let Files { scene: file, mut maps, responses } = files;
        if maps.len() > 1 {
            bail!("a served page is of one map: give one, or write a page of several with --output");
        }
        let (map_file, map) =
            maps.pop().map_or((None, None), |(path, map)| (Some(path), Some(Arc::new(map))));
        let walls = map.as_ref().map(|map| map.walls().map_err(spelled)).transpose()?;
        let traced = map.as_ref().zip(walls.as_deref());
        let traced = traced.map(|(map, walls)| Traced { map: map.sonels(), walls });
        let subjects: Vec<Subject> = responses
            .into_iter()
            .map(|(name, response)| Subject::new(name, response, &arguments.heard))
            .collect::<anyhow::Result<_>>()?;
        let mut state = State::default();
        let mut shown = traced.map(|it| (it.map.header().scene.name.clone(), Room::of_map(it.map, it.walls)));
        if let Some(path) = &file {
            let scene = Scene::load(path, &Silent).map_err(spelled)?;
            state.files = written(scene.files());
            shown = Some(room_of(&scene)?);
            state.scene = Some(Arc::new(scene));
        }
        let live = shown.is_some().then(|| Live { token: token.to_owned(), number: 0 });
        // A page of responses stays what it is.
        if !subjects.is_empty() {
            state.files.clear();
        }
        let page = match shown {
            Some((name, room)) if subjects.is_empty() => Page::of_room(&name, room),
            _ => Page::of_responses(&subjects, traced.as_slice(), &arguments.head),
        };
        state.page = Page { live, ..page }.to_html();
        state.maps = u64::from(map.is_some());
        state.map = map;
        Ok(Arc::new(Self {
            scene: file,
            map_file,
            packets,
            token: token.to_owned(),
            head: Head::sphere(),
            heard: arguments.heard.clone(),
            state: Mutex::new(state),
            newest: Mutex::default(),
            traces: Arc::default(),
            hurry: Arc::default(),
            tracers: ThreadPoolBuilder::new().num_threads(rayon::current_num_threads()).build()?,
        }))
    }

    fn locked(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The scene file as it was changed.
    pub(super) fn text(&self) -> String {
        self.scene().map(|scene| scene.to_toml()).unwrap_or_default()
    }

    /// The page.
    pub(super) fn page(&self) -> String {
        self.locked().page.clone()
    }

    /// Reads the scene anew where an editor has written one of its files, and traces it. Why it cannot be read is a failure like that of a trace.
    fn follow_files(self: &Arc<Self>) {
        let Some(path) = &self.scene else { return };
        let mut state = self.locked();
        let files = written(state.files.iter().map(|(file, _)| file));
        if files == state.files {
            return;
        }
        state.files = files;
        let number = state.pages + 1;
        drop(state);
        let read = || {
            let scene = Scene::load(path, &Silent).map_err(spelled)?;
            let (name, room) = room_of(&scene)?;
            let live = Some(Live { token: self.token.clone(), number });
            anyhow::Ok((scene, Page { live, ..Page::of_room(&name, room) }.to_html()))
        };
        match read() {
            Ok((scene, page)) => {
                let mut state = self.locked();
                // The map, and that which is being traced, are of another room.
                Newest::of(&self.traces);
                state.map = None;
                (state.page, state.pages, state.files) = (page, number, written(scene.files()));
                state.scene = Some(Arc::new(scene));
                drop(state);
                self.trace(self.text(), self.scene());
            }
            Err(error) => self.locked().failure = Some(format!("{error:#}")),
        }
    }

    /// The map of the last trace, its number, which answers carry, and how it is rendered.
    fn map(&self) -> Result<(Arc<Map>, u64, RenderOptions), Refusal> {
        let state = self.locked();
        let options = RenderOptions { order: state.order, ..RenderOptions::default() };
        let map = state.map.clone().map(|map| (map, state.maps, options));
        map.ok_or_else(|| Refusal { status: 425, text: "the scene is being traced".to_owned() })
    }

    /// How far the trace is, and which map there is.
    pub(super) fn state(self: &Arc<Self>) -> Result<Answer, Refusal> {
        self.follow_files();
        let state = self.locked();
        let settings = state.map.as_ref().map(|map| {
            let header = map.sonels().header();
            let materials = header.scene.materials.iter().map(|it| {
                let coefficients = json!({ "absorption": it.absorption, "scattering": it.scattering, "transmission": it.transmission });
                (it.name.clone(), coefficients)
            });
            let materials: serde_json::Map<String, Value> = materials.collect();
            json!({ "packets": header.settings.emissions, "steps": map.refinement_steps(), "materials": materials,
                    "parameters": Parameter::ALL.map(|parameter| parameter.heading().0),
                    "sources": header.scene.sources.iter().map(|source| source.position.to_array()).collect::<Vec<_>>() })
        });
        Ok(Answer::Json(json!({
            "share": state.share, "failure": state.failure, "messages": state.messages, "maps": state.maps, "pages": state.pages,
            "map": settings, "can_trace": self.scene.is_some(),
        })))
    }

    /// The scene of the map.
    pub(super) fn scene(&self) -> Option<Arc<Scene>> {
        self.locked().scene.clone()
    }

    /// Traces the scene file `text` beside everything else; an older trace stops. It is that of an `earlier` scene but for its sources, if there is one.
    pub(super) fn trace(self: &Arc<Self>, text: String, earlier: Option<Arc<Scene>>) {
        let newest = Newest::of(&self.traces);
        let mut state = self.locked();
        (state.share, state.failure) = (Some(0.0), None);
        drop(state);
        let session = Arc::clone(self);
        thread::spawn(move || {
            let outcome = session.tracers.install(|| session.follow_trace(&text, earlier, &newest));
            let mut state = session.locked();
            // A newer trace speaks for itself.
            if !newest.is_replaced() {
                (state.share, state.failure) = (None, outcome.err().map(|error| spelled(error).to_string()));
            }
        });
    }

    /// Traces the scene file `text`, with few packets first.
    fn follow_trace(&self, text: &str, earlier: Option<Arc<Scene>>, newest: &Newest) -> sonel::Result<()> {
        let path = self.scene.as_deref().expect("only a scene is traced");
        let follower = Tracing { session: self, newest };
        let read = || Scene::load_text(text.to_owned(), path, &Silent);
        let scene = match earlier {
            Some(earlier) if earlier.to_toml() == text => earlier,
            // Between two faces of a partition is air where a source stands: only a scene that is read anew has it.
            Some(earlier) => Arc::new(earlier.with_sources_of(text.to_owned(), &Silent).or_else(|_| read())?),
            None => Arc::new(read()?),
        };
        // How long the room rings takes a run of its own: the first map lasts as long as the last one, or as Sabine says.
        let last = self.locked().map.as_ref().map(|map| map.sonels().header().scene.duration);
        let first = FIRST_PACKETS.min(self.packets.unwrap_or(FIRST_PACKETS));
        let duration = Some(last.unwrap_or(scene.compiled().duration));
        let order = (scene.geometry().surfaces().len() > BOX).then_some(FIRST_ORDER);
        for (packets, duration, order) in [(Some(first), duration, order), (self.packets, None, None)] {
            self.locked().messages.clear();
            let options = TraceOptions { packets, duration, ..TraceOptions::default() };
            let map = scene.trace(&options, &follower)?.map;
            let mut state = self.locked();
            if newest.is_replaced() {
                return Ok(());
            }
            (state.map, state.maps) = (Some(Arc::new(map)), state.maps + 1);
            state.scene = Some(Arc::clone(&scene));
            state.order = order;
            drop(state);
            // Pages look for a map every 10 ms: whoever waits for first numbers asks for them now, and the trace goes on behind them.
            thread::sleep(20 * MOMENT);
            let _ = follower.progress("", 0.0);
        }
        Ok(())
    }

    /// Begins a trace of the scene with other sources and materials.
    pub(super) fn trace_changed(self: &Arc<Self>, wish: &Changed) -> Result<Answer, Refusal> {
        let scene =
            self.scene().ok_or_else(|| Refusal::failed(&"a map has no scene file: open the scene"))?;
        let text = edit::edited(&scene.to_toml(), &wish.sources, &wish.changes)
            .map_err(|error| Refusal::failed(&error))?;
        self.trace(text, wish.changes.is_empty().then_some(scene));
        self.state()
    }

    /// Who follows the newest request of a kind and window.
    fn newest(&self, kind: &str, window: &str) -> Newest {
        let mut newest = self.newest.lock().unwrap_or_else(PoisonError::into_inner);
        if newest.len() >= MOST_WINDOWS {
            newest.clear();
        }
        Newest::of(newest.entry(format!("{kind} {window}")).or_default())
    }

    /// A response as it is heard, its parameters, and the index of a source of the scene in it.
    fn read_off(&self, response: Response, source: usize) -> Result<ReadOff, Refusal> {
        let source = of_sources(source, response.echograms().sources())?;
        let read_off = page::read_off(response, &self.heard);
        let (response, parameters) = read_off.map_err(|error| Refusal::failed(&format!("{error:#}")))?;
        Ok((response, parameters, if self.heard.together { 0 } else { source }))
    }

    /// Parameters, charts and reflections where the listener is.
    pub(super) fn render(&self, wish: &Render) -> Result<Answer, Refusal> {
        let (newest, _first) =
            (self.newest("render", &wish.window), wish.batches.map(|_| Arc::clone(&self.hurry)));
        let (map, number, options) = self.map()?;
        let options = RenderOptions { set: changes(&wish.changes)?, batches: wish.batches, ..options };
        let rendered = map.render(&[listener(wish.listener)], &options, &newest)?;
        newest.unless_replaced()?;
        let (response, all, source) = self.read_off(rendered.response, wish.source)?;
        let echograms = response.echograms();
        // Charts come with the last numbers.
        let walls = map.walls()?;
        let curves = wish.batches.is_none().then(|| pair::curves(echograms, (source, 0), Some(&*walls)));
        let pair = Pair { curves, ..Pair::of(&all[source], None) };
        newest.unless_replaced()?;
        Ok(Answer::Json(
            json!({ "pair": pair, "batches": wish.batches, "warnings": rendered.warnings, "map": number }),
        ))
    }

    /// All parameters at the places of a plane.
    pub(super) fn grid(&self, wish: &Plane) -> Result<Answer, Refusal> {
        let newest = self.newest("grid", &wish.window);
        let (map, number, options) = self.map()?;
        let (set, grid) = (changes(&wish.changes)?, Some(plane(&map, wish)?));
        let options = RenderOptions { set, grid, batches: wish.batches, ..options };
        let Rendered { response, grid, .. } = map.render(&[], &options, &newest)?;
        newest.unless_replaced()?;
        let (response, all, source) = self.read_off(response, wish.source)?;
        let echograms = response.echograms();
        let places = echograms.receivers();
        let all = &all[source * places..(source + 1) * places];
        let shown = Parameter::ALL.into_iter().map(|parameter| {
            let (symbol, unit, factor) = parameter.heading();
            let of_band = |value: &dyn Fn(usize) -> ParameterValue| -> Vec<Number> {
                (0..places).map(|place| Number::of(&value(place), factor)).collect()
            };
            let single = of_band(&|place| single_number(&all[place], parameter));
            let bands = (0..echograms.bands())
                .map(|band| of_band(&|place| all[place].bands[band].parameter(parameter).clone()));
            let typical = all.iter().find_map(|place| single_number(place, parameter).ok());
            let noticeable = factor * parameter.just_noticeable(typical.map_or(1.0, |estimate| estimate.value));
            json!({ "symbol": symbol, "unit": unit, "noticeable": noticeable, "single": single, "bands": bands.collect::<Vec<_>>() })
        });
        let shown: Vec<Value> = shown.collect();
        newest.unless_replaced()?;
        Ok(Answer::Json(json!({
            "at": echograms.receiver_positions, "spacing": wish.spacing, "parameters": shown,
            "note": grid.filter(|grid| grid.left_out() > 0).map(|grid| grid.to_string()), "batches": wish.batches, "map": number,
        })))
    }

    /// The impulse response at the ears of the listener.
    pub(super) fn sound(&self, wish: &Render) -> Result<Answer, Refusal> {
        let (newest, _first) =
            (self.newest("sound", &wish.window), wish.batches.map(|_| Arc::clone(&self.hurry)));
        let (map, _, options) = self.map()?;
        let (set, batches) = (changes(&wish.changes)?, wish.batches);
        let options = RenderOptions { directions: true, set, batches, ..options };
        let response = map.render(&[listener(wish.listener)], &options, &newest)?.response;
        let source = of_sources(wish.source, response.echograms().sources())?;
        let options = SoundOptions { within: wish.batches.map(|_| FIRST_SOUND), ..SoundOptions::default() };
        let mut pairs = response.impulse_responses(Channels::Ears(&self.head), options, &newest)?;
        newest.unless_replaced()?;
        Ok(Answer::Samples(pairs.swap_remove(source).concat()))
    }

    /// Entries of the library with all words.
    pub(super) fn materials(&self, wish: &Search) -> Result<Answer, Refusal> {
        let words: Vec<String> = wish.words.split_whitespace().map(str::to_owned).collect();
        let bands = self.map().map(|(map, ..)| map.sonels().header().scene.bands.nominal().to_vec());
        let bands = bands.unwrap_or_default();
        let found = library::shipped().iter().filter(|entry| entry.matches(&words)).take(MOST_ENTRIES);
        let entry = |entry: &library::LibraryEntry| {
            let list = |octaves: &Option<library::Octaves>| {
                octaves.as_ref().map(|octaves| bands.iter().map(|hz| octaves.at(*hz).0).collect::<Vec<f64>>())
            };
            json!({ "name": entry.name, "text": entry.text, "source": entry.source,
                    "absorption": list(&entry.absorption), "scattering": list(&entry.scattering) })
        };
        Ok(Answer::Json(found.map(entry).collect()))
    }

    /// Writes what was changed, and says which commands give the same numbers.
    pub(super) fn save(&self, wish: &Save) -> Result<Answer, Refusal> {
        changes(&wish.changes)?;
        let (map, ..) = self.map()?;
        let saved = self.saved(&map.sonels().header().scene, wish);
        saved.map(Answer::Json).map_err(|error| Refusal::failed(&format!("{error:#}")))
    }
}

/// Name and room of a scene, with what a checkup finds.
fn room_of(scene: &Scene) -> anyhow::Result<(String, Room)> {
    let checkup = scene.check().map_err(spelled)?;
    let compiled = scene.compiled();
    Ok((compiled.name.clone(), Room::of(compiled, scene.geometry(), Some(&checkup))))
}

/// When `files` were written; none of those that are gone.
fn written(files: impl IntoIterator<Item = impl AsRef<Path>>) -> Vec<(PathBuf, Option<SystemTime>)> {
    let time = |file: &Path| file.metadata().and_then(|known| known.modified()).ok();
    files.into_iter().map(|file| (file.as_ref().to_owned(), time(file.as_ref()))).collect()
}

/// A response, its parameters, and the index of a source.
type ReadOff = (Response, Vec<ReceiverParameters>, usize);

fn listener(at: [f64; 3]) -> ReceiverPoint {
    ReceiverPoint::omni(LISTENER, at.into())
}

fn of_sources(index: usize, sources: usize) -> Result<usize, Refusal> {
    if index < sources { Ok(index) } else { Err(Refusal::wrong(format!("the scene has {sources} sources"))) }
}

/// The places of a plane above the lowest point of the room.
fn plane(map: &Map, wish: &Plane) -> Result<Grid, Refusal> {
    let scene = &map.sonels().header().scene;
    let Plane { height, spacing, .. } = *wish;
    if spacing <= 0.0 {
        return Err(Refusal::wrong("a plane needs a spacing above 0"));
    }
    let (low, high) = map.walls()?.bounds();
    let up = scene.up.abs().max_position();
    let mut axes = [Axis::from(0.0); 3];
    for (index, axis) in axes.iter_mut().enumerate() {
        let (low, high) = (low[index], high[index]);
        let count = ((high - low) / spacing).floor().max(1.0);
        // In the middle of equal cells.
        let margin = 0.5 * (high - low - (count - 1.0) * spacing);
        *axis = match index == up {
            true if scene.up[up] > 0.0 => Axis::from(low + height),
            true => Axis::from(high - height),
            false => Axis { low: low + margin, high: high - margin, count: count as u32 },
        };
    }
    if axes.iter().map(|axis| f64::from(axis.count)).product::<f64>() > MOST_PLACES {
        let text = format!("a plane has at most {MOST_PLACES} places: give a larger spacing");
        return Err(Refusal::wrong(text));
    }
    Grid::new(axes).map_err(|error| Refusal::wrong(error.to_string()))
}

/// Follows the request or trace `own`, until there is a newer one.
struct Newest {
    counter: Arc<AtomicU64>,
    own: u64,
}

impl Newest {
    fn of(counter: &Arc<AtomicU64>) -> Self {
        let own = counter.fetch_add(1, Ordering::SeqCst) + 1;
        Self { counter: Arc::clone(counter), own }
    }

    fn is_replaced(&self) -> bool {
        self.counter.load(Ordering::SeqCst) != self.own
    }

    fn unless_replaced(&self) -> Result<(), Refusal> {
        if self.is_replaced() { Err(Refusal::replaced()) } else { Ok(()) }
    }
}

impl Observer for Newest {
    fn progress(&self, _step: &str, _share: f64) -> ControlFlow<()> {
        self.go_on()
    }

    fn go_on(&self) -> ControlFlow<()> {
        if self.is_replaced() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Follows a trace, until there is a newer one.
struct Tracing<'a> {
    session: &'a Session,
    newest: &'a Newest,
}

impl Observer for Tracing<'_> {
    fn progress(&self, _step: &str, share: f64) -> ControlFlow<()> {
        while Arc::strong_count(&self.session.hurry) > 1 && !self.newest.is_replaced() {
            thread::sleep(MOMENT);
        }
        self.newest.go_on()?;
        self.session.locked().share = Some(share);
        ControlFlow::Continue(())
    }

    fn message(&self, severity: Severity, text: &str) -> ControlFlow<()> {
        if severity == Severity::Warning {
            self.session.locked().messages.push(text.to_owned());
        }
        ControlFlow::Continue(())
    }
}
