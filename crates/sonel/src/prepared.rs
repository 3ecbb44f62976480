//! Designs and preparations of a map that are kept between renderings.

use std::sync::{Arc, Mutex, PoisonError};

use sonel_acoustics::{Directivity, Material};
use sonel_geometry::Geometry;
use sonel_map::SonelMap;
use sonel_renderer::{BatchSums, Preparation, ReceiverPoint, RenderError, RenderSettings, Renderer};
use sonel_scene::Source;

use crate::Result;

/// Preparations and designs that are kept, the last ones used: two, so that designs can be compared. Image sources of a hall take 50 MB.
const KEPT: usize = 2;

/// Values by what they were made for, the last used first.
type Kept<K, V> = Mutex<Vec<(K, V)>>;

/// The value that is kept for `wanted`, as the last one used.
fn kept<K: PartialEq, V: Clone>(kept: &Kept<K, V>, wanted: &K) -> Option<V> {
    let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
    let at = kept.iter().position(|(made_for, _)| made_for == wanted)?;
    kept[..=at].rotate_right(1);
    Some(kept[0].1.clone())
}

fn last<K, V: Clone>(kept: &Kept<K, V>) -> Option<V> {
    kept.lock().unwrap_or_else(PoisonError::into_inner).first().map(|(_, value)| value.clone())
}

fn keep<K: PartialEq, V>(kept: &Kept<K, V>, made_for: K, made: V) {
    let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
    kept.retain(|(earlier, _)| *earlier != made_for);
    kept.insert(0, (made_for, made));
    kept.truncate(KEPT);
}

/// Preparations, designs and unfinished renderings of a map.
#[derive(Default)]
pub(crate) struct Prepared {
    preparations: Kept<For, Arc<Preparation>>,
    /// Sums over so many first batches at some receivers.
    sums: Kept<(For, Vec<ReceiverPoint>), (u32, Vec<BatchSums>)>,
    designs: Kept<(Vec<Material>, Vec<Source>), Design>,
}

/// A map with other materials or directivities, which its paths carry.
#[derive(Clone)]
pub(crate) struct Design {
    /// The map; it shares its paths.
    pub map: SonelMap,
    /// Its walls.
    pub geometry: Arc<Geometry>,
    /// The first batches, whose paths carry it.
    pub batches: u32,
    /// Why intervals are wider than those of another trace.
    pub warnings: Vec<String>,
}

impl std::fmt::Debug for Prepared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Prepared").finish_non_exhaustive()
    }
}

/// Key of a preparation: everything in which renderings of one map differ but receivers and batches.
#[derive(PartialEq)]
struct For {
    settings: RenderSettings,
    materials: Vec<Material>,
    directivities: Vec<Directivity>,
}

impl For {
    fn rendering(map: &SonelMap, settings: &RenderSettings) -> Self {
        let scene = &map.header().scene;
        Self {
            settings: settings.clone(),
            materials: scene.materials.clone(),
            directivities: scene.sources.iter().map(|source| source.directivity.clone()).collect(),
        }
    }
}

impl Prepared {
    /// Sums of an earlier rendering of the same receivers with at most `batches` batches.
    pub(crate) fn sums(
        &self,
        map: &SonelMap,
        settings: &RenderSettings,
        receivers: &[ReceiverPoint],
        batches: u32,
    ) -> Option<Vec<BatchSums>> {
        let wanted = (For::rendering(map, settings), receivers.to_vec());
        kept(&self.sums, &wanted).filter(|&(kept, _)| kept <= batches).map(|(_, sums)| sums)
    }

    /// Keeps `sums` over the first `batches` for [`Self::sums`].
    pub(crate) fn keep_sums(
        &self,
        map: &SonelMap,
        settings: &RenderSettings,
        receivers: &[ReceiverPoint],
        batches: u32,
        sums: &[BatchSums],
    ) {
        keep(&self.sums, (For::rendering(map, settings), receivers.to_vec()), (batches, sums.to_vec()));
    }

    /// A renderer of `map`, whose walls are `geometry`: the map of this cache with its own or other materials and directivities.
    pub(crate) fn renderer<'a>(
        &self,
        map: &'a SonelMap,
        geometry: &'a Geometry,
        settings: &RenderSettings,
    ) -> std::result::Result<Renderer<'a>, RenderError> {
        let wanted = For::rendering(map, settings);
        if let Some(preparation) = kept(&self.preparations, &wanted) {
            return Ok(Renderer::resume(map, geometry, preparation));
        }
        let renderer = Renderer::new(map, geometry, settings.clone())?.after(last(&self.preparations));
        keep(&self.preparations, wanted, renderer.preparation());
        Ok(renderer)
    }

    /// The design with `materials` and `sources`, which the paths of `batches` carry; `make` makes it where it is not kept.
    pub(crate) fn design(
        &self,
        materials: Vec<Material>,
        sources: Vec<Source>,
        batches: u32,
        make: impl FnOnce(Vec<Material>, Vec<Source>) -> Result<Design>,
    ) -> Result<Design> {
        let wanted = (materials, sources);
        if let Some(design) = kept(&self.designs, &wanted).filter(|kept| kept.batches >= batches) {
            return Ok(design);
        }
        let made = make(wanted.0.clone(), wanted.1.clone())?;
        keep(&self.designs, wanted, made.clone());
        Ok(made)
    }
}
