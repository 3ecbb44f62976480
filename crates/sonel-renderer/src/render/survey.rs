//! What a part of the sonels of a source tells before anything is rendered: how they are selected, and where they are seen.

use rayon::prelude::*;
use sonel_map::{Along, PathWeight, lanes_of};
use sonel_sampling::{Purpose, StreamFamily};

use super::Renderer;
use crate::disc_size::free_path;
use crate::settings::Estimator;
use crate::stochastic::gather::sonel_sample::{SONELS, Scale, SonelSample};
use crate::stochastic::selection::{Neighbourhoods, Selector, SonelCounts, SonelSelection};

/// Batches of the map for each that is surveyed: four of 32 give the thresholds. Chosen, not measured; doubled, the survey takes half the time
/// from half the sonels.
const BATCHES_PER_SURVEYED: usize = 8;

/// Survey of the sonels of one source.
#[derive(Debug, Clone)]
pub(crate) struct SonelSurvey {
    /// Their selection; none without sonels for a receiver.
    pub selection: Option<SonelSelection>,
    /// Some of them.
    pub sample: SonelSample,
    /// Scale of all sonels, at most the free path of the room; in an open scene without sonels its extent.
    pub scale: Scale,
    /// Sonels by area of the surfaces [1/m²].
    pub density: f64,
}

impl Renderer<'_> {
    /// Surveys the sonels of `source`.
    pub(super) fn make_survey(&self, source: usize) -> SonelSurvey {
        let batches: Vec<u32> =
            (0..self.prepared.emissions.batches.len() as u32).step_by(BATCHES_PER_SURVEYED).collect();
        let vertices = |&batch: &u32| -> usize {
            self.map.batch_paths(source as u32, batch).map(|path| path.vertices.len()).sum()
        };
        let surveyed = batches.par_iter().map(vertices).sum::<usize>() as f64;
        let all = surveyed * self.prepared.emissions.batches.len() as f64 / batches.len() as f64;
        let share = SONELS as f64 / surveyed;
        let surveyed: Vec<_> =
            batches.par_iter().map(|&batch| self.survey_batch(source, batch, share.min(1.0))).collect();
        let (mut counts, mut sample) = self.nothing_surveyed();
        for (its_counts, its_sample) in surveyed {
            counts.add(&its_counts);
            sample.extend(its_sample);
        }
        // Estimators that are asked for by name take every sonel: their sums can be checked number by number.
        let counts = if self.prepared.settings.estimator == Estimator::Auto {
            counts
        } else {
            self.nothing_surveyed().0
        };
        let room = free_path(self.geometry);
        SonelSurvey {
            selection: self.connects_diffuse().then(|| counts.selection()),
            scale: sample
                .scale()
                .map_or(Scale { free_path: room, distance: room }, |scale| scale.in_halves_of(room)),
            sample,
            density: all / self.geometry.area(),
        }
    }

    fn nothing_surveyed(&self) -> (SonelCounts, SonelSample) {
        let (low, high) = self.geometry.bounds();
        let lanes = lanes_of(self.prepared.table.bands());
        let neighbourhoods = Neighbourhoods::new(lanes, self.prepared.bins.reach, high - low);
        (SonelCounts::new(neighbourhoods), SonelSample::new(self.geometry))
    }

    /// Counts the sonels of one batch, and takes a `share` of them, 0 … 1, as a sample.
    fn survey_batch(&self, source: usize, batch: u32, share: f64) -> (SonelCounts, SonelSample) {
        let (mut counts, mut sample) = self.nothing_surveyed();
        let choices = StreamFamily::new(self.seed(), Purpose::SonelChoice, [source as u32, 1, 0, 0]);
        let mut weight = PathWeight::of(&self.prepared.table);
        for path in self.map.batch_paths(source as u32, batch) {
            let mut selector = Selector::new(choices.stream(path.emission).uniform_fine());
            let mut reflected_at = Along::new(0.0);
            self.follow_path(path, source, 1.0, &mut weight, |segment, arriving| {
                reflected_at.enter(segment);
                let Some(arrival) = segment.arrival else { return };
                counts.count(segment.end_length, segment.end, arriving);
                if selector.takes(share) {
                    let free_path = segment.end_length - reflected_at.now;
                    sample.add(self.geometry, segment, arrival, free_path);
                }
                reflected_at.now = segment.end_length;
            });
        }
        (counts, sample)
    }
}
