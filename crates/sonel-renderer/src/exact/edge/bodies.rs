//! Bodies: surfaces that touch one another, such as a desk with its screen, apart from the walls of the room.
//!
//! A body scatters as a whole: what its faces mirror and what comes over its edges is one coherent field. A wall is an image source, whose energy
//! adds to that of others. What stands on a wall is one body with its mirror image.
//!
//! A body less than two thirds of a wave across scatters less than its edges do, and a quarter of a period earlier in the limit: a shadow is taken from
//! the wave, but a small body moves with it [Rayleigh1896]. Its amplitudes have the factor f exp(jπ(1 − f)/2), f = (1.5 w/λ)², and what it hides is left
//! by the rest. The width w is half its surface over its diagonal.
//!
//! References: docs/diffraction.md.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;
use sonel_diffraction::{Complex, unit};
use sonel_geometry::{Connected, EdgeShape, Geometry, PlaneId, Surface, SurfaceId};

/// Widths per wave from which on edges describe all that a body scatters [1]: 1/1.5. Between 1.2 and 1.8 the error against waves changes by less than
/// 0.4 dB rms in any octave (docs/diffraction.md).
const WIDE: f64 = 1.5;
/// The body of walls.
pub(super) const WALL: u32 = u32::MAX;

/// The body of every surface.
#[derive(Debug)]
pub(super) struct Bodies {
    of_surface: Vec<u32>,
    /// Mean width of each [m]: half its surface over the diagonal of the box about it, with its mirror image where it stands on a wall.
    widths: Vec<f64>,
    /// The walls that each body stands on, by a surface of theirs.
    stands_on: HashMap<u32, Planes>,
}

impl Bodies {
    /// Bodies of `geometry`: surfaces that touch are of one body. What touches walls of the room in two planes or more is a wall itself.
    #[must_use]
    pub(super) fn new(geometry: &Geometry) -> Self {
        let count = geometry.surfaces().len();
        let walls = walls(geometry);
        let is_wall = |surface: SurfaceId| walls[surface.0 as usize];
        let of_surface: Vec<u32> = bodies(geometry, |surface| !is_wall(surface))
            .into_iter()
            .enumerate()
            .map(|(surface, body)| if walls[surface] { WALL } else { body })
            .collect();
        let stands_on = contacts(geometry, &of_surface);
        let mut bounds = vec![[DVec3::INFINITY, DVec3::NEG_INFINITY]; count];
        // Half of what is turned to each cell: a hollow box scatters with its outside, as a closed one does.
        let mut areas: HashMap<(usize, u32), f64> = HashMap::new();
        for (surface, &body) in (0..).zip(&of_surface).filter(|(_, body)| **body != WALL) {
            let (id, body) = (SurfaceId(surface), body as usize);
            let (low, high) = geometry.mesh().bounds_of(&geometry.surface(id).triangles);
            for cell in geometry.cells_beside(id).take(2) {
                *areas.entry((body, cell)).or_default() += 0.5 * geometry.surface(id).area;
            }
            bounds[body] = [bounds[body][0].min(low), bounds[body][1].max(high)];
        }
        let mut largest = vec![0.0_f64; count];
        areas.into_iter().for_each(|((body, _), area)| largest[body] = largest[body].max(area));
        let width = |(body, (area, [low, high])): (usize, (&f64, &[DVec3; 2]))| {
            let size = *high - *low;
            match stands_on.get(&(body as u32)).and_then(|planes| planes.first()) {
                // With its mirror image it is twice as large, and twice as long across the plane.
                Some((.., normal)) => {
                    let across = size.dot(normal.abs());
                    2.0 * area / (size.length_squared() + 3.0 * across * across).sqrt()
                }
                None => area / size.length(),
            }
        };
        Self { widths: largest.iter().zip(&bounds).enumerate().map(width).collect(), of_surface, stands_on }
    }

    /// Factor on what the edges and faces of a body scatter at wave number `k` [1/m].
    #[must_use]
    pub(super) fn scattered(&self, body: u32, k: f64) -> Complex {
        let Some(width) = self.widths.get(body as usize) else { return Complex::from(1.0) };
        let waves = WIDE * width * k / TAU;
        let share = (waves * waves).min(1.0);
        unit(FRAC_PI_2 * (1.0 - share)) * share
    }

    /// The walls that bodies stand on, each once.
    pub(super) fn floors(&self) -> Vec<SurfaceId> {
        let mut floors: Vec<(PlaneId, SurfaceId)> =
            self.stands_on.values().flatten().map(|(plane, surface, _)| (*plane, *surface)).collect();
        floors.sort_unstable();
        floors.dedup_by_key(|(plane, _)| *plane);
        floors.into_iter().map(|(_, surface)| surface).collect()
    }

    /// Whether a body stands on a plane.
    #[must_use]
    pub(super) fn stands_on(&self, body: u32, plane: PlaneId) -> bool {
        self.stands_on.get(&body).is_some_and(|planes| planes.iter().any(|(known, ..)| *known == plane))
    }

    /// The body of `surface`.
    #[must_use]
    pub(super) fn of(&self, surface: SurfaceId) -> u32 {
        self.of_surface[surface.0 as usize]
    }
}

/// Planes, with a surface and the normal of each.
type Planes = Vec<(PlaneId, SurfaceId, DVec3)>;

/// The body of every surface: that of the surfaces that it touches, of those that `belongs`.
fn bodies(geometry: &Geometry, belongs: impl Fn(SurfaceId) -> bool) -> Vec<u32> {
    let count = geometry.surfaces().len() as u32;
    let mut connected = Connected::new(count as usize);
    for edge in geometry.edges() {
        let bodies: Vec<u32> =
            edge.surfaces.iter().filter(|&&surface| belongs(surface)).map(|surface| surface.0).collect();
        bodies.windows(2).for_each(|pair| connected.join(pair[0], pair[1]));
    }
    (0..count).map(|surface| connected.root(surface)).collect()
}

/// The planes of walls that each body touches.
fn contacts(geometry: &Geometry, of_surface: &[u32]) -> HashMap<u32, Planes> {
    let mut contacts: HashMap<u32, Planes> = HashMap::new();
    let of = |surface: &SurfaceId| of_surface[surface.0 as usize];
    for edge in geometry.edges() {
        for &id in edge.surfaces.iter().filter(|surface| of(surface) == WALL) {
            let wall = geometry.surface(id);
            for body in edge.surfaces.iter().map(of).filter(|body| *body != WALL) {
                let planes = contacts.entry(body).or_default();
                if planes.iter().all(|(plane, ..)| *plane != wall.plane) {
                    planes.push((wall.plane, id, wall.normal));
                }
            }
        }
    }
    contacts
}

/// The floor in the open: the largest surface, if its rim is free and all else is on one side of it and low: at most half its area over its
/// diagonal. The side of a box has no free rim, and a screen with a desk before it is not wide enough.
fn floor(geometry: &Geometry) -> Option<SurfaceId> {
    let ids = (0..geometry.surfaces().len() as u32).map(SurfaceId);
    let largest =
        ids.max_by(|&one, &other| geometry.surface(one).area.total_cmp(&geometry.surface(other).area))?;
    let Surface { normal, offset, area, triangles, .. } = geometry.surface(largest);
    let heights = geometry.mesh().vertices.iter().map(|point| normal.dot(*point) - offset);
    let [below, above] =
        heights.fold([0.0_f64; 2], |[low, high], height| [low.min(height), high.max(height)]);
    let (low, high) = geometry.mesh().bounds_of(triangles);
    let is_low = above.max(-below) <= 0.5 * area / low.distance(high);
    let is_free = geometry
        .diffracting_edges()
        .all(|edge| edge.surfaces.len() == 1 || !edge.surfaces.contains(&largest));
    let is_below = above.min(-below) <= f64::from(geometry.resolution());
    (is_low && is_free && is_below).then_some(largest)
}

/// Which surfaces are walls of the room: those without a diffracting edge, a floor in the open, and what touches them in more than one plane.
fn walls(geometry: &Geometry) -> Vec<bool> {
    let surfaces = geometry.surfaces();
    let mut connected = Connected::new(surfaces.len());
    let joins = geometry.edges().iter().filter(|e| !e.sectors.is_empty() || e.shape == EdgeShape::Seam);
    for pair in joins.flat_map(|edge| edge.surfaces.windows(2)) {
        connected.join(pair[0].0, pair[1].0);
    }
    let mut diffracts = vec![false; surfaces.len()];
    for surface in geometry.diffracting_edges().flat_map(|edge| &edge.surfaces) {
        diffracts[connected.root(surface.0) as usize] = true;
    }
    let floor = floor(geometry);
    let mut walls: Vec<bool> = (0..surfaces.len() as u32)
        .map(|surface| !diffracts[connected.root(surface) as usize] || floor == Some(SurfaceId(surface)))
        .collect();
    let bodies = bodies(geometry, |surface| !walls[surface.0 as usize]);
    let of_surface: Vec<u32> =
        bodies.iter().zip(&walls).map(|(body, wall)| if *wall { WALL } else { *body }).collect();
    let contacts = contacts(geometry, &of_surface);
    for (surface, body) in of_surface.iter().enumerate() {
        walls[surface] |= contacts.get(body).is_some_and(|planes| planes.len() > 1);
    }
    walls
}
