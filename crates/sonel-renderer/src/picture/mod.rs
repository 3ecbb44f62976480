//! Energy on the surfaces that a camera sees: density estimation over the sonels around what each pixel shows.
//!
//! With e_i the incident energy of sonel i, m the attenuation by air and l_i its path length, a pixel that shows a point of a surface has
//!
//!   E = Σ e_i e^(−m l_i) / A
//!
//! over the sonels on the same surface and side within h of the point, where A is the area of the disc clipped to the surface, as for
//! visibility rays (`stochastic::gather`). E is the time integral of the irradiance over a window, per unit emitted energy [1/m²]. Its bias is
//! O(h²). First arrivals are sonels, so direct sound is included; energy behind edges is not.
//!
//! The map streams past once: chunks are read side by side, and every tile of the picture takes their sonels in the order of the file.
//!
//! References: [Jensen1996], docs/physics.md §4.

pub mod camera;
mod tile;
pub mod windows;

use glam::DVec2;
use rayon::prelude::*;
use sonel_geometry::{Hit, Side};
use sonel_map::{Lanes, PathWeight};

pub use camera::{Camera, CameraError};
pub use windows::{WindowError, Windows};

use crate::disc_size::{DISC_PER_FREE_PATH, disc_radius};
use crate::error::RenderError;
use crate::render::Renderer;
use crate::stochastic::gather::disc::Sheet;
use crate::stochastic::gather::disc::place;
use tile::Tile;

/// Chunks read before tiles take their sonels: bounds the memory, whatever the number of threads.
const CHUNKS_IN_FLIGHT: usize = 16;
/// Pixels of a tile, about. Speed and memory alone depend on it.
const TILE_PIXELS: u32 = 16_384;
/// Most values of a picture: 3 GB while it is made.
const MOST_VALUES: u64 = 1 << 28;

/// Energy on surfaces as a camera sees it. Pixels are in rows from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Hit of each pixel; [`None`] where no surface is.
    pub seen: Vec<Option<Hit>>,
    /// By window of time.
    pub windows: Vec<WindowPicture>,
    /// Radius of the discs [m].
    pub radius: f64,
}

/// The energy of one window of time.
#[derive(Debug, Clone, PartialEq)]
pub struct WindowPicture {
    /// By band and pixel: incident energy per area and unit emitted energy [1/m²]; zero where no surface is.
    pub energy: Vec<Vec<f32>>,
    /// By pixel: relative standard error of the sum over bands, from the number and the energies of its sonels [1]; infinite where none
    /// was found, zero where no surface is. Even first directions make the true one smaller for first arrivals.
    pub relative_error: Vec<f32>,
}

/// Sonels on the surfaces seen.
#[derive(Default)]
struct Arrivals {
    sonels: Vec<PicturedSonel>,
    /// Energy of each, per class of bands.
    energy: Vec<Lanes>,
}

/// A sonel on a surface that is seen.
struct PicturedSonel {
    place: u32,
    window: u32,
    /// In the plane of its surface [m].
    at: DVec2,
}

impl Renderer<'_> {
    /// The energy that `source` sends to what `camera` sees, in `windows` of time. `progress` receives the share of the work done so far.
    ///
    /// # Errors
    /// When the picture has too many values.
    pub fn picture(
        &self,
        source: usize,
        camera: &Camera,
        windows: &Windows,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Picture, RenderError> {
        let scene = &self.map.header().scene;
        let [width, height] = camera.size();
        let values =
            u64::from(width) * u64::from(height) * windows.count() as u64 * scene.bands.count() as u64;
        if values > MOST_VALUES {
            return Err(RenderError::Settings(format!(
                "a picture of {width}x{height} pixels with {} windows and {} bands has {values} values, at most \
                 {MOST_VALUES} are possible: give a smaller `size` or fewer `windows`",
                windows.count(),
                scene.bands.count()
            )));
        }
        let sheets = Sheet::all(self.geometry);
        let free_path = self.survey(source).scale.free_path;
        let radius =
            disc_radius(DISC_PER_FREE_PATH, free_path, &self.prepared.settings, &self.map.header().settings);
        let rows = (TILE_PIXELS / width).max(1);
        let mut tiles: Vec<Tile> = (0..height.div_ceil(rows))
            .into_par_iter()
            .map(|tile| {
                let rows = tile * rows..((tile + 1) * rows).min(height);
                Tile::new(self, camera, rows, &sheets, radius, windows.count())
            })
            .collect();
        let mut is_seen = vec![false; 2 * self.geometry.surfaces().len()];
        for hit in tiles.iter().flat_map(|tile| tile.seen.iter().flatten()) {
            is_seen[place(hit.surface, hit.side) as usize] = true;
        }
        let chunks: Vec<(u32, u64)> = self.map.chunks().filter(|chunk| chunk.0 == source as u32).collect();
        for (done, group) in (0..).step_by(CHUNKS_IN_FLIGHT).zip(chunks.chunks(CHUNKS_IN_FLIGHT)) {
            progress(f64::from(done) / chunks.len() as f64);
            let arrivals = |&chunk: &(u32, u64)| self.arrivals(chunk, &sheets, &is_seen, windows);
            let parts: Vec<Arrivals> = group.par_iter().map(arrivals).collect();
            tiles.par_iter_mut().for_each(|tile| parts.iter().for_each(|part| tile.gather(part)));
        }
        progress(1.0);
        Ok(self.assemble(tiles, windows.count(), radius))
    }

    /// The sonels of a chunk on the surfaces seen, within the windows.
    fn arrivals(&self, chunk: (u32, u64), sheets: &[Sheet], is_seen: &[bool], windows: &Windows) -> Arrivals {
        let mut weight = PathWeight::of(&self.prepared.table);
        let mut found = Arrivals::default();
        for path in self.map.chunk_paths(chunk) {
            let unit = self.prepared.emissions.share(path.emission);
            self.follow_path(path, chunk.0 as usize, unit, &mut weight, |segment, arriving| {
                let Some(arrival) = segment.arrival else { return };
                let place = place(arrival.surface, arrival.side);
                let within = self.prepared.bins.bin(segment.end_length).filter(|_| is_seen[place as usize]);
                let Some(window) = within.and_then(|_| windows.of(segment.end_length)) else { return };
                let at = sheets[arrival.surface.0 as usize].flat(segment.end.as_dvec3());
                found.sonels.push(PicturedSonel { place, window, at });
                let first = found.energy.len();
                found.energy.extend_from_slice(arriving);
                self.prepared.carried_air.attenuate(segment.end_length, &mut found.energy[first..]);
            });
        }
        found
    }

    /// The tiles as one picture, with every band for itself.
    fn assemble(&self, tiles: Vec<Tile>, windows: usize, radius: f64) -> Picture {
        let bands = self.prepared.classes.bands();
        let nothing = || WindowPicture { energy: vec![Vec::new(); bands], relative_error: Vec::new() };
        let mut picture =
            Picture { seen: Vec::new(), windows: (0..windows).map(|_| nothing()).collect(), radius };
        for tile in tiles {
            for (number, window) in picture.windows.iter_mut().enumerate() {
                for (band, energy) in window.energy.iter_mut().enumerate() {
                    energy.extend(tile.energies(number, self.prepared.classes.of(band)));
                }
                window.relative_error.extend(tile.relative_errors(number));
            }
            picture.seen.extend(tile.seen);
        }
        picture
    }
}

impl Picture {
    /// Share of the pixels that show a surface from the front, from behind, and none.
    #[must_use]
    pub fn shares(&self) -> [f64; 3] {
        let share = |side: Option<Side>| {
            let count = self.seen.iter().filter(|seen| seen.map(|hit| hit.side) == side).count();
            count as f64 / self.seen.len() as f64
        };
        [share(Some(Side::Front)), share(Some(Side::Back)), share(None)]
    }
}
