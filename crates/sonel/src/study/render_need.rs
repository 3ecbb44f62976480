//! Visibility rays required for a rendering, and packets required where more rays do not help.
//!
//! The packets of a map are given, and so is their part of the variance; rays shrink theirs (see [`crate::study::forecast`]). Where no rays are cast,
//! only packets help.

use sonel_analysis::{Parameter, ReceiverParameters};
use sonel_renderer::{Columns, MOST_RAYS};

use crate::study::effort::Effort;
use crate::study::findings::{Costs, Pilot, Spread, spreads};
use crate::study::forecast::{least_within, two_digits_up};
use crate::study::split::RenderedTwice;
use crate::study::spread::{Place, readings};
use crate::study::target::Targets;

/// Rays of a receiver in a batch at least: fewer leave the strata of their directions empty.
const LEAST_PER_BATCH: u32 = 16;

/// Rays and packets that a rendering needs for its targets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderNeed {
    /// The map's packets, and the rays.
    pub effort: Effort,
    /// Which parameter needs the rays, or lacks the packets; none where the fewest rays will do.
    pub limited_by: Option<Place>,
    /// Packets of a map that keeps the targets with those rays; none where this one does.
    pub lacking: Option<u64>,
}

/// A look at a map: its parameters heard with so many rays.
#[derive(Debug, Clone)]
pub struct Iteration {
    /// Visibility rays of a receiver.
    pub rays: u32,
    /// Result.
    pub parameters: Vec<ReceiverParameters>,
}

impl Pilot {
    /// What two iterations on a map tell of a third, in place of a pilot: the `last` of this `effort` with more rays than `before`,
    /// those of `before` among them. Where no rays are cast one look tells all. Nothing is known of costs.
    #[must_use]
    pub fn of_iterations(
        before: Option<&Iteration>,
        last: &[ReceiverParameters],
        parameters: &[Parameter],
        effort: Effort,
    ) -> Self {
        let found = readings(last, parameters);
        // The later look is a mean of the rays of the earlier and of new ones: its rays' variance is that of the difference over the factor of
        // their numbers less one.
        let twice = before.map(|before| RenderedTwice {
            parameters: last,
            others: &before.parameters,
            excess: f64::from(effort.rays) / f64::from(before.rays) - 1.0,
            batches: effort.batches,
        });
        let share = |parameter| twice.as_ref().map_or(0.0, |twice| twice.share(&found, parameter));
        Self {
            emissions: effort.emissions,
            batches: effort.batches,
            rays: effort.rays,
            casts_rays: twice.is_some(),
            columns: Columns::PLAIN,
            spreads: spreads(&found, effort.emissions, effort.batches, share),
            costs: Costs::default(),
        }
    }

    /// Effort that keeps `targets` in a map of the packets and batches of `map`. Where rays do not matter they are those of `map`.
    #[must_use]
    pub fn render_need(&self, targets: &Targets, map: Effort) -> RenderNeed {
        let rays = if self.casts_rays { LEAST_PER_BATCH * map.batches } else { map.rays };
        let mut render_need = RenderNeed { effort: Effort { rays, ..map }, limited_by: None, lacking: None };
        for spread in &self.spreads {
            let Some(limit) = targets.limit(spread.place, spread.value) else { continue };
            if !self.exceeds(spread, render_need.effort, limit) {
                continue;
            }
            match self.fewest_rays(spread, render_need.effort, limit) {
                Some(rays) => {
                    render_need.effort.rays = rays;
                    render_need.limited_by = Some(spread.place);
                }
                // Rays are not enough.
                None => {
                    let need = self.need(targets, map.batches);
                    let rays = if self.casts_rays { need.effort.rays } else { map.rays };
                    let effort = Effort { rays, ..map };
                    return RenderNeed { effort, lacking: Some(need.effort.emissions), ..need };
                }
            }
        }
        render_need
    }

    /// The fewest rays, in two digits, with which the parameter of `spread` keeps `limit`; none where the most do not.
    fn fewest_rays(&self, spread: &Spread, effort: Effort, limit: f64) -> Option<u32> {
        let exceeds = |rays| self.exceeds(spread, Effort { rays: rays as u32, ..effort }, limit);
        let most = u64::from(MOST_RAYS);
        if !self.casts_rays || exceeds(most) {
            return None;
        }
        let rays = least_within(effort.rays.into(), most, u64::MAX, exceeds);
        Some(two_digits_up(rays).min(most) as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::plan::tests::pilot;
    use crate::study::spread::student_factor;

    const MAP: Effort = Effort { emissions: 10_000, rays: 2500, batches: 32 };

    fn render_need(pilot: &Pilot, limit: f64) -> RenderNeed {
        pilot.render_need(&Targets::just_noticeable(limit), MAP)
    }

    #[test]
    fn rays_are_as_many_as_the_rest_of_the_variance_leaves_room_for() {
        // In units of the squared limit, packets have a half: the other half is met by twice the rays.
        let limit = 0.1_f64;
        let square = (limit / student_factor(32)).powi(2);
        let found = render_need(&pilot(0.5 * square, square), limit);
        assert_eq!((found.effort.rays, found.lacking), (5000, None));
        assert_eq!(found.limited_by.unwrap().parameter, Parameter::T30);
    }

    #[test]
    fn what_rays_cannot_reach_takes_sonels() {
        let found = render_need(&pilot(0.01, 1e-6), 0.1);
        let packets = 10_000.0 * (0.1 * student_factor(32) / 0.1).powi(2);
        assert!((found.lacking.unwrap() as f64 / packets - 1.0).abs() < 0.1, "{found:?}");
        assert_eq!(found.effort.emissions, MAP.emissions);
    }

    #[test]
    fn where_no_rays_are_cast_they_are_left_alone() {
        let found = render_need(&pilot(1e-6, 0.0), 0.1);
        assert_eq!((found.effort, found.limited_by, found.lacking), (MAP, None, None));
        assert_eq!(render_need(&pilot(1.0, 0.0), 0.1).effort.rays, MAP.rays);
    }

    #[test]
    fn easy_targets_take_the_fewest_rays() {
        assert_eq!(render_need(&pilot(1e-9, 1e-9), 1.0).effort.rays, 512);
    }
}
