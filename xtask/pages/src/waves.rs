//! docs/validation.md: packets against the wave equation in the same rooms.
//!
//! The solver is that of the test kit, in cubes of [`CELL`]. Each octave is a run of its own with the admittance of that octave's
//! absorption; both models then know the same walls but for what packets leave out: phase, diffraction, and by default the angle.

mod packets;
mod rooms;
mod tables;

use std::f64::consts::{PI, SQRT_2};
use std::time::Instant;

use anyhow::{Context, Result, anyhow, ensure};
use glam::DVec3;
use sonel_acoustics::absorption_law::impedance;
use sonel_geometry::{Departure, Geometry};
use sonel_scene::Scene;
use sonel_testkit::decay::reverberation_time;
use sonel_testkit::waves::{Places, WaveRoom, step};
use xtask::workspace;

use rooms::Room;

/// Side of a cell [m]: nine cells per wavelength at the upper end of 250 Hz.
const CELL: f64 = 0.125;
/// Pressure below this frequency is steady [Hz].
const STEADY: f64 = 5.0;
/// Largest share of the energy in the last half filter of a signal.
const LATE_SHARE: f64 = 1e-6;
const PAGE: &str = "docs/validation.md";
const TABLE: &str = "docs/validation/waves.csv";

/// T30 [s], EDT [s] and strength G [dB] of a band, means over sources and receivers: of G that of the energy.
type Row = [f64; 3];

/// Rows per band: of waves, and of packets in the order of [`packets::VARIANTS`].
type Columns = Vec<Vec<Row>>;

/// Solves all rooms, traces them in every way, and writes CSV file and summary; `only` names one room, whose part of the CSV file
/// is then printed.
pub(crate) fn run(only: Option<&str>) -> Result<()> {
    let mut table = tables::CSV_HEAD.to_owned();
    let mut boxes = Vec::new();
    for room in rooms::all()?.iter().filter(|room| only.is_none_or(|only| only == room.name)) {
        let begun = Instant::now();
        let mut columns = vec![of_waves(room)?];
        eprintln!("{}: {:.0} s of waves, {columns:.2?}", room.name, begun.elapsed().as_secs_f64());
        for variant in packets::VARIANTS {
            columns.push(packets::rows(room, variant)?);
        }
        table += &tables::csv(&room.name, room.bands, &columns);
        if room.is_box() {
            boxes.push(columns);
        }
    }
    if only.is_some() {
        print!("{table}");
        return Ok(());
    }
    workspace::write(TABLE, table)?;
    let summary = tables::summary(rooms::BANDS, &boxes);
    workspace::write(PAGE, workspace::with_figures(&workspace::read(PAGE)?, &summary)?)
}

/// What the wave equation says, per band of the room.
fn of_waves(room: &Room) -> Result<Vec<Row>> {
    let scene = room.scene()?;
    let geometry = scene.geometry()?;
    let step = step(CELL, scene.speed_of_sound);
    let mut rows = Vec::new();
    // Bands of the same walls are bands of the same signals.
    let mut solved: Option<(Vec<f64>, Vec<Vec<f64>>)> = None;
    for &centre in room.bands {
        let admittances = admittances(&scene, centre)?;
        if solved.as_ref().is_none_or(|(known, _)| *known != admittances) {
            let signals = solve(&scene, &geometry, &admittances);
            solved = Some((admittances, signals));
        }
        let signals = &solved.as_ref().expect("just solved").1;
        let filter = octave(centre, step);
        // 1 m from the source in the open: a unit pulse of the scheme becomes one of 3h/4π.
        let at_one_meter =
            (3.0 * CELL / (4.0 * PI)).powi(2) * filter.iter().map(|tap| tap * tap).sum::<f64>();
        let energies = signals.iter().map(|signal| energies(signal, &filter, step));
        let energies = energies.collect::<Result<Vec<_>>>().with_context(|| format!("{centre} Hz"))?;
        let mean = |value: &dyn Fn(&[f64]) -> f64| {
            energies.iter().map(|energies| value(energies)).sum::<f64>() / energies.len() as f64
        };
        rows.push([
            mean(&|energies| reverberation_time(energies, step, -5.0, -35.0)),
            mean(&|energies| reverberation_time(energies, step, 0.0, -10.0)),
            10.0 * mean(&|energies| 100.0 * energies.iter().sum::<f64>() / at_one_meter).log10(),
        ]);
    }
    Ok(rows)
}

/// Pressure at every receiver of the scene from every source, for walls of the admittances of its materials.
fn solve(scene: &Scene, geometry: &Geometry, admittances: &[f64]) -> Vec<Vec<f64>> {
    let (low, high) = geometry.bounds();
    // One cell more on every side: the first and the last are outside, behind the walls.
    let (low, high) = (low - geometry.center() - CELL, high - geometry.center() + CELL);
    let counts = ((high - low) / CELL).ceil().to_array().map(|count| count as usize);
    let cell_of = |place: DVec3| {
        ((place - geometry.center() - low) / CELL).floor().to_array().map(|index| index as usize)
    };
    let middle = |cell: [usize; 3]| low + CELL * (DVec3::from_array(cell.map(|index| index as f64)) + 0.5);
    let wall = |cell: [usize; 3], axis: usize| {
        wall_between(geometry, middle(cell), DVec3::AXES[axis])
            .map(|surface| admittances[geometry.surface(surface).material as usize])
    };
    let receivers: Vec<[usize; 3]> =
        scene.receivers.iter().map(|receiver| cell_of(receiver.position)).collect();
    let steps = (scene.duration / step(CELL, scene.speed_of_sound)) as usize;
    let sources: Vec<[usize; 3]> = scene.sources.iter().map(|source| cell_of(source.position)).collect();
    let room = WaveRoom::new(counts, sources[0], wall);
    let responses = |&source| room.responses(&Places { source, receivers: &receivers }, steps);
    sources.iter().flat_map(responses).collect()
}

/// The first surface between a cell's middle and that of the next along an axis.
fn wall_between(geometry: &Geometry, middle: DVec3, axis: DVec3) -> Option<sonel_geometry::SurfaceId> {
    let hit = geometry.closest_hit(Departure::free(middle.as_vec3()), axis.as_vec3())?;
    (f64::from(hit.distance) < CELL).then_some(hit.surface)
}

/// Specific admittance of every material in the band about `centre` [Hz].
fn admittances(scene: &Scene, centre: f64) -> Result<Vec<f64>> {
    let band = scene
        .bands
        .nominal()
        .iter()
        .position(|nominal| nominal.total_cmp(&centre).is_eq())
        .context("a band of the scene")?;
    let of = |material: &sonel_acoustics::Material| {
        let impedance = impedance(material.absorption[band]);
        impedance.map(f64::recip).ok_or_else(|| anyhow!("{} absorbs more than waves can tell", material.name))
    };
    scene.materials.iter().map(of).collect()
}

/// Taps of the octave about `centre` [Hz] at a sample every `step` [s]: a windowed sinc of 12 periods.
fn octave(centre: f64, step: f64) -> Vec<f64> {
    let [low, high] = [centre / SQRT_2, centre * SQRT_2].map(|frequency| frequency * step);
    let half = (6.0 / low) as usize;
    let tap = |tap: usize| {
        let at = tap as f64 - half as f64;
        let window = 0.5 + 0.5 * (PI * at / (half as f64 + 1.0)).cos();
        let sinc = |cut: f64| {
            let x = 2.0 * PI * cut * at;
            if x == 0.0 { 2.0 * cut } else { 2.0 * cut * x.sin() / x }
        };
        window * (sinc(high) - sinc(low))
    };
    (0..=2 * half).map(tap).collect()
}

/// p² in the band of the `filter`, without the end of the signal: a filter is centred, and where it reaches beyond the end it makes a click of
/// what the scheme has left above the band.
///
/// # Errors
/// When the last half filter of what is left holds a millionth of the energy or more: the signal is too short for its decay.
fn energies(signal: &[f64], filter: &[f64], step: f64) -> Result<Vec<f64>> {
    let half = filter.len() / 2;
    let mut energies: Vec<f64> = filtered(signal, filter, step).into_iter().map(|p| p * p).collect();
    energies.truncate(signal.len().saturating_sub(half));
    let late: f64 = energies.iter().rev().take(half).sum();
    let share = late / energies.iter().sum::<f64>();
    ensure!(
        share < LATE_SHARE,
        "the last {half} samples hold {:.1} dB of the energy, {:.0} dB are allowed: solve for longer",
        10.0 * share.log10(),
        10.0 * LATE_SHARE.log10()
    );
    Ok(energies)
}

/// The signal in the band of the `filter`. A pulse of the scheme leaves a constant pressure in the room, which is taken out before.
fn filtered(signal: &[f64], filter: &[f64], step: f64) -> Vec<f64> {
    let leak = 2.0 * PI * STEADY * step;
    let (mut steady, half) = (0.0, filter.len() / 2);
    let signal: Vec<f64> = signal
        .iter()
        .map(|&sample| {
            steady += leak * (sample - steady);
            sample - steady
        })
        .collect();
    let sample = |index: usize| {
        let taps = filter.iter().enumerate().filter_map(|(tap, &weight)| {
            let at = (index + half).checked_sub(tap)?;
            signal.get(at).map(|sample| weight * sample)
        });
        taps.sum()
    };
    (0..signal.len()).map(sample).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Decay of 60 dB in `reverberation_time` [s] at 125 Hz over 2 s, beside a tone far above the band that does not decay.
    fn signal(reverberation_time: f64, step: f64) -> Vec<f64> {
        let sample = |index: u32| {
            let time = f64::from(index) * step;
            let tone = |frequency: f64| (2.0 * PI * frequency * time).sin();
            tone(125.0) * 10_f64.powf(-3.0 * time / reverberation_time) + tone(1400.0)
        };
        (0..(2.0 / step) as u32).map(sample).collect()
    }

    #[test]
    fn what_is_left_above_the_band_makes_no_click() {
        let step = step(CELL, 343.0);
        let filter = octave(125.0, step);
        let signal = signal(1.0, step);
        let decay = |energies: &[f64]| reverberation_time(energies, step, -5.0, -35.0);
        let kept = decay(&energies(&signal, &filter, step).unwrap());
        assert!((kept - 1.0).abs() < 0.01, "{kept} s");
        let whole: Vec<f64> = filtered(&signal, &filter, step).into_iter().map(|p| p * p).collect();
        let (end, total) =
            (whole.iter().rev().take(filter.len() / 2).sum::<f64>(), whole.iter().sum::<f64>());
        assert!(end > LATE_SHARE * total, "the click is noticed: {:e}", end / total);
    }

    #[test]
    fn signals_that_end_before_their_decay_are_refused() {
        let step = step(CELL, 343.0);
        let error = energies(&signal(4.0, step), &octave(125.0, step), step).unwrap_err();
        assert!(error.to_string().contains("solve for longer"), "{error}");
    }
}
