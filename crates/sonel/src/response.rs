//! Responses: echograms and what is read from them.

use std::collections::BTreeMap;
use std::io::{BufReader, Cursor, Read, Seek};
use std::ops::RangeInclusive;
use std::path::Path;

use glam::DVec3;
use sonel_analysis::{Parameter, ParameterValue, ReceiverParameters};
use sonel_echogram::{Provenance, Response as Echograms, SourceChange};

use crate::error::At;
use crate::{Error, Result};

/// Echograms of S sources at R receivers in B bands and T time bins: fluence per unit of emitted energy [1/m²].
#[derive(Debug)]
pub struct Response {
    echograms: Echograms,
    surroundings: Surroundings,
}

/// Data of a response beside the echograms that sound needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surroundings {
    /// Volume of a closed room [m³].
    pub volume: Option<f64>,
    /// Unit vector that points up; none of a measured response.
    pub up: Option<DVec3>,
    /// Seed of the rendering.
    pub seed: u64,
}

impl Surroundings {
    /// Unit vector that points up.
    ///
    /// # Errors
    /// When the response does not state it.
    pub fn upward(&self) -> Result<DVec3> {
        let problem = "the response does not state which direction is up: render it again from its map";
        self.up.ok_or_else(|| Error::refused(problem))
    }
}

impl Response {
    pub(crate) fn of(echograms: Echograms, surroundings: Surroundings) -> Self {
        Self { echograms, surroundings }
    }

    /// Reads a response of `sonel-render` or [`Self::save`], or a measured impulse response (WAV) as one.
    ///
    /// # Errors
    /// When the file cannot be read, is no response, or is damaged.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let label = path.as_ref().display().to_string();
        let file = crate::file::open(path.as_ref()).at(|| format!("cannot read the response {label}"))?;
        let name = path.as_ref().file_stem().unwrap_or_default().to_string_lossy();
        Self::of_reader(BufReader::new(file), &name, &label)
    }

    fn of_reader(mut file: impl Read + Seek, name: &str, label: &str) -> Result<Self> {
        let mut begin = [0; 4];
        let is_sound = file.read_exact(&mut begin).is_ok() && begin == *b"RIFF";
        file.rewind().at(|| label.to_owned())?;
        let read = if is_sound {
            measured(file, name, label)?
        } else {
            Echograms::read(file).at(|| label.to_owned())?
        };
        Ok(Self::of_file(read))
    }

    /// A response of a file, whose provenance states volume, seed and which direction is up.
    fn of_file(echograms: Echograms) -> Self {
        let Provenance { volume_m3, seed, up, .. } = &echograms.provenance;
        let surroundings = Surroundings {
            volume: *volume_m3,
            up: up.and_then(|axes| DVec3::from_array(axes).try_normalize()),
            seed: seed.unwrap_or(1),
        };
        Self::of(echograms, surroundings)
    }

    /// Reads a response in the bytes of its file, or a measured impulse response (WAV) as one.
    ///
    /// # Errors
    /// When they are no response, or damaged.
    pub fn read(bytes: &[u8]) -> Result<Self> {
        Self::of_reader(Cursor::new(bytes), "receiver", "the response")
    }

    /// Writes the response as a numpy archive (docs/formats/response.md), which appears when it is complete and replaces an older file.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<()> {
        crate::file::write(path.as_ref(), |out| Ok(self.echograms.write(out).map(drop)?))
    }

    /// The arrays: energies [S, R, B, T], borders of the time bins, batches, arrivals, names.
    #[must_use]
    pub fn echograms(&self) -> &Echograms {
        &self.echograms
    }

    /// The arrays, without the room.
    #[must_use]
    pub fn into_echograms(self) -> Echograms {
        self.echograms
    }

    /// All sources as one, with a gain and a delay each: loudspeakers of a system. Energies are added; lateral energies are left out.
    ///
    /// # Errors
    /// When there is not one change per source.
    pub fn together(&self, changes: &[SourceChange]) -> Result<Self> {
        let sources = self.echograms.sources();
        if changes.len() != sources || sources == 0 {
            return Err(Error::refused(format!(
                "{} changes of sources; the response has {sources}: give one for each",
                changes.len()
            )));
        }
        Ok(Self::of(self.echograms.together(changes), self.surroundings))
    }

    /// The room.
    #[must_use]
    pub fn surroundings(&self) -> Surroundings {
        self.surroundings
    }

    /// Parameters of [ISO3382-1] of every source at every receiver, with their intervals.
    #[must_use]
    pub fn parameters(&self) -> Parameters {
        Parameters {
            rows: sonel_analysis::parameters(&self.echograms),
            receivers: self.echograms.receivers(),
        }
    }
}

/// What becomes of each source of a response within one system: `gains` [dB] and `delays` [ms] by name, those of its scene where none is given.
///
/// # Errors
/// When a gain or delay is of no source, given twice or impossible, here or in the response.
pub fn system(
    echograms: &Echograms,
    gains: &[(String, f64)],
    delays: &[(String, f64)],
) -> Result<Vec<SourceChange>> {
    let names = &echograms.source_names;
    let of = |given: &[(String, f64)], what: &str, range: RangeInclusive<f64>, unit: &str| {
        let mut found = BTreeMap::new();
        for (name, value) in given {
            let problem = if !names.contains(name) {
                format!("the response has no such source; it has {}", names.join(", "))
            } else if !range.contains(value) {
                format!("{value} {unit} is outside {} … {} {unit}", range.start(), range.end())
            } else if found.insert(name.clone(), *value).is_some() {
                "it is given twice".to_owned()
            } else {
                continue;
            };
            return Err(Error::refused(format!("{what} of \"{name}\": {problem}")));
        }
        Ok(found)
    };
    let (least, most) = SourceChange::DELAYS.into_inner();
    let gains = of(gains, "gain", SourceChange::GAINS_DB, "dB")?;
    let delays = of(delays, "delay", 1e3 * least..=1e3 * most, "ms")?;
    let stated = echograms.stated_changes().map_err(|problem| Error::refused(problem.to_string()))?;
    let change = |(name, stated): (&String, SourceChange)| SourceChange {
        gain_db: gains.get(name).copied().unwrap_or(stated.gain_db),
        delay: delays.get(name).map_or(stated.delay, |delay| 1e-3 * delay),
    };
    Ok(names.iter().zip(stated).map(change).collect())
}

/// A measured impulse response as echograms at a receiver of this name.
#[cfg(feature = "sound")]
fn measured(file: impl Read + Seek, name: &str, label: &str) -> Result<Echograms> {
    let recording = sonel_sound::Recording::read(file).at(|| label.to_owned())?;
    sonel_sound::measured::response(&recording, name).at(|| label.to_owned())
}

#[cfg(not(feature = "sound"))]
fn measured(_: impl Read + Seek, _: &str, label: &str) -> Result<Echograms> {
    Err(Error::refused(format!("{label} is a WAV file: the feature \"sound\" of crate sonel reads it")))
}

/// Parameters of [ISO3382-1] of S sources at R receivers in B bands. A value is an estimate with the interval that holds the true one with a
/// probability of 95 %, or the reason why the response supports none.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters {
    rows: Vec<ReceiverParameters>,
    receivers: usize,
}

impl Parameters {
    /// Everything, source by source and receiver by receiver.
    #[must_use]
    pub fn rows(&self) -> &[ReceiverParameters] {
        &self.rows
    }

    /// One parameter, in the unit of its key ([`Parameter::key`]).
    ///
    /// # Panics
    /// Where there is no such source, receiver or band.
    pub fn value(
        &self,
        parameter: Parameter,
        source: usize,
        receiver: usize,
        band: usize,
    ) -> &ParameterValue {
        self.rows[source * self.receivers + receiver].bands[band].parameter(parameter)
    }

    /// Value of one parameter and half-width of its 95 % interval in the band of this centre [Hz], for every pair [S, R], in the unit of
    /// [`Parameter::key`]; NaN where there is none.
    ///
    /// # Errors
    /// When the response has no such band.
    pub fn at(&self, parameter: Parameter, center_frequency_hz: f64) -> Result<Vec<(f64, f64)>> {
        let bands = self.rows.first().map_or(&[][..], |row| &row.bands);
        let centers: Vec<f64> = bands.iter().map(|band| band.center_frequency_hz).collect();
        let band = crate::names::band(&centers, center_frequency_hz, "the response has no band")?;
        Ok(self.array(parameter).into_iter().skip(band).step_by(bands.len()).collect())
    }

    /// Values and half-widths of their 95 % intervals, [S, R, B], the band fastest, in the unit of [`Parameter::key`]; NaN where there is none.
    #[must_use]
    pub fn array(&self, parameter: Parameter) -> Vec<(f64, f64)> {
        let bands = self.rows.iter().flat_map(|row| &row.bands);
        let pair = |value: &ParameterValue| match value {
            Ok(estimate) => {
                let width = estimate.interval.as_ref().map_or(f64::NAN, |[low, high]| 0.5 * (high - low));
                (estimate.value, width)
            }
            Err(_) => (f64::NAN, f64::NAN),
        };
        bands.map(|band| pair(band.parameter(parameter))).collect()
    }
}
