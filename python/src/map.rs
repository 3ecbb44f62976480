//! Maps: traced into a temporary file, or opened from one.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use sonel::{
    Air, Audience, Coefficient, Estimator, Mode, Observer, Parameter, RenderOptions, Severity, Spectral,
    TraceOptions, Varied,
};

use crate::convert::{Keywords, Receiver, object, receiver, refused, uncertainties};
use crate::error;
use crate::response::{Array, Response};
use crate::scene::Scene;
use crate::work::work;

/// A sonel map in a file, which need not fit into memory.
#[pyclass(frozen, module = "sonel._sonel")]
pub struct Map {
    map: Arc<sonel::Map>,
    /// The file that it was loaded from.
    path: Option<PathBuf>,
    /// Report of `sonel-trace --json`, where it was traced now.
    report: Option<serde_json::Value>,
}

/// Traces `scene` with keywords that are the fields of `sonel::TraceOptions`.
#[pyfunction]
#[pyo3(signature = (scene, log, progress=None, **keywords))]
pub(crate) fn trace(
    py: Python<'_>,
    scene: &Bound<'_, Scene>,
    log: Bound<'_, PyAny>,
    progress: Option<Bound<'_, PyAny>>,
    keywords: Option<Bound<'_, PyDict>>,
) -> PyResult<Map> {
    let k = Keywords(keywords.unwrap_or_else(|| PyDict::new(py)));
    let options = TraceOptions {
        packets: k.whole("packets")?,
        seed: k.whole("seed")?,
        batches: k.whole("batches")?,
        survival: k.number("survival")?,
        mode: k.choice("mode", &[Mode::Accurate, Mode::Paper], Mode::name)?,
        spectral: k.choice("spectral", &[Spectral::Shared, Spectral::PerBand], Spectral::name)?,
        duration: k.number("duration")?,
        variants: k.variants()?,
        effects: k.parsed("effects")?,
        until: k.parsed("until")?,
        at_most: k.time("at_most")?,
        memory: k.number("memory")?,
        ..TraceOptions::default()
    };
    let scene = Arc::clone(&scene.get().scene);
    let extended = k.class::<Map>("extend")?.map(|map| Arc::clone(&map.get().map));
    work(py, Some(log), progress, k.whole("threads")?, move |observer: &dyn Observer| {
        let options = TraceOptions { extend: extended.as_deref(), ..options };
        let traced = scene.trace(&options, observer)?;
        // Whoever was interrupted does not want it any more.
        let _ = observer.message(Severity::Info, &traced.summary());
        let report = Some(traced.report());
        Ok(Map { map: Arc::new(traced.map), path: None, report })
    })
}

#[pymethods]
impl Map {
    /// Parameters of a `response` of this map with the interval of its `uncertain` materials.
    #[pyo3(signature = (response, uncertain, log, noise=None, speech=None))]
    fn parameters<'py>(
        &self,
        py: Python<'py>,
        response: Bound<'py, Response>,
        uncertain: Bound<'py, PyAny>,
        log: Bound<'py, PyAny>,
        noise: Option<Bound<'py, PyAny>>,
        speech: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let materials = Some((Arc::clone(&self.map), uncertainties(&uncertain)?));
        response.get().read_off(py, log, [noise, speech], materials)
    }

    /// The map in a file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let map = py.detach(|| sonel::Map::open(&path)).map_err(error)?;
        Ok(Self { map: Arc::new(map), path: Some(path), report: None })
    }

    /// Writes the map.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.map.save(path)).map_err(error)
    }

    /// Renders at `receivers` with keywords that are the fields of `sonel::RenderOptions`.
    #[pyo3(signature = (receivers, log, progress=None, **keywords))]
    fn render(
        &self,
        py: Python<'_>,
        receivers: Vec<Receiver>,
        log: Bound<'_, PyAny>,
        progress: Option<Bound<'_, PyAny>>,
        keywords: Option<Bound<'_, PyDict>>,
    ) -> PyResult<Response> {
        let k = Keywords(keywords.unwrap_or_else(|| PyDict::new(py)));
        let options = render_options(&k)?;
        let receivers = receivers.into_iter().map(receiver).collect::<PyResult<Vec<_>>>()?;
        let map = Arc::clone(&self.map);
        work(py, Some(log), progress, k.whole("threads")?, move |observer: &dyn Observer| {
            let rendered = map.render(&receivers, &options, observer)?;
            for warning in &rendered.warnings {
                let _ = observer.message(Severity::Warning, warning);
            }
            let report = rendered.report(rendered.seconds());
            Ok(Response::of(rendered.response, Some(report)))
        })
    }

    /// Parameters of [`parameters`] at `receivers`, [P, S, R, B], and without each batch, [P, S, R, B, K]; weights of the batches, [K];
    /// derivatives by a `coefficient` of every material and half of their intervals, [P, S, R, M, B]. NaN where there is no number.
    #[pyo3(signature = (receivers, coefficient, log, progress=None, **keywords))]
    fn sensitivity(
        &self,
        py: Python<'_>,
        receivers: Vec<Receiver>,
        coefficient: &str,
        log: Bound<'_, PyAny>,
        progress: Option<Bound<'_, PyAny>>,
        keywords: Option<Bound<'_, PyDict>>,
    ) -> PyResult<[Array; 5]> {
        let k = Keywords(keywords.unwrap_or_else(|| PyDict::new(py)));
        let coefficients = match coefficient {
            "absorption" => [Coefficient::Absorption],
            "scattering" => [Coefficient::Scattering],
            _ => {
                let wrong = format!("`coefficient` is {coefficient:?}: choose among absorption, scattering");
                return Err(refused(wrong));
            }
        };
        let options = render_options(&k)?;
        let receivers = receivers.into_iter().map(receiver).collect::<PyResult<Vec<_>>>()?;
        let map = Arc::clone(&self.map);
        work(py, Some(log), progress, k.whole("threads")?, move |observer: &dyn Observer| {
            let varied = map.sensitivity(&receivers, &coefficients, &options, observer)?;
            Ok(arrays(&varied, map.sonels().header().scene.sources.len()))
        })
    }

    /// Names of the materials, and by band their absorption, scattering and transmission.
    #[getter]
    fn materials(&self) -> Vec<(&str, [&[f64]; 3])> {
        let materials = &self.map.sonels().header().scene.materials;
        let numbers = materials.iter().map(|m| [&m.absorption[..], &m.scattering, &m.transmission]);
        materials.iter().map(|material| material.name.as_str()).zip(numbers).collect()
    }

    #[getter]
    fn center_frequencies(&self) -> Vec<f64> {
        self.map.sonels().header().scene.bands.nominal().to_vec()
    }

    /// The file that it was loaded from.
    #[getter]
    fn path(&self) -> Option<PathBuf> {
        self.path.clone()
    }

    #[getter]
    fn refinement_steps(&self) -> Vec<u32> {
        self.map.refinement_steps()
    }

    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.report.as_ref().map(|report| object(py, report)).transpose()
    }

    #[getter]
    fn digest(&self) -> String {
        self.map.digest()
    }

    #[getter]
    fn scene_name(&self) -> &str {
        &self.map.sonels().header().scene.name
    }

    #[getter]
    fn packets(&self) -> u64 {
        self.map.sonels().header().settings.emissions
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.map.sonels().header().settings.seed
    }
}

/// The parameters of [`Map::sensitivity`]: key, just-noticeable difference, and whether that is relative, as of reverberation times.
#[pyfunction]
pub(crate) fn parameters() -> Vec<(&'static str, f64, bool)> {
    let of = |parameter: Parameter| {
        (parameter.key(), parameter.just_noticeable(1.0), parameter.is_noticed_relatively())
    };
    Parameter::ALL.into_iter().map(of).collect()
}

fn arrays(varied: &Varied, sources: usize) -> [Array; 5] {
    let (places, bands, materials) = (varied.parameters.len(), varied.bands, varied.materials.len());
    let estimates = |parameter: Parameter| {
        let of = move |place: usize, band: usize| varied.parameters[place].bands[band].parameter(parameter);
        (0..places).flat_map(move |place| (0..bands).map(move |band| of(place, band).as_ref().ok()))
    };
    let all = || Parameter::ALL.into_iter().flat_map(estimates);
    let weight = all().flatten().map(|estimate| &estimate.weight).find(|weight| weight.len() > 1);
    let weight = weight.cloned().unwrap_or_default();
    let value = all().map(|estimate| estimate.map_or(f64::NAN, |estimate| estimate.value)).collect();
    let without = |estimate: Option<&sonel::Estimate>| match estimate {
        Some(estimate) if estimate.without.len() == weight.len() => estimate.without.clone(),
        _ => vec![f64::NAN; weight.len()],
    };
    let mut slopes = [Vec::new(), Vec::new()];
    for parameter in Parameter::ALL {
        for place in 0..places {
            for material in 0..materials {
                let variant = varied.variants.iter().position(|variant| variant.material == material);
                let found =
                    variant.map_or(vec![None; bands], |variant| varied.slopes(place, variant, parameter));
                slopes[0].extend(found.iter().map(|slope| slope.map_or(f64::NAN, |slope| slope.slope)));
                slopes[1].extend(found.iter().map(|slope| slope.map_or(f64::NAN, |slope| slope.half_width)));
            }
        }
    }
    let shape = [Parameter::ALL.len(), sources, places / sources.max(1)];
    let of = |values: Vec<f64>, rest: &[usize]| Array::holding(values, &[&shape[..], rest].concat());
    let [slope, half_width] = slopes.map(|slopes| of(slopes, &[materials, bands]));
    let without = of(all().flat_map(without).collect(), &[bands, weight.len()]);
    let count = weight.len();
    [of(value, &[bands]), without, Array::holding(weight, &[count]), slope, half_width]
}

/// Keywords `audience`, `spacing` and `height`.
fn audience(k: &Keywords<'_>) -> PyResult<Option<Audience>> {
    let (spacing, height) = (k.number("spacing")?, k.number("height")?);
    let Some(materials) = k.texts("audience")? else {
        return match spacing.or(height) {
            Some(_) => Err(refused("`spacing` and `height` are of `audience`: give it, too")),
            None => Ok(None),
        };
    };
    let default = Audience::of(materials);
    Ok(Some(Audience {
        spacing: spacing.unwrap_or(default.spacing),
        height: height.unwrap_or(default.height),
        ..default
    }))
}

fn render_options(k: &Keywords<'_>) -> PyResult<RenderOptions> {
    let default = RenderOptions::default();
    let (temperature, humidity) = (k.number("temperature")?, k.number("humidity")?);
    let air = match k.flag("air", true)? {
        true => Air::State { temperature, humidity },
        false if temperature.is_some() || humidity.is_some() => {
            return Err(refused(
                "`air` is False, so that `temperature` and `humidity` have no effect: leave them out",
            ));
        }
        false => Air::None,
    };
    let estimators = [&Estimator::COMPARABLE[..], &[Estimator::Paper]].concat();
    let effects: Option<String> = k.text("effects")?;
    Ok(RenderOptions {
        bin: k.number("bin")?.unwrap_or(default.bin),
        estimator: k.choice("estimator", &estimators, Estimator::name)?.unwrap_or(default.estimator),
        effects: effects
            .map_or(Ok(default.effects), |text| text.parse())
            .map_err(|wrong| refused(format!("`effects`: {wrong}")))?,
        order: k.whole("order")?,
        batches: k.whole("batches")?,
        radius: k.number("radius")?,
        rays: k.whole("rays")?,
        seed: k.whole("seed")?,
        air,
        directions: k.flag("directions", false)?,
        variant: k.text("variant")?,
        materials: k.text("materials")?.map(PathBuf::from),
        set: k.changes()?,
        grid: k.parsed("grid")?,
        audience: audience(k)?,
        shard: None,
        until: k.parsed("until")?,
        at_most: k.time("at_most")?,
        memory: k.number("memory")?,
    })
}
