//! Where, when and in which bands two sonel maps differ beyond noise.
//!
//! Compared is the energy that arrives at surfaces per unit energy emitted, without air (which is applied when a map is
//! rendered), as a distribution: in cells of source, place, band and window of time. Places are the room, each material and
//! each surface, so that a small change everywhere is found in the room and a change of one panel at that panel. Bands
//! that no coefficient tells apart are one.
//!
//! **Windows.** Six, at 1/16, 1/8, 1/4, 1/2, 3/4 and 1 of the shorter duration. The early ones double: first reflections
//! differ before anything has mixed. Behind the half a doubling would span 30 dB of decay, of which only the beginning
//! would count, so quarters follow.
//!
//! **Test.** Each cell has an estimate per batch; the difference of the weighted means is tested by Student's t, with the
//! error from the spread of the batches. Maps with the same seed and numbering of emissions share random numbers: their
//! batches are compared pairwise, which takes out what is common. Otherwise the maps are independent and Welch's t is used.
//! Maps of one seed but other numberings share some paths: taken for independent, differences may go unnoticed, but none
//! is invented. The level is 1 % for the whole comparison, a third for each kind of place, divided by the number of its
//! cells (Bonferroni): it holds whatever the dependence between cells, and bands share their paths.
//!
//! **Sparse cells** are not tested: few arrivals are not normally distributed, and where the maps differ in size a lack
//! of rare arrivals in the smaller one looks like certainty. Needed are [`FEWEST_ARRIVALS`] in either map, counted as
//! (Σe)² / Σe² over both and shared out by their packets, so that a surface which nothing reaches any more is still found.
//! Where packets are weighed in another way (survival, separate bands) that is no guide, and each map has to have them
//! itself. The arrivals of sparse cells still count for their material and for the room.
//!
//! References: docs/physics.md §2; [Busing1999], [Kish1965] (docs/references.md).

mod cell;
mod counterparts;
mod estimation;
mod incidence;
mod moments;
mod significance;

use sonel_geometry::Geometry;
use sonel_map::{SonelMap, Spectral, provenance};
use thiserror::Error;

use self::counterparts::{Places, band_groups, common_sources, unmatched};
use self::estimation::Frame;
use self::significance::test_cells;
use crate::reading::Reading;

/// Effective number of arrivals below which a cell is not tested: the skewness of its mean is then below 0.03.
pub const FEWEST_ARRIVALS: f64 = 1000.0;
/// Ends of the windows as shares of the duration, early ones finer. Chosen, not measured; twice as many have a smaller level each.
const WINDOW_ENDS: [f64; 6] = [0.0625, 0.125, 0.25, 0.5, 0.75, 1.0];

/// A map ready to be compared.
#[derive(Clone, Copy)]
pub struct Traced<'a> {
    /// A map whose paths are sound ([`SonelMap::check_paths`]).
    pub map: &'a SonelMap,
    /// The walls of its scene.
    pub geometry: &'a Geometry,
}

/// Place where energy arrives.
#[derive(Debug, Clone, PartialEq)]
pub enum ArrivalPlace {
    /// All surfaces.
    Room,
    /// All surfaces of the material of this name.
    Material(String),
    /// One surface.
    Surface {
        /// Number in A.
        in_a: u32,
        /// Number in B.
        in_b: u32,
        /// Name of its material in A.
        material: String,
        /// Area of one side [m²].
        area: f64,
    },
}

/// Kinds of places, the coarsest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaceKind {
    /// The room.
    Room,
    /// Materials.
    Material,
    /// Surfaces.
    Surface,
}

impl ArrivalPlace {
    fn kind(&self) -> PlaceKind {
        match self {
            Self::Room => PlaceKind::Room,
            Self::Material(_) => PlaceKind::Material,
            Self::Surface { .. } => PlaceKind::Surface,
        }
    }
}

/// One cell that was tested.
#[derive(Debug, Clone, PartialEq)]
pub struct CellDifference {
    /// Name of the source.
    pub source: String,
    /// Place.
    pub place: ArrivalPlace,
    /// Nominal centres of the bands, which nothing tells apart [Hz].
    pub center_frequencies_hz: Vec<f64>,
    /// Window of time since emission [s].
    pub window: [f64; 2],
    /// Incident energy in A and in B per unit emitted energy [1].
    pub incident: [f64; 2],
    /// Standard error of B − A [1].
    pub sigma: f64,
    /// Degrees of freedom of the error.
    pub freedom: u32,
    /// B over A [dB]; none where either is zero.
    pub ratio_db: Option<f64>,
    /// 95 % interval of the ratio, for this cell alone [dB].
    pub interval_db: Option<[f64; 2]>,
    /// Effective number of arrivals in A and in B.
    pub arrivals: [f64; 2],
    /// Smallest |B − A| that counts as a difference [1].
    pub critical: f64,
    /// Whether B − A is beyond noise.
    pub differs: bool,
}

impl CellDifference {
    /// |B − A| in units of what counts as a difference; infinite for a difference without noise.
    #[must_use]
    pub fn significance(&self) -> f64 {
        let difference = (self.incident[1] - self.incident[0]).abs();
        if self.critical > 0.0 {
            difference / self.critical
        } else if difference > 0.0 {
            f64::INFINITY
        } else {
            0.0
        }
    }
}

/// The cells of one kind of places.
#[derive(Debug, Clone, PartialEq)]
pub struct Tier {
    /// Places.
    pub kind: PlaceKind,
    /// Cells tested, by source, place, window and band.
    pub cells: Vec<CellDifference>,
    /// Cells with too few arrivals.
    pub sparse: usize,
    /// Largest part of a source's incident energy in a band that is in sparse cells, 0 … 1.
    pub sparse_energy: f64,
    /// Level at which each cell is tested.
    pub level: f64,
}

/// Relation of the noise of two maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapPairing {
    /// Same random numbers, compared batch by batch.
    Batches,
    /// Same seed but another numbering of emissions: taken for independent.
    SameSeed,
    /// Other seeds.
    Independent,
}

/// Comparison of two maps.
#[derive(Debug, Clone, PartialEq)]
pub struct MapComparison {
    /// Room, materials, surfaces.
    pub tiers: Vec<Tier>,
    /// Treatment of noise.
    pub pairing: MapPairing,
    /// Parts that could not be compared, a sentence each.
    pub without_counterpart: Vec<String>,
}

impl MapComparison {
    /// Cells beyond noise, the most significant first.
    #[must_use]
    pub fn beyond_noise(&self) -> Vec<&CellDifference> {
        let cells = self.tiers.iter().flat_map(|tier| &tier.cells);
        let mut beyond: Vec<&CellDifference> = cells.filter(|cell| cell.differs).collect();
        beyond.sort_by(|a, b| b.significance().total_cmp(&a.significance()));
        beyond
    }
}

/// Why two maps cannot be compared.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum Incomparable {
    /// No source of one name.
    #[error("the maps have no source in common: A has {a}, B has {b}; give the sources the same names")]
    Sources {
        /// Names in A.
        a: String,
        /// Names in B.
        b: String,
    },
    /// No band of one centre.
    #[error("the maps have no band in common")]
    Bands,
    /// No spread.
    #[error(
        "map {map} holds fewer than two batches with emissions: trace it with `batches` 2 or more, better 32"
    )]
    Batches {
        /// A or B.
        map: char,
    },
    /// Nothing can be said.
    #[error(
        "every cell has fewer than {FEWEST_ARRIVALS} arrivals in one of the maps: trace both with more packets"
    )]
    Sparse,
}

/// Compares two maps.
///
/// Walks both on all cores. Memory is that of the cells of the scene for 32 batches of each map, whatever their length; the
/// result does not depend on the number of threads.
///
/// # Errors
/// [`Incomparable`] where the maps have nothing in common that can be tested.
pub fn compare(a: Traced<'_>, b: Traced<'_>) -> Result<MapComparison, Incomparable> {
    let bands = band_groups(a.map, b.map);
    if bands.is_empty() {
        return Err(Incomparable::Bands);
    }
    let sources = common_sources(&a, &b)?;
    let places = Places::new(&a, &b);
    let duration = a.map.header().scene.duration.min(b.map.header().scene.duration);
    let frame = Frame {
        readings: [Reading::new(a.map, a.geometry), Reading::new(b.map, b.geometry)],
        pairing: pairing(&a, &b),
        alike: weigh_alike(&a, &b),
        window_ends: WINDOW_ENDS.map(|part| part * duration).to_vec(),
        bands,
        places,
    };
    let mut found = Vec::new();
    for numbers in sources {
        found.push((a.map.header().scene.sources[numbers[0] as usize].name.clone(), frame.cells(numbers)?));
    }
    let tiers = [PlaceKind::Room, PlaceKind::Material, PlaceKind::Surface]
        .map(|kind| test_cells(kind, &frame, &found))
        .to_vec();
    if tiers.iter().all(|tier| tier.cells.is_empty()) {
        return Err(Incomparable::Sparse);
    }
    Ok(MapComparison { tiers, pairing: frame.pairing, without_counterpart: unmatched(&a, &b, &frame.places) })
}

/// What was changed between the maps in program, settings, scene and shard.
#[must_use]
pub fn changes(a: &SonelMap, b: &SonelMap) -> Vec<provenance::Difference> {
    let mut found = provenance::differences(a.header(), b.header());
    let shard = |map: &SonelMap| format!("{} of {}", map.header().shard.index, map.header().shard.count);
    if a.header().shard != b.header().shard {
        found.push(provenance::Difference { what: "shard".to_owned(), here: shard(a), there: shard(b) });
    }
    found
}

fn pairing(a: &Traced<'_>, b: &Traced<'_>) -> MapPairing {
    let (ours, theirs) = (a.map.header(), b.map.header());
    if ours.settings.seed != theirs.settings.seed {
        return MapPairing::Independent;
    }
    let same_numbers = a.map.layout() == b.map.layout()
        && ours.settings.spectral == theirs.settings.spectral
        && ours.shard == theirs.shard
        && ours.scene.bands == theirs.scene.bands;
    if same_numbers { MapPairing::Batches } else { MapPairing::SameSeed }
}

fn weigh_alike(a: &Traced<'_>, b: &Traced<'_>) -> bool {
    let of = |side: &Traced<'_>| {
        let settings = side.map.header().settings;
        (settings.survival.to_bits(), settings.spectral == Spectral::PerBand)
    };
    of(a) == of(b)
}
