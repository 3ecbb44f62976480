//! Regions of different air: lengths, attenuation and impedance for the estimators.
//!
//! A path's length counts every leg times c₀/c of its air, so that it is a time in units of the scene's speed of sound c₀. With m c/c₀ for the
//! attenuation of an air, air takes Σ m ℓ as before. Of these coefficients the least of all airs is taken by [`crate::air`] over the whole
//! length, the rest leg by leg here.
//!
//! No straight path passes an interface, so straight paths to a receiver lie in the receiver's own air. Energies are
//! fluences times ρc of that air over that of the scene, so that one impedance makes levels of all of them.
//!
//! References: docs/physics.md §3.

use glam::{DVec3, Vec3};
use sonel_geometry::{Departure, Geometry, Side, SurfaceId};
use sonel_map::{Along, BandClasses, BandValues, Lanes, Segment, SonelMap};
use sonel_scene::{Effect, Scene};

use crate::air::AirTable;
use crate::error::RenderError;
use crate::settings::{Air, Estimator, RenderSettings};

/// The airs of a scene, by their numbers.
pub(crate) struct Airs(Vec<RegionAir>);

/// One air.
pub(crate) struct RegionAir {
    /// c₀/c.
    pub stretch: f64,
    /// ρc over that of the scene's air.
    pub impedance: f64,
    /// m of each class of bands, as it is for what is computed one by one [1/m].
    pub attenuation: Vec<f64>,
    /// The same over a length.
    pub table: AirTable,
    /// Attenuation that this air has beyond all others.
    rest: AirTable,
}

/// Distance from `position` (about the scene's centre [m]) to the next interface that faces it [m]; infinite without any.
#[must_use]
pub(crate) fn distance_to_interface(scene: &Scene, geometry: &Geometry, position: Vec3) -> f64 {
    let Some(media) = &scene.media else { return f64::INFINITY };
    let is_interface = |surface: SurfaceId| media.across(surface, Side::Front).is_some();
    let surfaces =
        (0..geometry.surfaces().len() as u32).map(SurfaceId).filter(|&surface| is_interface(surface));
    let normals = surfaces.map(|surface| geometry.surface(surface).normal.as_vec3().normalize());
    let hits = normals.flat_map(|normal| [normal, -normal]).filter_map(|direction| {
        geometry.closest_hit(Departure::free(position), direction).filter(|hit| is_interface(hit.surface))
    });
    hits.map(|hit| f64::from(hit.distance)).fold(f64::INFINITY, f64::min)
}

impl Airs {
    /// Airs of `scene`, and the least attenuation of what packets carry, m c/c₀ per class of bands. The scene's air has `attenuation` m per
    /// band [1/m], regions have that of the scene or, if it was asked for anew, none. `carried` says of each band whether air matters to
    /// what packets carry. Lengths are up to `reach` [m].
    pub(crate) fn new(
        scene: &Scene,
        air: &Air,
        classes: &BandClasses,
        attenuation: &[f64],
        carried: &[bool],
        reach: f64,
    ) -> (Self, Vec<f64>) {
        let still = vec![0.0; attenuation.len()];
        let regions = scene.media.iter().flat_map(|media| &media.regions).map(|region| match air {
            Air::OfScene => &region.air_attenuation[..],
            Air::Attenuation(_) => &still,
        });
        let all = std::iter::once(attenuation).chain(regions);
        let of_classes = |bands: &[f64]| classes.representatives().map(|band| bands[band]).collect();
        let attenuations: Vec<Vec<f64>> = all.map(of_classes).collect();
        let (stretches, impedances) = (scene.stretches(), scene.impedances());
        let is_carried: Vec<bool> = classes.representatives().map(|band| carried[band]).collect();
        let of_packets: Vec<Vec<f64>> = attenuations
            .iter()
            .zip(&stretches)
            .map(|(bands, stretch)| {
                let matters = |(m, &matters): (&f64, &bool)| if matters { m / stretch } else { 0.0 };
                bands.iter().zip(&is_carried).map(matters).collect()
            })
            .collect();
        let least: Vec<f64> = (0..classes.count())
            .map(|class| of_packets.iter().map(|bands| bands[class]).fold(f64::INFINITY, f64::min))
            .collect();
        let air = |(index, attenuation): (usize, Vec<f64>)| {
            let rest: Vec<f64> = of_packets[index].iter().zip(&least).map(|(m, least)| m - least).collect();
            RegionAir {
                stretch: stretches[index],
                impedance: impedances[index] / impedances[0],
                table: AirTable::new(&attenuation, reach / stretches[index]),
                attenuation,
                rest: AirTable::new(&rest, reach),
            }
        };
        (Self(attenuations.into_iter().enumerate().map(air).collect()), least)
    }

    /// One air.
    #[must_use]
    pub(crate) fn air(&self, air: u32) -> &RegionAir {
        &self.0[air as usize]
    }

    /// Whether there is more than one.
    #[inline]
    pub(crate) fn are_several(&self) -> bool {
        self.0.len() > 1
    }

    /// Takes from `energy` what `air` takes over `length`, times c₀/c [m], beyond what every air takes.
    pub(crate) fn fade(&self, air: u32, length: f64, energy: &mut [Lanes]) {
        self.air(air).rest.attenuate(length, energy);
    }

    /// Makes `energy` that comes to a receiver in `air`, straight over the last `length` times c₀/c [m], the receiver's.
    pub(crate) fn receive(&self, air: u32, length: f64, energy: &mut [Lanes]) {
        if self.are_several() {
            self.fade(air, length, energy);
            energy.scale(self.air(air).impedance);
        }
    }
}

/// Energies along one path, with what the airs on its way have taken beyond what every air takes.
pub(crate) struct Fading<'a> {
    airs: &'a Airs,
    reach: f64,
    kept: Along<Vec<Lanes>>,
    leaving: Vec<Lanes>,
    arriving: Vec<Lanes>,
}

impl<'a> Fading<'a> {
    /// At the beginning of a path of `lanes` lanes of bands, of up to `reach` [m].
    pub(crate) fn new(airs: &'a Airs, lanes: usize, reach: f64) -> Self {
        let zeros = || vec![Lanes::ZERO; lanes];
        Self { airs, reach, kept: Along::new(vec![Lanes::ONE; lanes]), leaving: zeros(), arriving: zeros() }
    }

    /// Hands over the next segment with its energies where it begins and, apart, where it ends.
    pub(crate) fn visit(&mut self, segment: &Segment<'_>, visit: &mut impl FnMut(&Segment<'_>, &[Lanes])) {
        self.kept.enter(segment);
        let length = (segment.end_length - segment.start_length).min(self.reach);
        self.leaving.set_product(segment.energy, &self.kept.now, 1.0);
        self.airs.fade(segment.air, length, &mut self.kept.now);
        self.arriving.set_product(segment.energy, &self.kept.now, 1.0);
        visit(&Segment { energy: &self.leaving, ..*segment }, &self.arriving);
    }
}

/// Length of the straight line from a source to a receiver, both in the axes of the scene [m], each part times c₀/c of its air: when direct
/// sound arrives, or would arrive. Where the speed of sound has a gradient, that along the arc.
#[must_use]
pub fn straight_length(scene: &Scene, geometry: &Geometry, source: usize, receiver: DVec3) -> f64 {
    let position = scene.sources[source].position;
    if let Some(profile) = scene.profile(geometry.center()) {
        let [from, to] = [position, receiver].map(|place| place - geometry.center());
        return profile.travel_time(from, to) * scene.speed_of_sound;
    }
    let Some(media) = &scene.media else { return position.distance(receiver) };
    let stretches = scene.stretches();
    let parts = media.parts_between(geometry, position, scene.air_at_source(source), receiver);
    parts.iter().map(|&(air, length)| length * stretches[air as usize]).sum()
}

/// Whether air matters to the sound that packets carry, per band: not where the map states that the scene's air does not matter to it. What is
/// computed one by one, air that was asked for anew, and air beside other materials, is as it is.
pub(crate) fn carries(air: &Air, map: &SonelMap) -> Vec<bool> {
    let is_as_traced = *air == Air::OfScene && map.drawn_with().is_none();
    let stated = map.header().effect(Effect::Air).filter(|_| is_as_traced);
    let matters = |band: usize| stated.and_then(|effect| effect.on.get(band)).copied().unwrap_or(true);
    (0..map.header().scene.bands.count()).map(matters).collect()
}

/// `settings` as they are for `scene`: where its speed of sound has a gradient, image sources are not computed along arcs
/// and visibility rays do not follow arcs.
///
/// # Errors
/// When they ask for either.
pub(crate) fn fit_settings(scene: &Scene, settings: RenderSettings) -> Result<RenderSettings, RenderError> {
    if scene.sound_speed_gradient == 0.0 {
        return Ok(settings);
    }
    let refused = |what: &str| {
        Err(RenderError::Settings(format!(
            "the speed of sound of this map has a gradient, and {what}: choose `estimator` auto, connection or sphere, without `order`"
        )))
    };
    match settings.estimator {
        Estimator::Gather => refused("visibility rays do not follow arcs"),
        Estimator::Paper => refused("the paper's estimator needs even air"),
        _ if settings.mirror_order.is_some_and(|order| order > 0) => {
            refused("image sources are not computed along arcs")
        }
        Estimator::Auto => {
            Ok(RenderSettings { estimator: Estimator::Connection, mirror_order: None, ..settings })
        }
        _ => Ok(RenderSettings { mirror_order: None, ..settings }),
    }
}

/// Refuses what is made for one air alone.
pub(crate) fn refuse_regions(scene: &Scene, settings: &RenderSettings) -> Result<(), RenderError> {
    if scene.media.is_none() {
        return Ok(());
    }
    let is_other_air =
        matches!(&settings.air, Air::Attenuation(attenuation) if attenuation.iter().any(|&m| m > 0.0));
    let problem = match (settings.estimator, is_other_air) {
        (Estimator::Paper, _) => {
            "the paper's estimator needs one air, the scene of this map has several regions of air: choose another `estimator`"
        }
        (_, true) => {
            "the scene of this map has several regions of air, which cannot be changed: change them in the scene file and trace again, or leave `air` out"
        }
        _ => return Ok(()),
    };
    Err(RenderError::Settings(problem.to_owned()))
}
