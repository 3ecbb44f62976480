//! Responses, whose arrays numpy reads where they are.
//!
//! An [`Array`] follows numpy's array interface, version 3: address, shape and type. It needs no C interface of numpy, and holds
//! the response for as long as an array of numpy holds it.

use std::path::PathBuf;
use std::slice;
use std::sync::Arc;

use glam::DVec3;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use sonel::analysis::modal::ModalBands;
use sonel::analysis::modulation::Talk;
use sonel::analysis::receiver::parameters_of;
use sonel::analysis::speech::{NoiseLevels, SpeechPower};
use sonel::echograms::{Echograms, LATERAL_KEYS, ReceiverDirectivity};
use sonel::{
    AbsorptionUncertainty, Axes, Channels, Head, Microphone, Observer, Route, SPACINGS, SoundOptions,
    Waypoint, microphone,
};

use crate::convert::{Receiver, object, octaves, receiver, refused};
use crate::error;
use crate::work::{silent_work, work};

/// Echograms of every source at every receiver.
#[pyclass(frozen, module = "sonel._sonel")]
pub struct Response {
    response: Arc<sonel::Response>,
    /// Report of `sonel-render --json`, where it was rendered now.
    report: Option<serde_json::Value>,
}

/// Numbers of a response, for `numpy.asarray`.
#[pyclass(frozen, module = "sonel._sonel")]
pub struct Array {
    /// Holds the numbers.
    _owner: Arc<dyn Send + Sync>,
    address: usize,
    typestr: &'static str,
    shape: Vec<usize>,
}

impl Array {
    /// Numbers that it holds itself.
    pub(crate) fn holding(values: Vec<f64>, shape: &[usize]) -> Self {
        let values = Arc::new(values);
        Self::of(Arc::<Vec<f64>>::clone(&values), &values, shape)
    }

    /// `values`, which `owner` holds.
    fn of<T: Number>(owner: Arc<dyn Send + Sync>, values: &[T], shape: &[usize]) -> Self {
        assert_eq!(values.len(), shape.iter().product::<usize>(), "a response has the shapes of its page");
        Self { _owner: owner, address: values.as_ptr() as usize, typestr: T::TYPESTR, shape: shape.to_vec() }
    }
}

#[pymethods]
impl Array {
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("typestr", self.typestr)?;
        interface.set_item("shape", PyTuple::new(py, &self.shape)?)?;
        let read_only = true;
        interface.set_item("data", (self.address, read_only))?;
        Ok(interface)
    }
}

/// Numbers that numpy has a name for.
trait Number {
    const TYPESTR: &'static str;
}

impl Number for f64 {
    const TYPESTR: &'static str = "<f8";
}
impl Number for f32 {
    const TYPESTR: &'static str = "<f4";
}
impl Number for u32 {
    const TYPESTR: &'static str = "<u4";
}

impl Response {
    pub(crate) fn of(response: sonel::Response, report: Option<serde_json::Value>) -> Self {
        Self { response: Arc::new(response), report }
    }

    fn echograms(&self) -> &Echograms {
        self.response.echograms()
    }

    fn view<T: Number>(&self, values: &[T], shape: &[usize]) -> Option<Array> {
        let owner: Arc<dyn Send + Sync> = Arc::<sonel::Response>::clone(&self.response);
        Some(Array::of(owner, values, shape))
    }

    /// Channels of sources, or of sources at receivers, with `pairs` in front of their shape.
    fn samples(pairs: &[usize], all: Vec<Vec<Vec<f32>>>) -> Array {
        let (channels, samples) =
            all.first().map_or((0, 0), |pair| (pair.len(), pair.first().map_or(0, Vec::len)));
        let values: Arc<Vec<f32>> = Arc::new(all.into_iter().flatten().flatten().collect());
        Array::of(Arc::<Vec<f32>>::clone(&values), &values, &[pairs, &[channels, samples]].concat())
    }

    /// The array that docs/formats/response.md calls `key`.
    fn find(&self, key: &str) -> Option<Array> {
        let e = self.echograms();
        let (s, r, b, a) = (e.sources(), e.receivers(), e.bands(), e.arrivals.source.len());
        let batches = e.batches.as_ref();
        let batch_shape = |bins| [e.batch_count(), s, r, b, bins];
        match key {
            "center_frequency_hz" => self.view(&e.center_frequency_hz, &[b]),
            "time_edges_s" => self.view(&e.time_edges_s, &[e.bins() + 1]),
            "receiver_position_m" => self.view(e.receiver_positions.as_flattened(), &[r, 3]),
            "source_position_m" => self.view(e.source_positions.as_flattened(), &[s, 3]),
            "receiver_aim" => self.of_directivities(|found| found.aim.to_vec(), &[3]),
            "receiver_diffuse_sensitivity" => {
                self.of_directivities(|found| vec![found.diffuse_sensitivity], &[])
            }
            "speed_of_sound" => self.view(slice::from_ref(&e.speed_of_sound), &[]),
            "characteristic_impedance" => self.view(slice::from_ref(&e.characteristic_impedance), &[]),
            "direct_time_s" if e.direct_times_s.is_empty() => None,
            "direct_time_s" => self.view(&e.direct_times_s, &[s, r]),
            "source_power_level_db" => self.view(&e.source_power_level_db, &[s, b]),
            "energy" => self.view(&e.energy, &[s, r, b, e.bins()]),
            "batch_weight" => batches.and_then(|g| self.view(&g.weight, &[e.batch_count()])),
            "batch_time_edges_s" => batches.and_then(|g| self.view(&g.time_edges_s, &[s, r, g.bins + 1])),
            "energy_batches" => batches.and_then(|g| self.view(&g.energy, &batch_shape(g.bins))),
            "kernel_difference_batches" => batches
                .filter(|g| !g.kernel_difference.is_empty())
                .and_then(|g| self.view(&g.kernel_difference, &batch_shape(g.bins))),
            "missing_fluence" => e.missing.as_ref().and_then(|m| self.view(&m.fluence, &[s, b])),
            "missing_decay_rate" => e.missing.as_ref().and_then(|m| self.view(&m.decay_rate, &[s, b])),
            "arrival_source" => self.view(&e.arrivals.source, &[a]),
            "arrival_receiver" => self.view(&e.arrivals.receiver, &[a]),
            "arrival_time_s" => self.view(&e.arrivals.time_s, &[a]),
            "arrival_energy" => self.view(&e.arrivals.energy, &[a, b]),
            "arrival_direction" => self.view(&e.arrivals.direction, &[a, 3]),
            "arrival_order" => self.view(&e.arrivals.order, &[a]),
            "arrival_kind" => self.view(&e.arrivals.kind, &[a]),
            _ => self.find_by_direction(key),
        }
    }

    /// Numbers of shape [R, …`shape`], where a receiver is not omnidirectional.
    fn of_directivities(
        &self,
        numbers: impl Fn(&ReceiverDirectivity) -> Vec<f64>,
        shape: &[usize],
    ) -> Option<Array> {
        let directivities =
            Some(&self.echograms().receiver_directivities).filter(|found| !found.is_empty())?;
        let values = directivities.iter().flat_map(numbers).collect();
        Some(Array::holding(values, &[&[directivities.len()], shape].concat()))
    }

    fn find_by_direction(&self, key: &str) -> Option<Array> {
        let e = self.echograms();
        let (shape, directions) = ([e.sources(), e.receivers(), e.bands(), e.bins()], e.directions.as_ref()?);
        let [s, r, b, t] = shape;
        for (lateral, keys) in directions.lateral.iter().zip(LATERAL_KEYS) {
            let of_batches = |values: &[f32]| {
                let batches = e.batches.as_ref().filter(|_| !values.is_empty())?;
                self.view(values, &[e.batch_count(), s, r, b, batches.bins])
            };
            match keys.iter().position(|known| *known == key) {
                Some(0) => return self.view(&lateral.energy, &shape),
                Some(1) => return of_batches(&lateral.energy_batches),
                Some(_) => return of_batches(&lateral.kernel_difference),
                None => {}
            }
        }
        match key {
            "lateral_axis" => self.view(directions.lateral_axes.as_flattened(), &[r, 3]),
            "direction_moment" => self.view(&directions.moment, &[s, r, b, t, 3]),
            _ => None,
        }
    }
}

fn path(points: Vec<[f64; 4]>) -> PyResult<Route> {
    let points = points.into_iter().map(|[time, x, y, z]| Waypoint { time, position: DVec3::new(x, y, z) });
    Route::new(points.collect()).map_err(|wrong| refused(format!("path: {wrong}")))
}

fn microphones(points: Vec<Receiver>) -> PyResult<Vec<Microphone>> {
    points.into_iter().map(|point| Ok(microphone(receiver(point)?))).collect()
}

/// Names and positions of the places along a path of times and positions, so many metres apart at most.
#[pyfunction]
pub(crate) fn places(points: Vec<[f64; 4]>, spacing: f64) -> PyResult<Vec<(String, [f64; 3])>> {
    if !SPACINGS.contains(&spacing) {
        let (least, most) = (SPACINGS.start(), SPACINGS.end());
        return Err(refused(format!("`spacing` is {spacing} m: give {least} to {most} m")));
    }
    let places = sonel::places(&path(points)?, spacing);
    Ok(places.into_iter().map(|place| (place.name, place.position.to_array())).collect())
}

impl Response {
    /// Parameters with noise and speech, where they are given, and with the uncertain materials of a map.
    pub fn read_off<'py>(
        &self,
        py: Python<'py>,
        log: Bound<'py, PyAny>,
        [noise, speech]: [Option<Bound<'py, PyAny>>; 2],
        materials: Option<(Arc<sonel::Map>, Vec<AbsorptionUncertainty>)>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let noise = noise.map(|given| octaves("noise", &given)).transpose()?;
        let speech = speech.map(|given| octaves("speech", &given)).transpose()?;
        if noise.is_none() && speech.is_some() {
            return Err(refused("speech needs noise: give both"));
        }
        let power_level_db = speech.map(|SpeechPower(levels)| levels);
        let talk = noise.map(|NoiseLevels(noise_level_db)| Talk { power_level_db, noise_level_db });
        let response = Arc::clone(&self.response);
        let json = work(py, Some(log), None, None, move |observer| {
            let echograms = response.echograms();
            let mut rows = parameters_of(echograms, talk.as_ref());
            if let Some((map, uncertain)) = materials {
                let variants = map.material_variants(echograms, &uncertain, observer)?;
                variants.attach(&mut rows, |of| Ok::<_, sonel::Error>(parameters_of(of, talk.as_ref())))?;
            }
            let mut report = sonel::analysis::report::json(&rows);
            let volume = echograms.provenance.volume_m3;
            if let Some(modal) = volume.and_then(|volume| ModalBands::of(&rows, volume)) {
                report["spread_over_places"] = modal.json();
            }
            Ok(report)
        })?;
        object(py, &json)
    }
}

/// Order of ambisonics and whether they have the aim's axes, a SOFA file, an array.
type Given = (Option<(u32, bool)>, Option<Vec<u8>>, Option<Vec<Receiver>>);

/// What is made, without Python, of a response in the channels that are given.
fn in_channels(
    py: Python<'_>,
    (order, head, array): Given,
    sample_rate_hz: u32,
    make: impl FnOnce(Channels<'_>, &dyn Observer) -> sonel::Result<Vec<Vec<Vec<f32>>>> + Send + 'static,
) -> PyResult<Vec<Vec<Vec<f32>>>> {
    let array = array.map(microphones).transpose()?;
    silent_work(py, move |observer: &dyn Observer| {
        let head = head.map(|file| Head::read(&file, sample_rate_hz)).transpose()?;
        let channels = match (order, &head, &array) {
            (Some((order, aim)), _, _) => {
                Channels::Ambisonics(order, if aim { Axes::Aim } else { Axes::Scene })
            }
            (None, Some(head), _) => Channels::Ears(head),
            (None, None, Some(microphones)) => Channels::Array(microphones),
            (None, None, None) => Channels::Single,
        };
        make(channels, observer)
    })
}

#[pymethods]
impl Response {
    /// The response in a file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        Ok(Self::of(py.detach(|| sonel::Response::open(path)).map_err(error)?, None))
    }

    /// The bytes of its file.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let mut file = std::io::Cursor::new(Vec::new());
        py.detach(|| self.echograms().write(&mut file).map(drop)).map_err(error)?;
        Ok(PyBytes::new(py, file.get_ref()))
    }

    /// The response in the bytes of its file.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, bytes: Vec<u8>) -> PyResult<Self> {
        Ok(Self::of(py.detach(|| sonel::Response::read(&bytes)).map_err(error)?, None))
    }

    /// Writes the response.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.response.save(path)).map_err(error)
    }

    /// One of the arrays of numbers in docs/formats/response.md, of those that a response has outside its file.
    fn array(&self, key: &str) -> PyResult<Array> {
        self.find(key).ok_or_else(|| PyKeyError::new_err(key.to_owned()))
    }

    /// What `sonel-analyze parameters --format json` prints.
    #[pyo3(signature = (log, noise=None, speech=None))]
    fn parameters<'py>(
        &self,
        py: Python<'py>,
        log: Bound<'py, PyAny>,
        noise: Option<Bound<'py, PyAny>>,
        speech: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        self.read_off(py, log, [noise, speech], None)
    }

    /// Impulse responses, [S, R, channels, samples], of ambisonics with their order and whether they have the aim's axes, a SOFA file or an array.
    #[pyo3(signature = (channels=(None, None, None), seed=None, sample_rate_hz=48_000, within=None))]
    fn impulse_responses(
        &self,
        py: Python<'_>,
        channels: Given,
        seed: Option<u64>,
        sample_rate_hz: u32,
        within: Option<f64>,
    ) -> PyResult<Array> {
        let options = SoundOptions { seed, sample_rate_hz, within };
        let response = Arc::clone(&self.response);
        let all = in_channels(py, channels, sample_rate_hz, move |channels, observer| {
            response.impulse_responses(channels, options, observer)
        })?;
        Ok(Self::samples(&[self.echograms().sources(), self.echograms().receivers()], all))
    }

    /// What a listener hears of a `signal` of f64 in bytes along a path of times and positions: [S, channels, samples].
    #[pyo3(signature = (route, signal, channels=(None, None, None), seed=None, sample_rate_hz=48_000))]
    fn walk(
        &self,
        py: Python<'_>,
        route: (Vec<[f64; 4]>, f64),
        signal: &[u8],
        channels: Given,
        seed: Option<u64>,
        sample_rate_hz: u32,
    ) -> PyResult<Array> {
        let options = SoundOptions { seed, sample_rate_hz, within: None };
        let (path, spacing) = (path(route.0)?, route.1);
        let signal: Vec<f32> =
            signal.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes) as f32).collect();
        let response = Arc::clone(&self.response);
        let all = in_channels(py, channels, sample_rate_hz, move |channels, observer| {
            let of_source = |s| {
                let mut heard: Vec<Vec<f32>> = Vec::new();
                response.walk((s, &path, spacing), channels, &signal, options, observer, |_, section| {
                    heard.resize(section.len(), Vec::new());
                    heard.iter_mut().zip(section).for_each(|(channel, more)| channel.extend(more));
                    Ok(())
                })?;
                Ok(heard)
            };
            (0..response.echograms().sources()).map(of_source).collect::<sonel::Result<_>>()
        })?;
        Ok(Self::samples(&[self.echograms().sources()], all))
    }

    /// All sources as one, with gains [dB] and delays [s] of the scene where none are given.
    fn together(&self, gains: Vec<(String, f64)>, delays: Vec<(String, f64)>) -> PyResult<Self> {
        let delays: Vec<_> = delays.into_iter().map(|(name, delay)| (name, 1e3 * delay)).collect();
        let changes = sonel::system(self.echograms(), &gains, &delays).map_err(error)?;
        Ok(Self::of(self.response.together(&changes).map_err(error)?, None))
    }

    /// Volume of a closed room, the direction up where it is known, and the seed.
    #[getter]
    fn room(&self) -> (Option<f64>, Option<[f64; 3]>, u64) {
        let room = self.response.surroundings();
        (room.volume, room.up.map(|up| up.to_array()), room.seed)
    }

    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.report.as_ref().map(|report| object(py, report)).transpose()
    }

    #[getter]
    fn metadata<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        object(py, &self.echograms().provenance.to_json())
    }

    #[getter]
    fn metadata_json(&self) -> String {
        self.echograms().provenance.to_json().to_string()
    }

    #[getter]
    fn sources(&self) -> Vec<String> {
        self.echograms().source_names.clone()
    }

    #[getter]
    fn receivers(&self) -> Vec<String> {
        self.echograms().receiver_names.clone()
    }

    /// Names of the patterns; empty where all receivers are omnidirectional.
    #[getter]
    fn receiver_directivities(&self) -> Vec<&str> {
        self.echograms().receiver_directivities.iter().map(|found| found.name.as_str()).collect()
    }

    #[getter]
    fn speed_of_sound(&self) -> f64 {
        self.echograms().speed_of_sound
    }
}
