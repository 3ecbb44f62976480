//! L S^k R, k ≤ K: image sources, completely enumerated.
//!
//! Every sequence of up to K planar surfaces that can carry energy is validated exactly at every receiver, so the class has
//! neither bias nor noise. In an empty box the images form a lattice and need no
//! validation; elsewhere they form a tree, whose depth K is the last that fits a fixed budget of nodes. K depends on the
//! scene and the source alone, never on the receivers (docs/physics.md §4).
//!
//! Reference: [AllenBerkley1979] (docs/references.md).

pub(crate) mod beam;
pub(crate) mod chain;
pub(crate) mod chains;
pub(crate) mod lattice;
pub(crate) mod tree;

use std::sync::Arc;

use glam::DVec3;
use sonel_acoustics::{Directivity, Radiation};
use sonel_geometry::{End, Geometry, Shoebox, SurfaceId};
use sonel_map::{CoefficientTable, Lanes};
use sonel_scene::Source;

use chains::Chains;
use lattice::ImageLattice;
use tree::{ImageTree, Seed};

/// Images of one source: what a receiver can afford to try in some milliseconds. The hall of the scenes reaches order 4.
const NODE_LIMIT: usize = 200_000;
/// About how many images of one source in an empty box, and what they lose at most in the strongest band [0.01 dB]: the noisy estimator, to which
/// the others are left, owns next to nothing.
const LATTICE_LIMITS: (f64, f64) = (350_000.0, 8000.0);
/// Images of one source when the order was asked for: some hundred megabytes.
const ASKED_NODE_LIMIT: usize = 2_000_000;

/// Sound of one image-source path at a receiver.
#[derive(Debug)]
pub(crate) struct MirrorArrival<'a> {
    /// Path length [m].
    pub length: f64,
    /// Unit direction from the receiver to the image.
    pub towards: DVec3,
    /// Number of reflections; none of direct sound.
    pub order: u32,
    /// Mirrors; none where the images of an empty box are a lattice.
    pub mirrors: Vec<SurfaceId>,
    /// ∏ (1−α)(1−s), and τ of the partitions passed, times the source's directivity factor, per band; without spreading and air.
    pub factor: &'a [Lanes],
    /// Materials of the partitions that it passes, in ascending order.
    pub through: Vec<u32>,
}

/// One image of the origin of a set of image sources.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LatticeImage {
    /// Position relative to the scene's centre [m].
    pub position: DVec3,
    /// −1 for each axis along which the image is inverted.
    pub signs: DVec3,
    /// ∏ (1−α)(1−s), per band.
    pub factor: Vec<Lanes>,
}

/// All image-source paths of one source.
#[derive(Debug)]
pub(crate) enum ImageSources {
    /// Images of an empty box.
    Lattice(ImageLattice),
    /// Images of any geometry.
    Tree(ImageTree),
}

/// Position and directivity of a source.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Radiator<'a> {
    /// Position about the scene's centre [m].
    pub position: DVec3,
    /// Directivity.
    pub directivity: &'a Directivity,
    /// Unit direction of its axis.
    pub aim: DVec3,
}

impl<'a> Radiator<'a> {
    /// `source` in a scene centred at `center`.
    #[must_use]
    pub(crate) fn new(source: &'a Source, center: DVec3) -> Self {
        Self { position: source.position - center, directivity: &source.directivity, aim: source.aim }
    }

    /// Directivity factors in the direction of `offset` [m].
    #[must_use]
    pub(crate) fn towards(&self, offset: DVec3) -> Radiation<'a> {
        self.directivity.towards(self.aim, offset.normalize())
    }

    /// Largest directivity factor in `band`.
    #[must_use]
    pub(crate) fn largest(&self, band: usize) -> f64 {
        match self.directivity {
            Directivity::Pattern(pattern) => pattern.factor(1.0),
            Directivity::Measured { balloon, .. } => balloon.largest(band),
        }
    }
}

/// The room, where it is an empty box whose image sources form a lattice: all angles of incidence are absorbed alike.
#[must_use]
pub(crate) fn lattice_room(geometry: &Geometry, table: &CoefficientTable) -> Option<Shoebox> {
    geometry.as_shoebox().filter(|_| !table.is_angular())
}

impl ImageSources {
    /// Enumerates the image-source paths of a source at `position` (about the scene's centre [m]); `most` limits K below what is affordable. With
    /// other materials they are often the `earlier` ones.
    #[must_use]
    pub(crate) fn enumerate(
        geometry: &Geometry,
        table: &CoefficientTable,
        position: DVec3,
        most: Option<u32>,
        earlier: Option<&Arc<Self>>,
    ) -> Arc<Self> {
        if let Some(room) = lattice_room(geometry, table) {
            let by_loss = || Chains::by_loss(geometry, &room, table, LATTICE_LIMITS);
            let chains = most.map_or_else(by_loss, |order| Chains::by_order(geometry, order));
            return Arc::new(Self::Lattice(ImageLattice::new(geometry, &room, table, position, chains)));
        }
        let budget = if most.is_some() { ASKED_NODE_LIMIT } else { NODE_LIMIT };
        let seed = Seed::new(geometry, table, position, End::Source, budget, most);
        match earlier {
            Some(earlier) if matches!(&**earlier, Self::Tree(tree) if tree.is_of(&seed)) => {
                Arc::clone(earlier)
            }
            _ => Arc::new(Self::Tree(ImageTree::new(geometry, seed))),
        }
    }

    /// Largest cost of the chains that are complete: K, but in a lattice of those that lose little.
    #[must_use]
    pub(crate) fn limit(&self) -> u32 {
        match self {
            Self::Lattice(lattice) => lattice.chains().limit,
            Self::Tree(tree) => tree.order(),
        }
    }

    /// K: image-source paths have at most so many reflections.
    #[must_use]
    pub(crate) fn order(&self) -> u32 {
        match self {
            Self::Lattice(lattice) => lattice.chains().order(),
            Self::Tree(tree) => tree.order(),
        }
    }

    /// Visits the image-source paths of `radiator`, the source, that reach `receiver` (about the scene's centre [m]) within the simulated path length.
    pub(crate) fn visit(
        &self,
        geometry: &Geometry,
        table: &CoefficientTable,
        radiator: Radiator<'_>,
        receiver: DVec3,
        reach: f64,
        mut found: impl FnMut(&MirrorArrival<'_>),
    ) {
        match self {
            Self::Lattice(lattice) => lattice.visit(radiator, receiver, reach, found),
            Self::Tree(tree) => tree.visit(radiator, geometry, table, receiver, |arrival| {
                if arrival.length <= reach {
                    found(arrival);
                }
            }),
        }
    }
}
