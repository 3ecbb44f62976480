//! Decay of a room at its receivers, from a short run: how long a run has to be, and how far the room is from Sabine's.
//!
//! Sabine's time holds where sound is diffuse. Sound along hard walls under an absorbing ceiling decays several times more slowly. A short run
//! that is long enough for that is rendered at the evaluation receivers; a run lasts 1.2 times as long as the decay curve of the receiver, source
//! and band that is slowest takes to fall by 60 dB.
//!
//! References: [Sabine1922], [Schroeder1965], [ISO3382-1] (docs/references.md).

use sonel_acoustics::Material;
use sonel_analysis::regression::{self, DecayRange};
use sonel_analysis::{DecayCurve, Echogram};
use sonel_echogram::Response;
use sonel_geometry::{Geometry, LARGEST_TURN};
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::{DURATION_PER_SABINE_TIME, LONGEST_DEFAULT_DURATION, Scene};

use crate::Result;
use crate::observer::{Silent, Watch};
use crate::study::evaluation_receivers::{MOST, evaluation_receivers};
use crate::study::job::Job;
use crate::study::pipeline::{InMemory, Room};

/// Packets of each source: with them the decay of an office with a ceiling of tiles fell by 50 dB a tenth sooner than with 30 000.
const PACKETS: u64 = 2048;
/// Visibility rays of a receiver: half the packets. Chosen, not measured.
const RAYS: u32 = 1024;
/// Level that ends the decay of a room [dB]. Runs that ended at −50 dB took 5 % less CPU time, and what was missing widened the interval of T30
/// in that office by up to a factor of two.
const END_DB: f64 = -60.0;
/// At most so many times the largest Sabine time. A box of mirrors whose floor alone absorbs decays 6 times more slowly than Sabine's.
const MOST_SABINE_TIMES: f64 = 8.0;
/// Bins of the run at the least: two for each decibel of a decay at Sabine's time.
const LEAST_BINS: f64 = 1000.0;
/// Durations are whole multiples of 1/100 s.
const PER_SECOND: f64 = 100.0;

/// Decay curves of every source at the evaluation receivers.
pub struct RoomDecay {
    response: Response,
}

impl RoomDecay {
    /// Decay of `scene`, whose walls are `geometry`, in a run of 8 times the largest Sabine time and at most 30 s. [`None`] without a Sabine time.
    ///
    /// # Errors
    /// When the room leaks, or a source or receiver is in no allowed place.
    pub fn of(scene: &Scene, geometry: &Geometry) -> Result<Option<Self>> {
        let Some(longest) = longest(scene, geometry) else { return Ok(None) };
        let gradient = scene.sound_speed_gradient.abs();
        let scene = scene.clone().with_duration(longest);
        let settings = Settings { emissions: PACKETS, ..Settings::default() };
        let map = Room::within(&scene, geometry, &[]).trace(settings, &mut InMemory, &Silent)?.map;
        // Few images: spheres take what they leave. With a gradient there are none. Edges do not change how a room decays.
        let mirror_order = (gradient <= 0.0).then_some(1);
        // Times are read to 1/100 s, so bins are its divisors: at most a few thousand of them.
        let bin = [0.01, 0.005, 0.002].into_iter().find(|bin| longest >= LEAST_BINS * bin).unwrap_or(0.001);
        let default = RenderSettings::default();
        let settings = RenderSettings { rays: Some(RAYS), mirror_order, edges: false, bin, ..default };
        let receivers = evaluation_receivers(&scene, geometry, MOST);
        let rendered = Job::of(&map, geometry, &receivers, Watch(&Silent)).render(&settings)?;
        Ok(Some(Self { response: rendered.response }))
    }

    /// Curves with the indices of their bands; none where no sound arrives or it does not decay.
    fn curves(&self) -> impl Iterator<Item = (usize, DecayCurve)> + '_ {
        let response = &self.response;
        let pairs = (0..response.sources()).flat_map(|s| (0..response.receivers()).map(move |r| (s, r)));
        pairs.flat_map(move |(s, r)| {
            let curve = move |b: usize| {
                let (edges, direct_time) = (&response.time_edges_s, response.direct_time(s, r));
                let energy = response.echogram(s, r, b);
                Some((b, DecayCurve::new(Echogram { edges, energy, direct_time, arrivals: &[] }).ok()?))
            };
            (0..response.bands()).filter_map(curve)
        })
    }

    /// Duration in which every curve falls by 60 dB [s], at most that of this run, and the band that decides it.
    #[must_use]
    pub fn duration(&self) -> (f64, usize) {
        let end = |(band, curve): (usize, DecayCurve)| {
            let fallen = curve.levels_db().find(|(_, level)| *level <= END_DB);
            (curve.direct_time() + fallen.map_or(curve.duration(), |(time, _)| time), band)
        };
        self.curves().map(end).fold((0.0, 0), |last, end| if end.0 > last.0 { end } else { last })
    }

    /// T30 of `band` [s], the mean over sources and receivers; none where it cannot be read at any.
    #[must_use]
    pub fn reverberation_time(&self, band: usize) -> Option<f64> {
        let of_band = self.curves().filter(|(own, _)| *own == band);
        let times: Vec<f64> = of_band
            .filter_map(|(_, curve)| Some(regression::fit(&curve, DecayRange::T30).ok()?.time))
            .collect();
        (!times.is_empty()).then(|| times.iter().sum::<f64>() / times.len() as f64)
    }
}

/// Duration of the short run [s]; none without a Sabine time.
fn longest(scene: &Scene, geometry: &Geometry) -> Option<f64> {
    let gradient = scene.sound_speed_gradient.abs();
    let turning = if gradient > 0.0 { LARGEST_TURN / gradient } else { f64::INFINITY };
    let sabine = scene.largest_sabine_time(geometry)?;
    Some((MOST_SABINE_TIMES * sabine).min(LONGEST_DEFAULT_DURATION).min(turning))
}

/// `scene` with the coefficients of the variants that absorb least, and scatter least of those, in the place of its materials: it decays
/// as slowly as with any.
fn slowest(scene: &Scene) -> Scene {
    let key = |material: &Material, band: usize| (material.absorption[band], material.scattering[band]);
    let mut materials = scene.materials.clone();
    for (material, variants) in materials.iter_mut().zip(&scene.variants) {
        for band in 0..scene.bands.count() {
            for variant in variants {
                if key(variant, band) < key(material, band) {
                    material.absorption[band] = variant.absorption[band];
                    material.scattering[band] = variant.scattering[band];
                    material.transmission[band] = variant.transmission[band];
                }
            }
        }
    }
    Scene { materials, variants: Vec::new(), designs: Vec::new(), ..scene.clone() }
}

/// Gives `scene`, whose file states no duration, the length that its room needs, also with variants of its materials; says so in a
/// sentence. Nothing happens where a duration is stated.
///
/// # Errors
/// The errors of [`RoomDecay::of`].
pub fn lengthen(scene: &mut Scene, geometry: &Geometry) -> Result<Option<String>> {
    if !scene.has_default_duration {
        return Ok(None);
    }
    scene.has_default_duration = false;
    let slowest = slowest(scene);
    // Between walls that hardly absorb the short run would take long and ask for no more.
    let most = longest(&slowest, geometry).unwrap_or(0.0);
    if most <= scene.duration {
        return Ok(None);
    }
    let Some(decay) = RoomDecay::of(&slowest, geometry)? else { return Ok(None) };
    let (fallen, band) = decay.duration();
    let needed = libm::ceil(PER_SECOND * most.min(DURATION_PER_SABINE_TIME * fallen)) / PER_SECOND;
    if needed <= scene.duration {
        return Ok(None);
    }
    scene.duration = needed;
    Ok(Some(format!(
        "duration_s: {needed:.2} (default: {DURATION_PER_SABINE_TIME} times the slowest decay by {:.0} dB in a short run, at {} Hz; at most {MOST_SABINE_TIMES} \
         Sabine times and {LONGEST_DEFAULT_DURATION} s)",
        -END_DB,
        scene.bands.nominal()[band]
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::{BandWidth, Bands};
    use sonel_geometry::Mesh;

    /// A box of 7 × 5 × 3 m whose ceiling alone absorbs, the other sides have an absorption of `walls`.
    fn classroom(ceiling: f64, walls: f64, scattering: f64) -> (Scene, Geometry) {
        let bands = Bands::new(vec![500.0, 1000.0], BandWidth::Octave).unwrap();
        let material = |absorption| Material::uniform("side", absorption, scattering, 2);
        let mesh = Mesh::shoebox([7.0, 5.0, 3.0], [0, 0, 0, 0, 0, 1]);
        let mut scene = Scene::from_parts(mesh, vec![material(walls), material(ceiling)], bands, 1.0)
            .without_air_attenuation()
            .with_source("source", [1.7, 1.4, 1.5]);
        let geometry = scene.geometry().unwrap();
        scene.duration = DURATION_PER_SABINE_TIME * scene.largest_sabine_time(&geometry).unwrap();
        scene.has_default_duration = true;
        (scene, geometry)
    }

    #[test]
    fn a_diffuse_room_keeps_the_length_of_sabine_and_a_classroom_gets_a_longer_one() {
        let (mut diffuse, geometry) = classroom(0.2, 0.2, 1.0);
        let before = diffuse.duration;
        assert_eq!(lengthen(&mut diffuse, &geometry).unwrap(), None);
        assert!((diffuse.duration - before).abs() < 1e-12 && !diffuse.has_default_duration);
        let (mut uneven, geometry) = classroom(0.9, 0.03, 0.05);
        let before = uneven.duration;
        let sentence = lengthen(&mut uneven, &geometry).unwrap().unwrap();
        assert!(uneven.duration > 1.3 * before, "{} {before} {sentence}", uneven.duration);
        // Whoever states a duration gets it.
        let (uneven, geometry) = classroom(0.9, 0.03, 0.05);
        let mut stated = uneven.with_duration(0.3);
        assert_eq!(lengthen(&mut stated, &geometry).unwrap(), None);
    }

    #[test]
    fn a_run_is_long_enough_for_the_variant_that_decays_most_slowly() {
        let (mut uneven, geometry) = classroom(0.9, 0.03, 0.05);
        lengthen(&mut uneven, &geometry).unwrap().unwrap();
        let (damped, _) = classroom(0.9, 0.4, 0.05);
        let lengthened = |variants: Vec<Vec<Material>>| {
            let mut scene = Scene { variants, ..damped.clone() };
            lengthen(&mut scene, &geometry).unwrap();
            scene.duration
        };
        let hard = Material::uniform("side", 0.03, 0.05, 2);
        assert_eq!(lengthened(vec![vec![hard], Vec::new()]).to_bits(), uneven.duration.to_bits());
        assert!(lengthened(Vec::new()) < 0.5 * uneven.duration);
    }

    /// Eyring's time with Kuttruff's correction is that of a diffuse box to a few per cent; the packets are few.
    #[test]
    fn the_reverberation_time_of_a_diffuse_room_is_about_that_of_eyring() {
        let (scene, geometry) = classroom(0.3, 0.3, 1.0);
        let found = RoomDecay::of(&scene, &geometry).unwrap().unwrap().reverberation_time(1).unwrap();
        let (volume, area) = (105.0, 142.0);
        let eyring = sonel_acoustics::eyring_time(volume, area, 0.3, 0.0, scene.speed_of_sound);
        assert!((found / eyring - 1.0).abs() < 0.08, "{found} {eyring}");
    }

    /// Sound between lossless walls hardly decays: the run is as long as allowed.
    #[test]
    fn the_longest_run_is_eight_sabine_times() {
        let (mut flutter, geometry) = classroom(0.9, 0.0, 0.0);
        let sabine = flutter.largest_sabine_time(&geometry).unwrap();
        lengthen(&mut flutter, &geometry).unwrap().unwrap();
        assert!((flutter.duration / sabine - 8.0).abs() < 0.02, "{} {sabine}", flutter.duration);
    }
}
