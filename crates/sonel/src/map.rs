//! Maps: where sound went in a room.

use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use sonel_geometry::Geometry;

use crate::Result;
use crate::error::At;
use crate::prepared::Prepared;

pub use sonel_map::provenance::Difference;
pub use sonel_map::{
    EffectState, Fate, Fates, Ledger, MapError, MapHeader, Merger, Mode, Settings, ShardRange, SonelMap,
    Spectral, hexadecimal,
};

/// A sonel map: the paths of packets through a room, from which echograms at any receivers are rendered. It carries its scene.
///
/// A map in a file is mapped into memory and may be larger than it. Several threads may render one map at once. Its walls, image sources and
/// tables are made ready by the first rendering and kept: another receiver costs only its own part.
#[derive(Debug)]
pub struct Map {
    map: SonelMap,
    /// Name in messages.
    label: String,
    geometry: OnceLock<Arc<Geometry>>,
    /// Set when every path has been checked.
    checked: OnceLock<()>,
    /// Preparations for renderings.
    prepared: Prepared,
}

impl Map {
    pub(crate) fn of(map: SonelMap, label: String) -> Self {
        Self {
            map,
            label,
            geometry: OnceLock::new(),
            checked: OnceLock::new(),
            prepared: Prepared::default(),
        }
    }

    /// A map that was traced within walls of its scene.
    pub(crate) fn within(map: SonelMap, label: String, walls: Arc<Geometry>) -> Self {
        Self { geometry: walls.into(), ..Self::of(map, label) }
    }

    /// Opens the map in a file of `sonel-trace` or [`Self::save`].
    ///
    /// # Errors
    /// When the file cannot be read, is no map, or is damaged in its header. Paths are checked when they are used.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let label = path.as_ref().display().to_string();
        let file = crate::file::open(path.as_ref()).at(|| format!("cannot read the map {label}"))?;
        Self::from_file(&file, label)
    }

    /// Opens the map in `file`, which messages call `label`.
    ///
    /// # Errors
    /// When the file is no map, or is damaged in its header.
    pub fn from_file(file: &File, label: String) -> Result<Self> {
        Ok(Self::of(SonelMap::open(file).at(|| label.clone())?, label))
    }

    /// Writes the map to a file, which appears when it is complete and replaces an older one.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<()> {
        crate::file::write(path.as_ref(), |out| Ok(out.write_all(self.map.bytes())?))
    }

    /// The map as the stages see it.
    #[must_use]
    pub fn sonels(&self) -> &SonelMap {
        &self.map
    }

    /// Name in messages.
    #[must_use]
    pub fn label(&self) -> &str {
        &self.label
    }

    pub(crate) fn prepared(&self) -> &Prepared {
        &self.prepared
    }

    /// The walls of its scene, made by the first call.
    ///
    /// # Errors
    /// When they cannot be used.
    pub fn walls(&self) -> Result<Arc<Geometry>> {
        if let Some(geometry) = self.geometry.get() {
            return Ok(Arc::clone(geometry));
        }
        let made = self.map.header().scene.geometry();
        let made = Arc::new(made.at(|| format!("{}: the walls cannot be used", self.label))?);
        Ok(Arc::clone(self.geometry.get_or_init(|| made)))
    }

    /// Checks every path against its checksum and the walls, once.
    ///
    /// # Errors
    /// The first damage.
    pub fn check(&self) -> Result<()> {
        if self.checked.get().is_some() {
            return Ok(());
        }
        let (named, geometry) = (|| self.label.clone(), self.walls()?);
        self.map.check_surfaces(&geometry).at(named)?;
        self.map.check_paths(geometry.surfaces().len() as u32).at(named)?;
        self.checked.get_or_init(|| ());
        Ok(())
    }

    /// Identity of the map: BLAKE3 of its header, which holds the digests of everything else, in hexadecimal digits.
    #[must_use]
    pub fn digest(&self) -> String {
        sonel_map::hexadecimal(&self.map.digest())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use crate::{Change, Material, RenderOptions, Scene, Silent, TraceOptions, Variants};

    #[test]
    fn renderings_of_a_map_share_its_walls() {
        let scene = Scene::shoebox([4.0, 3.0, 2.5])
            .material("walls", Material::new(0.3))
            .source("source", [1.0, 1.0, 1.0])
            .receiver("receiver", [3.0, 2.0, 1.2])
            .duration(0.1)
            .build(&Silent)
            .expect("a valid scene");
        let variants = vec![Variants::parse("materials.walls.transmission", "0.1").expect("a variant")];
        let options = TraceOptions { packets: Some(200), variants, ..TraceOptions::default() };
        let map = scene.trace(&options, &Silent).expect("a map").map;
        let before = map.walls().expect("walls");
        let set = vec![Change::of("materials.walls.absorption", 0.4.into()).expect("a change")];
        for set in [Vec::new(), set] {
            let options = RenderOptions { set, rays: Some(64), ..RenderOptions::default() };
            let prepared = map.prepare(&[], &options, &Silent).expect("a valid map");
            assert!(Arc::ptr_eq(&prepared.geometry, &before));
        }
        let unknown = RenderOptions { variant: Some("felt".to_owned()), ..RenderOptions::default() };
        let error = map.prepare(&[], &unknown, &Silent).err().expect("no such variant").to_string();
        assert!(error.contains("no variant \"felt\""), "{error}");
        // What lets sound through is a partition: the walls are others.
        let set = vec![Change::of("materials.walls.transmission", 0.1.into()).expect("a change")];
        let options = RenderOptions { set, rays: Some(64), ..RenderOptions::default() };
        let prepared = map.prepare(&[], &options, &Silent).expect("a map of variants");
        assert!(!Arc::ptr_eq(&prepared.geometry, &before));
    }
}
