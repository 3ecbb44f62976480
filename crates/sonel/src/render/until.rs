//! `until`: takes more batches, then more rays, until the targets are met, else states the rays or packets required.

use serde_json::{Value, json};
use sonel_analysis::ReceiverParameters;
use sonel_map::Settings;
use sonel_renderer::{MOST_RAYS, RenderSettings};

use crate::Result;
use crate::plan::extension;
use crate::render::refinement::steps;
use crate::study::forecast::{Effort, Need, Pilot};
use crate::study::job::{Job, RenderedMap};
use crate::study::plan::Names;
use crate::study::target::Targets;
use crate::study::until::{MARGIN, TargetCheck, WORTH_WHILE, grown};
use crate::until::{Goal, Growing, Look};

/// Rays of the second iteration over those of the first: their share of the variance halves, which shows it.
const SECOND_LOOK: u32 = 2;

/// Batches of the map over those of the first iteration: eight of 32, whose variance has a standard error of half of it. With four, intervals of
/// runs that stop would hold in 92 instead of 93 of 100 at worst (means of normal numbers, 60 000 runs).
const FIRST_BATCHES: u32 = 4;

/// A map that is rendered with a part of its batches, then with all of them and more rays.
struct GrowingRendering<'a> {
    job: &'a Job<'a>,
    settings: &'a RenderSettings,
    targets: &'a Targets,
    /// Rays at the most.
    most: u32,
    /// Rays and parameters of the iteration with fewer rays and all batches.
    before: Option<(u32, Vec<ReceiverParameters>)>,
}

impl Growing for GrowingRendering<'_> {
    type Run = RenderedMap;

    fn run(
        &mut self,
        effort: Effort,
        before: Option<Look<RenderedMap>>,
    ) -> Result<(RenderedMap, Vec<ReceiverParameters>)> {
        let before = before.filter(|look| look.effort.batches == self.all());
        self.before = before.map(|look| (look.effort.rays, look.parameters));
        let settings = RenderSettings { rays: Some(effort.rays), ..self.settings.clone() };
        Job { batches: Some(effort.batches), ..*self.job }.read(&settings, &self.targets.parameters())
    }

    fn next(&self, last: &Look<RenderedMap>, growth: f64) -> Option<Effort> {
        let (Effort { rays, batches, .. }, found) = (last.effort, &last.found);
        if batches < self.all() {
            let next = next_batches(batches, self.all(), found);
            let is_affordable = f64::from(next - batches) <= growth * f64::from(batches);
            return (!found.is_reached() && is_affordable).then_some(Effort { batches: next, ..last.effort });
        }
        // An iteration costs no more than in proportion to its rays.
        let affordable = (f64::from(rays) * growth).max(0.0) as u32;
        let next = self.forecast(last).next(rays, self.most.min(affordable));
        next.map(|rays| Effort { rays, ..last.effort })
    }

    fn in_words(&self, Effort { rays, batches, .. }: Effort) -> String {
        let all = self.all();
        if batches < all { format!("{batches} of {all} batches") } else { format!("{rays} rays") }
    }
}

impl GrowingRendering<'_> {
    /// Batches of the map.
    fn all(&self) -> u32 {
        self.job.map.header().settings.batches
    }

    /// Prediction from the `last` iteration and the one before: where the first with all batches is not enough, a second with more rays tells
    /// what rays bring.
    fn forecast(&self, last: &Look<RenderedMap>) -> RayForecast {
        let Look { effort, found, parameters, .. } = last;
        if found.is_inside() || effort.batches < self.all() {
            RayForecast::Inside
        } else if self.before.is_none() && last.run.casts_rays {
            RayForecast::Unknown
        } else {
            let wanted = self.targets.parameters();
            let before = self.before.as_ref().map(|(rays, parameters)| (*rays, &parameters[..]));
            let pilot = Pilot::of(before, parameters, &wanted, *effort);
            RayForecast::Known(pilot.render_need(self.targets, *effort))
        }
    }
}

/// Renders and evaluates, until the targets are kept, a bound is met, or more rays cannot help; with what the report states. Where a part of
/// the batches is enough, the others are left out.
pub(super) fn until(
    job: &Job<'_>,
    settings: &RenderSettings,
    goal: &Goal<'_>,
) -> Result<(RenderedMap, Value, bool)> {
    let Settings { emissions, batches, .. } = job.map.header().settings;
    let most = goal.most.map_or(MOST_RAYS, |most| most as u32);
    let mut run = GrowingRendering { job, settings, targets: goal.targets, most, before: None };
    let names = Names::of(&job.map.header().scene, job.receivers);
    let rays = RenderSettings::default().rays(emissions).min(most);
    let first = Effort { emissions, rays, batches: batches.div_ceil(FIRST_BATCHES) };
    let (look, mut report) = crate::until::until(&mut run, first, &names, goal)?;
    let forecast = run.forecast(&look);
    forecast.advice(job.label.unwrap_or_default()).iter().try_for_each(|advice| goal.watch.info(advice))?;
    report["batches"] = json!(look.effort.batches);
    report["rays_wanted"] = json!(forecast.rays_wanted());
    report["packets_wanted"] = json!(forecast.packets_wanted());
    Ok((look.run, json!({ "until": report }), look.found.is_reached()))
}

/// Batches of a next iteration. Half-widths go with the root of their number; what cannot be read yet may need all of them.
fn next_batches(batches: u32, all: u32, found: &TargetCheck) -> u32 {
    let needed = match found.worst {
        Some(worst) if found.not_estimable.is_empty() => {
            MARGIN * f64::from(batches) * worst.excess() * worst.excess()
        }
        _ => f64::INFINITY,
    };
    steps(all).into_iter().find(|&step| step > batches && f64::from(step) >= needed).unwrap_or(all)
}

/// Prediction for the next iteration from those so far.
#[derive(Debug, Clone, Copy)]
enum RayForecast {
    /// Nothing is wanting, as far as parameters can be read.
    Inside,
    /// One iteration does not tell whether rays would help.
    Unknown,
    /// Rays and packets needed.
    Known(Need),
}

impl RayForecast {
    /// The rays of the next iteration after one with `rays`, where one with at most `most` is worth while.
    fn next(self, rays: u32, most: u32) -> Option<u32> {
        let wanted = match self {
            Self::Unknown => u64::from(SECOND_LOOK * rays),
            Self::Known(Need { lacking: None, effort, .. }) => grown(rays.into(), f64::from(effort.rays)),
            Self::Inside | Self::Known(_) => return None,
        };
        let next = wanted.min(most.into()) as u32;
        (f64::from(next) >= WORTH_WHILE * f64::from(rays)).then_some(next)
    }

    /// Rays that would do.
    fn rays_wanted(self) -> Option<u32> {
        match self {
            Self::Known(Need { lacking: None, effort, .. }) => Some(effort.rays),
            _ => None,
        }
    }

    /// Packets of a map that would do, where no number of rays does.
    fn packets_wanted(self) -> Option<u64> {
        match self {
            Self::Known(render_need) => render_need.lacking,
            _ => None,
        }
    }

    /// Advice where this was not enough.
    fn advice(self, label: &str) -> Option<String> {
        match self {
            Self::Inside => None,
            Self::Unknown => Some(
                "one rendering does not show whether more rays or more packets are needed: allow more of either".to_owned(),
            ),
            Self::Known(Need { lacking: Some(packets), effort, .. }) => Some(format!(
                "more rays are not enough: about {packets} packets and {} rays are needed: {}",
                effort.rays,
                extension(label, packets)
            )),
            Self::Known(render_need) => Some(format!("about {} rays are needed", render_need.effort.rays)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(rays: u32, lacking: Option<u64>) -> RayForecast {
        let effort = Effort { emissions: 1000, rays, batches: 32 };
        RayForecast::Known(Need { effort, limited_by: None, lacking })
    }

    #[test]
    fn a_second_look_tells_what_rays_bring_and_the_third_aims_beyond() {
        assert_eq!(RayForecast::Unknown.next(1000, 9999), Some(2000));
        assert_eq!(known(4000, None).next(2000, 9999), Some(4600));
        assert_eq!(known(4000, None).next(2000, 3000), Some(3000));
    }

    #[test]
    fn nobody_looks_again_in_vain() {
        assert_eq!(RayForecast::Inside.next(1000, 9999), None);
        assert_eq!(known(4000, Some(9)).next(1000, 9999), None);
        assert_eq!(known(4000, None).next(1000, 1050), None);
        assert_eq!(RayForecast::Unknown.next(1000, 0), None);
    }

    #[test]
    fn what_is_wanting_is_said() {
        let advice = known(4000, Some(70_000)).advice("a.sonelmap").unwrap();
        assert!(advice.contains("--extend a.sonelmap --packets 70000"), "{advice}");
        assert!(known(4000, None).advice("a.sonelmap").unwrap().contains("4000 rays"));
        assert_eq!(RayForecast::Inside.advice("a.sonelmap"), None);
    }
}
