//! Objects: bodies of surfaces that edges join, past which sound diffracts.
//!
//! The field past one object is exact. Of several objects the ratios multiply that each alone leaves of the energy of a path, in every band, but of
//! losses and of gains no more than the two greatest count [ISO9613-2]: other objects hide neither an object's edges nor those hide the others. An
//! object is left out that one and the same other object hides from both ends. Objects less than a third of a wave across scatter less than
//! their edges do.
//!
//! References: docs/diffraction.md.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use sonel_geometry::{Connected, Crossed, EdgeShape, Geometry, SurfaceId};
use sonel_map::CoefficientTable;

use super::mirror::Mirror;

/// Object of surfaces without a diffracting edge: no sound goes around them.
pub(super) const SHELL: u32 = u32::MAX;

/// The object of every surface.
#[derive(Debug)]
pub(super) struct Objects {
    of_surface: Vec<u32>,
    /// Mean width of each [m]: half its surface over the diagonal of the box about it.
    widths: Vec<f64>,
    /// Middles [m].
    middles: Vec<DVec3>,
}

impl Objects {
    /// Objects of `geometry`: surfaces that continue one another, or meet where sound diffracts, are of one object.
    #[must_use]
    pub(super) fn new(geometry: &Geometry) -> Self {
        let count = geometry.surfaces().len();
        let mut connected = Connected::new(count);
        let joins = geometry.edges().iter().filter(|e| !e.sectors.is_empty() || e.shape == EdgeShape::Seam);
        for pair in joins.flat_map(|edge| edge.surfaces.windows(2)) {
            connected.join(pair[0].0, pair[1].0);
        }
        let mut diffracts = vec![false; count];
        for surface in geometry.diffracting_edges().flat_map(|edge| &edge.surfaces) {
            diffracts[connected.root(surface.0) as usize] = true;
        }
        let object = |surface| {
            Some(connected.root(surface)).filter(|&object| diffracts[object as usize]).unwrap_or(SHELL)
        };
        let of_surface: Vec<u32> = (0..count as u32).map(object).collect();
        let mut areas = vec![0.0; of_surface.len()];
        let mut bounds = vec![[DVec3::INFINITY, DVec3::NEG_INFINITY]; of_surface.len()];
        for (surface, &object) in (0..).zip(&of_surface).filter(|(_, object)| **object != SHELL) {
            let (id, object) = (SurfaceId(surface), object as usize);
            let (low, high) = geometry.mesh().bounds_of(&geometry.surface(id).triangles);
            areas[object] += 0.5 * geometry.exposed(id);
            bounds[object] = [bounds[object][0].min(low), bounds[object][1].max(high)];
        }
        let middles: Vec<DVec3> = bounds.iter().map(|[low, high]| low.midpoint(*high)).collect();
        let width = |(area, [low, high]): (&f64, &[DVec3; 2])| area / low.distance(*high);
        Self { widths: areas.iter().zip(&bounds).map(width).collect(), of_surface, middles }
    }

    /// Share of the scattering of an object that its edges describe at wave number `k` [1/m]: all from a third of a wave across on. Below it scattering falls as
    /// the square of the frequency [Rayleigh1896], which two orders of edges do not.
    #[must_use]
    pub(super) fn described(&self, object: u32, k: f64) -> f64 {
        let waves = |width: &f64| width * k / TAU;
        self.widths.get(object as usize).map_or(1.0, |width| (9.0 * waves(width) * waves(width)).min(1.0))
    }

    /// How much the smaller one of the losses in decibels of two objects counts beside the greater at wave number `k` [1/m]: (C₃ − 1)/2 of double
    /// barriers [ISO9613-2], nothing where they are close together and all of it where they are many wavelengths apart.
    #[must_use]
    pub(super) fn second(&self, objects: [u32; 2], k: f64) -> f64 {
        let middles = objects.map(|object| self.middles.get(object as usize));
        let [Some(one), Some(other)] = middles else { return 1.0 };
        let apart = one.distance(*other) * k / (10.0 * PI);
        let square = apart * apart;
        0.5 * ((square + 1.0) / (square / 3.0 + 1.0) - 1.0)
    }

    /// The object of `surface`.
    #[must_use]
    pub(super) fn of(&self, surface: SurfaceId) -> u32 {
        self.of_surface[surface.0 as usize]
    }

    /// The objects that block the path between two `ends` [m], in general position, over `mirrors`, or are too small a mirror for it. Partitions of the
    /// materials in `through` do not.
    #[must_use]
    pub(super) fn blocking(
        &self,
        geometry: &Geometry,
        table: &CoefficientTable,
        [from, to]: [DVec3; 2],
        mirrors: &[&Mirror],
        through: &[u32],
    ) -> Vec<u32> {
        let (mut blocking, mut at, mut left) = (Vec::new(), from, None);
        let mut rest = mirrors.to_vec();
        let is_mirrored = loop {
            if rest.is_empty() {
                break true;
            }
            let image = rest.iter().rev().fold(to, |point, mirror| mirror.image(point));
            // Of mirrors at right angles the path meets the nearest first, whatever the order they are given in.
            let share = |mirror: &Mirror| mirror.height(at) / (mirror.height(at) - mirror.height(image));
            let is_next = |next: &usize| rest[..*next].iter().all(|mirror| mirror.is_across(rest[*next]));
            let shares = (0..rest.len()).filter(is_next).map(|next| (share(rest[next]), next));
            let Some((share, next)) = shares.min_by(|a, b| a.0.total_cmp(&b.0)) else { break false };
            let mirror = rest.remove(next);
            // A sheet mirrors on the side of the path, whichever side of it the mirror was named by.
            if mirror.height(at) * mirror.height(image) >= 0.0 {
                blocking.push(mirror.object);
                break false;
            }
            let faces = geometry.faces_between([at, image], left);
            let is_met =
                |face: &Crossed| face.plane == mirror.plane && self.of(face.surface) == mirror.object;
            if !faces.iter().any(is_met) {
                blocking.push(mirror.object);
            }
            let before = faces.iter().take_while(|face| face.share < share && face.plane != mirror.plane);
            blocking.extend(self.opaque(geometry, table, before.map(|face| face.surface), through));
            at += (image - at) * share;
            left = Some(mirror.plane);
        };
        // Where a mirror leads nowhere there is no rest of the path that anything could block.
        if is_mirrored {
            let faces = geometry.faces_between([at, to], left);
            blocking.extend(self.opaque(geometry, table, faces.iter().map(|face| face.surface), through));
        }
        blocking.sort_unstable();
        blocking.dedup();
        blocking
    }

    /// The objects of those `surfaces` that are no partition of a material in `through`.
    fn opaque(
        &self,
        geometry: &Geometry,
        table: &CoefficientTable,
        surfaces: impl Iterator<Item = SurfaceId>,
        through: &[u32],
    ) -> Vec<u32> {
        let is_passed = |surface: &SurfaceId| {
            let material = geometry.surface(*surface).material;
            table.material(material).is_partition && through.contains(&material)
        };
        surfaces.filter(|surface| !is_passed(surface)).map(|surface| self.of(surface)).collect()
    }
}
