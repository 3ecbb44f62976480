//! Preparations of a map that are kept between renderings.

use std::sync::{Arc, Mutex, PoisonError};

use sonel_acoustics::{Directivity, Material};
use sonel_geometry::Geometry;
use sonel_map::SonelMap;
use sonel_renderer::{Preparation, RenderError, RenderSettings, Renderer};

/// Preparations that are kept, the last ones used: two, so that designs can be compared. Image sources of a hall take 50 MB.
const KEPT: usize = 2;

/// Preparations of a map, the last used first.
#[derive(Default)]
pub(crate) struct Prepared(Mutex<Vec<(For, Arc<Preparation>)>>);

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

impl Prepared {
    /// A renderer of `map`, whose walls are `geometry`: the map of this cache with its own or other materials and directivities.
    pub(crate) fn renderer<'a>(
        &self,
        map: &'a SonelMap,
        geometry: &'a Geometry,
        settings: &RenderSettings,
    ) -> Result<Renderer<'a>, RenderError> {
        let scene = &map.header().scene;
        let wanted = For {
            settings: settings.clone(),
            materials: scene.materials.clone(),
            directivities: scene.sources.iter().map(|source| source.directivity.clone()).collect(),
        };
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(at) = kept.iter().position(|(made_for, _)| *made_for == wanted) {
            kept[..=at].rotate_right(1);
            return Ok(Renderer::resume(map, geometry, Arc::clone(&kept[0].1)));
        }
        drop(kept);
        let renderer = Renderer::new(map, geometry, settings.clone())?;
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.insert(0, (wanted, renderer.preparation()));
        kept.truncate(KEPT);
        Ok(renderer)
    }
}
