//! Splits a variance into parts of packets, of sonels in discs and spheres, and of visibility rays.
//!
//! The part of rays follows from rendering the same packets with other or more rays, that of sonels in areas from the inner
//! and outer halves of the areas.

use sonel_analysis::comparison::{Pairing, difference};
use sonel_analysis::estimate::StandardError;
use sonel_analysis::{Parameter, ReceiverParameters};

use crate::study::spread::{NoWidth, ParameterPlace, Reading, student_factor, unit};

/// Squares of standard errors in just-noticeable differences.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Variance {
    /// Part that shrinks with the number of emissions.
    pub packets: f64,
    /// Part that shows in the halves of discs and spheres: their shift can be taken for bias.
    pub areas: f64,
    /// Part that shrinks with the number of visibility rays.
    pub rays: f64,
    /// The square of the bias of discs and spheres.
    pub bias: f64,
}

/// A shift is a bias where it is beyond so many of its standard errors; less is found once in three times where there is none.
const BEYOND_NOISE: f64 = 3.0;

/// The parameters of the same packets, rendered twice.
pub(crate) struct RenderedTwice<'a> {
    /// Parameters whose variance is asked for.
    pub parameters: &'a [ReceiverParameters],
    /// The same parameters, rendered with other rays.
    pub others: &'a [ReceiverParameters],
    /// The variance of the difference between the two, over that which rays bring to `parameters`.
    pub excess: f64,
    /// Batches.
    pub batches: u32,
}

impl RenderedTwice<'_> {
    /// The variance that rays bring to the parameter at `place`, in just-noticeable differences.
    fn of_rays(&self, place: ParameterPlace) -> f64 {
        let [first, second] = [self.parameters, self.others]
            .map(|parameters| parameters[place.row].bands[place.band].parameter(place.parameter));
        let error = difference(first, second, Pairing::Batches).ok().and_then(|difference| difference.error);
        let (Ok(first), Some(StandardError { sigma, .. })) = (first, error) else { return 0.0 };
        let unit = unit(place.parameter, first.value);
        (sigma / unit) * (sigma / unit) / self.excess
    }

    /// The share of visibility rays in the variance of `parameter`: over all bands and receivers together, as that of a single parameter
    /// scatters too much.
    pub(crate) fn share(&self, readings: &[Reading], parameter: Parameter) -> f64 {
        let (mut rays, mut all) = (0.0, 0.0);
        for reading in readings.iter().filter(|reading| reading.place.parameter == parameter) {
            let (Some(_), Ok(width)) = (reading.value, &reading.half_width) else { continue };
            let sigma = width.noise / student_factor(self.batches);
            // What a wild parameter says counts as much as what a calm one does.
            if sigma > 0.0 {
                rays += (self.of_rays(reading.place) / (sigma * sigma)).min(1.0);
                all += 1.0;
            }
        }
        if all > 0.0 { rays / all } else { 0.0 }
    }
}

/// The parts of the variance of a parameter that was read from `batches` batches and of which visibility rays have `share`.
pub(crate) fn parts(reading: &Reading, batches: u32, share: f64) -> Result<Variance, NoWidth> {
    let sigma = reading.half_width.clone()?.noise / student_factor(batches);
    let all = sigma * sigma;
    let rays = share * all;
    let Some(kernel) = reading.kernel else {
        return Ok(Variance { packets: all - rays, areas: 0.0, rays, bias: 0.0 });
    };
    let areas = (0.25 * kernel.sigma * kernel.sigma).min(all - rays);
    let bias = if kernel.shift.abs() > BEYOND_NOISE * kernel.sigma { kernel.bias() } else { 0.0 };
    Ok(Variance { packets: all - rays - areas, areas, rays, bias: bias * bias })
}
