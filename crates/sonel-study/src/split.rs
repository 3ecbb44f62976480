//! Whose variance it is: the sonels', that of those on discs and in spheres, or the visibility rays'.
//!
//! What rays bring is told by hearing the same sonels with other or more rays; what the sonels on areas bring by the inner and outer halves of
//! the areas.

use sonel_analysis::{Parameter, ReceiverFigures, jackknife};

use crate::pilot::Variance;
use crate::spread::{Place, Reading, student_factor};

/// A shift is a bias where it is beyond so many of its standard errors; less is found once in three times where there is none.
const BEYOND_NOISE: f64 = 3.0;

/// The figures of the same sonels, heard twice.
pub(crate) struct HeardTwice<'a> {
    /// Those whose variance is asked for.
    pub figures: &'a [ReceiverFigures],
    /// Those heard otherwise.
    pub others: &'a [ReceiverFigures],
    /// The variance of the difference between the two, over that which rays bring to `figures`.
    pub excess: f64,
    /// Batches.
    pub batches: u32,
}

impl HeardTwice<'_> {
    /// The variance that rays bring to the figure at `place`, in just-noticeable differences.
    fn of_rays(&self, place: Place) -> f64 {
        let figure = |figures: &'_ [ReceiverFigures]| {
            figures[place.row].bands[place.band].figure(place.parameter).as_ref().ok().cloned()
        };
        let (Some(first), Some(second)) = (figure(self.figures), figure(self.others)) else { return 0.0 };
        let difference = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| b - a).collect::<Vec<_>>();
        let without = difference(&first.without, &second.without);
        if without.len() < 2 || without.len() != first.weight.len() {
            return 0.0;
        }
        let sigma = jackknife::spread(second.value - first.value, &without, &first.weight).error.sigma;
        let unit = place.parameter.just_noticeable(first.value);
        (sigma / unit) * (sigma / unit) / self.excess
    }

    /// The share of visibility rays in the variance of `parameter`: over all bands and receivers together, as that of a single figure
    /// scatters too much.
    pub fn share(&self, readings: &[Reading], parameter: Parameter) -> f64 {
        let (mut rays, mut all) = (0.0, 0.0);
        for reading in readings.iter().filter(|reading| reading.place.parameter == parameter) {
            let (Some(_), Ok(width)) = (reading.value, &reading.half_width) else { continue };
            let sigma = width.noise / student_factor(self.batches);
            // What a wild figure says counts as much as what a calm one does.
            if sigma > 0.0 {
                rays += (self.of_rays(reading.place) / (sigma * sigma)).min(1.0);
                all += 1.0;
            }
        }
        if all > 0.0 { rays / all } else { 0.0 }
    }
}

/// The parts of the variance of a figure that was read from `batches` batches and of which visibility rays have `share`.
pub(crate) fn parts(reading: &Reading, batches: u32, share: f64) -> Result<Variance, String> {
    let sigma = reading.half_width.clone()?.noise / student_factor(batches);
    let all = sigma * sigma;
    let rays = share * all;
    let Some(kernel) = reading.kernel else {
        return Ok(Variance { sonels: all - rays, areas: 0.0, rays, bias: 0.0 });
    };
    let areas = (0.25 * kernel.sigma * kernel.sigma).min(all - rays);
    let bias = if kernel.shift.abs() > BEYOND_NOISE * kernel.sigma { kernel.bias() } else { 0.0 };
    Ok(Variance { sonels: all - rays - areas, areas, rays, bias: bias * bias })
}
