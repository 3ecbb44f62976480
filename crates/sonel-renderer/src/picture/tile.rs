//! Rows of a picture: the discs of their pixels, and the energy gathered in them.

use std::ops::Range;

use sonel_geometry::Hit;
use sonel_map::{BandValues, Lanes, lanes_of};

use super::{Arrivals, Camera};
use crate::render::Renderer;
use crate::stochastic::gather::GatherIndex;
use crate::stochastic::gather::disc::{Disc, Sheet};

/// The disc about what a pixel shows.
struct PixelDisc {
    disc: Disc,
    /// Number of the pixel in its tile.
    pixel: usize,
}

impl AsRef<Disc> for PixelDisc {
    fn as_ref(&self) -> &Disc {
        &self.disc
    }
}

/// Rows of a picture.
pub(super) struct Tile {
    /// Hit of each pixel.
    pub seen: Vec<Option<Hit>>,
    index: GatherIndex<PixelDisc>,
    windows: usize,
    lanes: usize,
    /// Bands that each class stands for.
    bands: Vec<Lanes>,
    /// Σ e / A by pixel, window and class of bands [1/m²].
    energy: Vec<Lanes>,
    /// Σ (e / A)², e the sum over bands, by pixel and window [1/m⁴].
    squared: Vec<f64>,
}

impl Tile {
    /// Looks at the pixels in `rows` of the picture.
    pub(super) fn new(
        renderer: &Renderer<'_>,
        camera: &Camera,
        rows: Range<u32>,
        sheets: &[Sheet],
        radius: f64,
        windows: usize,
    ) -> Self {
        let columns = camera.size()[0];
        let pixels = rows.flat_map(|row| (0..columns).map(move |column| (column, row)));
        let seen: Vec<Option<Hit>> =
            pixels.map(|(column, row)| camera.sees(renderer.geometry, column, row)).collect();
        let disc = |(pixel, hit): (usize, &Option<Hit>)| {
            let hit = hit.as_ref()?;
            let disc = sheets[hit.surface.0 as usize].disc(renderer.geometry, hit, radius);
            Some(PixelDisc { disc, pixel })
        };
        let discs = seen.iter().enumerate().filter_map(disc).collect();
        let lanes = lanes_of(renderer.prepared.table.bands());
        let mut bands = vec![Lanes::ZERO; lanes];
        for band in 0..renderer.prepared.classes.bands() {
            *bands.band_mut(renderer.prepared.classes.of(band)) += 1.0;
        }
        Self {
            index: GatherIndex::new(discs),
            windows,
            lanes,
            bands,
            energy: vec![Lanes::ZERO; seen.len() * windows * lanes],
            squared: vec![0.0; seen.len() * windows],
            seen,
        }
    }

    /// Adds sonels to the discs that they lie in.
    pub(super) fn gather(&mut self, arrivals: &Arrivals) {
        let (windows, lanes) = (self.windows, self.lanes);
        let mut discs = Vec::new();
        for (sonel, energy) in arrivals.sonels.iter().zip(arrivals.energy.chunks_exact(lanes)) {
            let of_all = self.of_all(energy);
            let (sums, squared) = (&mut self.energy, &mut self.squared);
            self.index.around(sonel.place, sonel.at, &mut discs);
            for (number, _) in &discs {
                let found = self.index.point(*number);
                let per_area = found.disc.view.area.recip();
                let cell = found.pixel * windows + sonel.window as usize;
                sums[cell * lanes..].add_times(energy, per_area);
                squared[cell] += (of_all * per_area) * (of_all * per_area);
            }
        }
    }

    /// The energy of a `class` of bands in a `window`, by pixel [1/m²].
    pub(super) fn energies(&self, window: usize, class: usize) -> impl Iterator<Item = f32> {
        (0..self.seen.len()).map(move |pixel| {
            let cell = (pixel * self.windows + window) * self.lanes;
            self.energy[cell..].band(class) as f32
        })
    }

    /// Relative standard error of the sum over bands in a `window`, by pixel.
    pub(super) fn relative_errors(&self, window: usize) -> impl Iterator<Item = f32> {
        self.seen.iter().enumerate().map(move |(pixel, seen)| {
            let cell = pixel * self.windows + window;
            let energy = &self.energy[cell * self.lanes..][..self.lanes];
            let sum = self.of_all(energy);
            match seen {
                None => 0.0,
                Some(_) if sum > 0.0 => (self.squared[cell].sqrt() / sum) as f32,
                Some(_) => f32::INFINITY,
            }
        })
    }

    /// `energy` summed over all bands.
    fn of_all(&self, energy: &[Lanes]) -> f64 {
        energy.iter().zip(&self.bands).map(|(&energy, &bands)| (energy * bands).sum()).sum()
    }
}
