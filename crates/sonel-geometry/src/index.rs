//! Finding the triangles on a ray: a scan of one wide block while that is faster, a tree beyond.

use crate::PlaneId;
use crate::block::{Block, Facet, Pierced};
use crate::probe::{LocalPlane, Probe};
use crate::tree::Tree;
use glam::Vec3;

/// Lanes of the block that is scanned, and most triangles that are: beyond, a tree is faster. A room of 12 triangles takes 0.75 of the tree's time
/// for it, one of 20 as much for the nearest hit and 1.1 for shadows (`--example rays`). Speed alone depends on it.
const SCAN_LANES: usize = 16;

/// Triangles arranged for rays, and the planes they lie in.
pub(crate) struct Index {
    arrangement: Arrangement,
    planes: Vec<LocalPlane>,
    /// Whether each triangle is part of a closed shell.
    in_shell: Vec<bool>,
    /// Height over a plane [m] that rounding may hide.
    resolution: f64,
}

enum Arrangement {
    Scan(Box<Block<SCAN_LANES>>),
    Tree(Tree),
}

/// A triangle that the ray meets.
#[derive(Clone, Copy)]
pub(crate) struct Met {
    /// In multiples of the ray's direction.
    pub distance: f64,
    pub from_behind: bool,
    pub triangle: u32,
    plane: u32,
    /// Barycentric coordinates of the point, as exact as the ray's shear in single precision.
    pub weights: [f32; 3],
}

impl Met {
    const NOTHING: Self = Self {
        distance: f64::INFINITY,
        from_behind: true,
        triangle: u32::MAX,
        plane: u32::MAX,
        weights: [0.0; 3],
    };

    /// The order is by distance; where two coincide the one that faces the ray comes first (a panel modelled as two
    /// sheets shows each its own material), then the lower index.
    #[inline(always)]
    fn is_before(&self, other: &Self) -> bool {
        let tie = || (self.from_behind, self.triangle) < (other.from_behind, other.triangle);
        self.distance < other.distance || (self.distance <= other.distance && tie())
    }
}

/// The nearest triangles so far: of all, and of those that face the ray.
#[derive(Clone, Copy)]
struct Nearest {
    any: Met,
    facing: Met,
}

impl Index {
    /// Arranges triangles, of which those `in_shell` are part of a closed shell; `padding` [m] is what a ray may pass
    /// beside a box by rounding, `resolution` [m] the error of a vertex.
    pub(crate) fn build(
        facets: &[Facet],
        planes: Vec<LocalPlane>,
        in_shell: Vec<bool>,
        padding: f32,
        resolution: f32,
    ) -> Self {
        let arrangement = if facets.len() <= SCAN_LANES {
            Arrangement::Scan(Box::new(Block::new(facets)))
        } else {
            Arrangement::Tree(Tree::build(facets, padding))
        };
        Self { arrangement, planes, in_shell, resolution: f64::from(resolution) }
    }

    /// The first triangle in front of the ray's origin.
    pub(crate) fn nearest(&self, ray: &Probe) -> Option<Met> {
        let mut nearest = Nearest { any: Met::NOTHING, facing: Met::NOTHING };
        match &self.arrangement {
            Arrangement::Scan(block) => self.nearest_in(block, ray, &mut nearest),
            Arrangement::Tree(tree) => {
                tree.nearest(ray, |block| {
                    self.nearest_in(block, ray, &mut nearest);
                    if self.is_doubtful(nearest.any) { nearest.facing.distance } else { nearest.any.distance }
                });
            }
        }
        if nearest.any.triangle == u32::MAX {
            return None;
        }
        let graze = self.is_doubtful(nearest.any) && self.is_same_place(ray, &nearest);
        Some(if graze { nearest.facing } else { nearest.any })
    }

    /// Whether a ray in the air could not have met this first: a closed shell from behind.
    #[inline]
    fn is_doubtful(&self, met: Met) -> bool {
        met.from_behind && self.is_of_shell(met.triangle)
    }

    /// Whether a triangle is part of a closed shell.
    #[inline]
    pub(crate) fn is_of_shell(&self, triangle: u32) -> bool {
        self.in_shell.get(triangle as usize).is_some_and(|&in_shell| in_shell)
    }

    /// Whether the nearest triangle and the nearest one facing the ray are met at one place, as far as rounding tells.
    /// So it is on the silhouette of a protruding edge, where the ray passes through both faces within an error of
    /// their distances: there the ray grazes the face it sees.
    fn is_same_place(&self, ray: &Probe, nearest: &Nearest) -> bool {
        let gap = nearest.facing.distance - nearest.any.distance;
        let near_plane = |met: &Met| gap * ray.steepness(&self.planes[met.plane as usize]) <= self.resolution;
        gap.is_finite() && (near_plane(&nearest.facing) || near_plane(&nearest.any))
    }

    /// Whether any triangle lies between the ray's origin and the tip of its direction, more than `clearance` [m] off
    /// in height over the triangle's plane.
    pub(crate) fn any_before_tip(&self, ray: &Probe, clearance: f64) -> bool {
        match &self.arrangement {
            Arrangement::Scan(block) => self.any_in(block, ray, clearance),
            Arrangement::Tree(tree) => tree.any(ray, |block| self.any_in(block, ray, clearance)),
        }
    }

    /// Calls `visit` for every triangle that may lie on the ray as far as the tip of its direction, until it returns true; `slack` [m²] is
    /// the doubt in an edge function. Returns whether it did.
    #[inline]
    pub(crate) fn any_near(&self, ray: &Probe, slack: f32, mut visit: impl FnMut(u32) -> bool) -> bool {
        match &self.arrangement {
            Arrangement::Scan(block) => block.any_near(ray, slack, visit),
            Arrangement::Tree(tree) => tree.any(ray, |block| block.any_near(ray, slack, &mut visit)),
        }
    }

    /// Calls `visit` for every triangle whose box may meet that from `low` to `high`, and for some others.
    pub(crate) fn near_box(&self, low: Vec3, high: Vec3, mut visit: impl FnMut(u32)) {
        match &self.arrangement {
            Arrangement::Scan(block) => block.triangles().for_each(visit),
            Arrangement::Tree(tree) => {
                tree.within(low, high, |block| block.triangles().for_each(&mut visit));
            }
        }
    }

    /// Calls `visit` for triangles about a local position [m], until all others are farther off than the distance that it returned last.
    pub(crate) fn around(&self, point: Vec3, mut visit: impl FnMut(u32) -> f64) {
        match &self.arrangement {
            Arrangement::Scan(block) => block.triangles().for_each(|triangle| {
                visit(triangle);
            }),
            Arrangement::Tree(tree) => {
                tree.around(point, |block| {
                    block.triangles().fold(f64::INFINITY, |_, triangle| visit(triangle))
                });
            }
        }
    }

    /// One of the planes.
    pub(crate) fn plane(&self, plane: PlaneId) -> &LocalPlane {
        &self.planes[plane.0 as usize]
    }

    #[inline(always)]
    fn nearest_in<const N: usize>(&self, block: &Block<N>, ray: &Probe, nearest: &mut Nearest) {
        block.pierce(ray, |pierced| {
            let distance = ray.distance_to(&self.planes[pierced.plane as usize]);
            let Pierced { triangle, plane, from_behind, weights } = pierced;
            let met = Met { distance, from_behind, triangle, plane, weights };
            // No nearest facing triangle is nearer than the nearest of all.
            if distance > 0.0 && distance <= nearest.facing.distance {
                if met.is_before(&nearest.any) {
                    nearest.any = met;
                }
                if !from_behind && met.is_before(&nearest.facing) {
                    nearest.facing = met;
                }
            }
        });
    }

    #[inline(always)]
    fn any_in<const N: usize>(&self, block: &Block<N>, ray: &Probe, clearance: f64) -> bool {
        let mut any = false;
        block.pierce(ray, |pierced| {
            any |= ray.tip_is_beyond(&self.planes[pierced.plane as usize], clearance);
        });
        any
    }
}
