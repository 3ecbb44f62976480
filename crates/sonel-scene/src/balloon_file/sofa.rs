//! SOFA of the convention FreeFieldDirectivityTF [AES69]: transfer functions from a source to microphones around it.
//!
//! Receiver r of measurement m stands at the listener's position plus the receiver's in the axes of the listener's view and up. Its direction
//! is that from the source, in the axes of the source's view (ahead), up, and up × view (left). Energy of a band is the mean of |H|² over the
//! frequencies within its edges, times the squared distance. Several values in one direction count with their mean.
//!
//! Between the directions energy is linear over the triangles of their convex hull, and is taken at the nodes of a grid about the view, at
//! least twice as fine as the directions where its step is above 1°.
//!
//! References: [AES69], [AES56] (docs/references.md).

use std::collections::BTreeMap;
use std::f64::consts::PI;

use glam::DVec3;
use sonel_acoustics::Bands;
use sonel_sofa::{Sofa, SofaError, Triangles, Triplets, spherical};

use crate::problem::LineProblem;

use super::grid::{Grid, Problems, mean, spread_note};

/// The convention that is read.
const CONVENTION: &str = "FreeFieldDirectivityTF";
/// Most directions: a grid of 1° has 64 442.
const MOST_DIRECTIONS: usize = 100_000;
/// Part of the unit length in which directions are compared: 0.0006°.
const SAME: f64 = 1e-5;
/// Cosine of 30°, within which every direction has a measured one.
const COVERED_COSINE: f64 = 0.866_025_403_784_438_6;
/// Steps of the grid [°], each for directions that are on average at least so far apart [°]: those of 10°, of 5°, and finer ones.
const STEPS: [(f64, f64); 3] = [(5.0, 8.0), (2.5, 4.0), (1.0, 0.0)];
/// Step of the directions in which gaps are sought [°].
const GAP_STEP: usize = 10;

/// Reads the grid of a file, for `bands`.
///
/// # Errors
/// A file that is damaged, of another convention, or does not cover bands or directions.
pub(super) fn read(bytes: &[u8], bands: &Bands) -> Result<Grid, Problems> {
    grid(bytes, bands).map_err(|error| vec![LineProblem::new(0, error.to_string())])
}

/// A measured direction: ahead, left, up.
struct Measured {
    direction: DVec3,
    energies: Vec<f64>,
}

fn grid(bytes: &[u8], bands: &Bands) -> Result<Grid, SofaError> {
    let file = Sofa::open(bytes)?;
    let convention = file.attribute("SOFAConventions").unwrap_or("none");
    if convention != CONVENTION {
        return Err(
            format!("the file holds the convention {convention}; a directivity is {CONVENTION}").into()
        );
    }
    let frequencies = file.required("N")?.values;
    let within = frequencies_of(&frequencies, bands)?;
    let spectra = Spectra::read(&file, frequencies.len())?;
    let setup = Setup::read(&file, &spectra)?;
    let mut all = Vec::with_capacity(spectra.measurements * spectra.receivers);
    for measurement in 0..spectra.measurements {
        for receiver in 0..spectra.receivers {
            let (direction, distance) = setup.direction(measurement, receiver)?;
            let energies = within
                .iter()
                .map(|numbers| distance * distance * spectra.energy(measurement, receiver, numbers))
                .collect();
            all.push(Measured { direction, energies });
        }
    }
    let mut notes = Vec::new();
    let (measured, spread) = merged(all);
    notes.extend(spread_note("in one direction", spread));
    let directions: Vec<DVec3> = measured.iter().map(|measured| measured.direction).collect();
    check_coverage(&directions)?;
    let spacing = (4.0 * PI / directions.len() as f64).sqrt().to_degrees();
    let (step, _) = STEPS.into_iter().find(|(_, apart)| spacing >= *apart).unwrap_or(STEPS[2]);
    notes.push(format!(
        "{} directions, {}; interpolated to a grid of {step}°",
        directions.len(),
        range(&frequencies)
    ));
    let (azimuths, polars) = ((360.0 / step) as usize, (180.0 / step) as usize + 1);
    let triangles = Triangles::new(&directions);
    let mut energies = Vec::with_capacity(azimuths * polars * bands.count());
    for (azimuth, polar) in (0..azimuths).flat_map(|i| (0..polars).map(move |j| (i, j))) {
        let weights = triangles.weights(node_direction(azimuth as f64 * step, polar as f64 * step));
        let energy = |band: usize| -> f64 {
            weights.iter().map(|(at, weight)| weight * measured[*at].energies[band]).sum()
        };
        energies.extend((0..bands.count()).map(energy));
    }
    Ok(Grid { shape: [azimuths, polars, bands.count()], energies, notes })
}

/// The direction of a node of a balloon [°]: azimuth 0 is to the right, 90° up.
fn node_direction(azimuth: f64, polar: f64) -> DVec3 {
    let (azimuth, polar) = (azimuth.to_radians(), polar.to_radians());
    let aside = libm::sin(polar);
    DVec3::new(libm::cos(polar), -aside * libm::cos(azimuth), aside * libm::sin(azimuth))
}

/// For each band the numbers of the frequencies within its edges.
fn frequencies_of(frequencies: &[f64], bands: &Bands) -> Result<Vec<Vec<usize>>, SofaError> {
    if let Some(wrong) = frequencies.iter().find(|hz| !(hz.is_finite() && **hz >= 0.0)) {
        return Err(format!("N holds {wrong}, which is no frequency in Hz").into());
    }
    let within = |band: usize| -> Vec<usize> {
        let (low, high) = bands.edges(band);
        (0..frequencies.len()).filter(|at| (low..high).contains(&frequencies[*at])).collect()
    };
    let found: Vec<Vec<usize>> = (0..bands.count()).map(within).collect();
    let missing: Vec<String> = bands
        .nominal()
        .iter()
        .zip(&found)
        .filter(|(_, found)| found.is_empty())
        .map(|(hz, _)| hz.to_string())
        .collect();
    if missing.is_empty() {
        return Ok(found);
    }
    Err(format!(
        "no frequency within the bands {} Hz; the file has {}: give other bands in the scene ([bands])",
        missing.join(", "),
        range(frequencies)
    )
    .into())
}

/// How many frequencies there are, and from where to where, to 0.1 Hz.
fn range(frequencies: &[f64]) -> String {
    let tenth = |hz: f64| libm::round(10.0 * hz) / 10.0;
    let low = tenth(frequencies.iter().copied().fold(f64::INFINITY, f64::min));
    let high = tenth(frequencies.iter().copied().fold(f64::NEG_INFINITY, f64::max));
    format!("{} frequencies from {low} to {high} Hz", frequencies.len())
}

/// Complex spectra by measurement, receiver and frequency.
struct Spectra {
    measurements: usize,
    receivers: usize,
    frequencies: usize,
    real: Vec<f64>,
    imaginary: Vec<f64>,
}

impl Spectra {
    fn read(file: &Sofa<'_>, frequencies: usize) -> Result<Self, SofaError> {
        let (real, imaginary) = (file.required("Data.Real")?, file.required("Data.Imag")?);
        let [measurements, receivers, length] = real.shape[..] else {
            return Err(format!(
                "Data.Real has the shape {:?}, not measurements, receivers, frequencies",
                real.shape
            )
            .into());
        };
        if real.shape != imaginary.shape || length != frequencies {
            return Err(format!(
                "Data.Real, Data.Imag and N do not fit: {:?}, {:?}, {frequencies}",
                real.shape, imaginary.shape
            )
            .into());
        }
        if measurements.saturating_mul(receivers) > MOST_DIRECTIONS {
            return Err(format!(
                "{measurements} measurements of {receivers} receivers; at most {MOST_DIRECTIONS} directions are read"
            ).into());
        }
        if let Some(wrong) = real.values.iter().chain(&imaginary.values).find(|value| !value.is_finite()) {
            return Err(format!("Data.Real or Data.Imag holds {wrong}").into());
        }
        Ok(Self { measurements, receivers, frequencies, real: real.values, imaginary: imaginary.values })
    }

    /// Mean energy over the frequencies of these `numbers`.
    fn energy(&self, measurement: usize, receiver: usize, numbers: &[usize]) -> f64 {
        let at = (measurement * self.receivers + receiver) * self.frequencies;
        let squared = |&number: &usize| {
            let (real, imaginary) = (self.real[at + number], self.imaginary[at + number]);
            real * real + imaginary * imaginary
        };
        numbers.iter().map(squared).sum::<f64>() / numbers.len() as f64
    }
}

/// Where source and receivers are, and where they look.
struct Setup {
    listener: Station,
    source: Station,
    receivers: Triplets,
}

/// Position and axes of source or listener.
struct Station {
    position: Triplets,
    view: Triplets,
    up: Triplets,
}

impl Setup {
    fn read(file: &Sofa<'_>, spectra: &Spectra) -> Result<Self, SofaError> {
        let station = |kind: &str| -> Result<Station, SofaError> {
            let count = spectra.measurements;
            let of =
                |what: &str, default| Triplets::read(file, &format!("{kind}{what}"), count, count, default);
            let (position, view) = (of("Position", Some(DVec3::ZERO))?, of("View", Some(DVec3::X))?);
            // An up without a type has that of the view.
            let mut up = of("Up", Some(DVec3::Z))?;
            up.is_spherical = view.is_spherical;
            Ok(Station { position, view, up })
        };
        let receivers =
            Triplets::read(file, "ReceiverPosition", spectra.receivers, spectra.measurements, None)?;
        Ok(Self { listener: station("Listener")?, source: station("Source")?, receivers })
    }

    /// Unit vector from the source to a receiver in the axes of the source, and their distance [m].
    fn direction(&self, measurement: usize, receiver: usize) -> Result<(DVec3, f64), SofaError> {
        let of = |triplets: &Triplets| triplets.at(measurement, measurement);
        let axes = |station: &Station, kind: &str| {
            axes(of(&station.view), of(&station.up)).ok_or_else(|| {
                format!("{kind}View and {kind}Up of measurement {} are no two directions", measurement + 1)
            })
        };
        let [ahead, left, up] = axes(&self.listener, "Listener")?;
        let local = self.receivers.at(receiver, measurement);
        let position = of(&self.listener.position) + local.x * ahead + local.y * left + local.z * up;
        let offset = position - of(&self.source.position);
        let distance = offset.length();
        let direction = offset.try_normalize().filter(|direction| direction.is_finite()).ok_or_else(|| {
            format!(
                "receiver {} of measurement {} is at the source, or nowhere; positions are needed around it",
                receiver + 1,
                measurement + 1
            )
        })?;
        let [ahead, left, up] = axes(&self.source, "Source")?;
        Ok((DVec3::new(direction.dot(ahead), direction.dot(left), direction.dot(up)), distance))
    }
}

/// Unit vectors ahead, left and up.
fn axes(view: DVec3, up: DVec3) -> Option<[DVec3; 3]> {
    let ahead = view.try_normalize()?;
    let left = up.try_normalize()?.cross(ahead).try_normalize()?;
    Some([ahead, left, ahead.cross(left)])
}

/// One of each direction, with the mean energies of those that are the same; and the largest difference between them [dB].
fn merged(all: Vec<Measured>) -> (Vec<Measured>, f64) {
    let mut groups: BTreeMap<[i64; 3], Vec<Measured>> = BTreeMap::new();
    for measured in all {
        let key = measured.direction.to_array().map(|part| libm::round(part / SAME) as i64);
        groups.entry(key).or_default().push(measured);
    }
    let mut largest = 0.0_f64;
    let merge = |group: Vec<Measured>| {
        let rows: Vec<&[f64]> = group.iter().map(|measured| &measured.energies[..]).collect();
        let (energies, spread) = mean(&rows);
        largest = largest.max(spread);
        Measured { energies, direction: group[0].direction }
    };
    let measured = groups.into_values().map(merge).collect();
    (measured, largest)
}

/// Checks that every direction has a measured one within 30°.
fn check_coverage(directions: &[DVec3]) -> Result<(), SofaError> {
    for (azimuth, elevation) in (0..360)
        .step_by(GAP_STEP)
        .flat_map(|azimuth| (-90..=90).step_by(GAP_STEP).map(move |elevation| (azimuth, elevation)))
    {
        let u = spherical(f64::from(azimuth), f64::from(elevation), 1.0);
        if !directions.iter().any(|direction| direction.dot(u) >= COVERED_COSINE) {
            return Err(format!(
                "{} directions leave a gap: none is within 30° of azimuth {azimuth}°, elevation {elevation}°; measure all around, or write a table \
                 of two polars (.csv)",
                directions.len()
            ).into());
        }
    }
    Ok(())
}
