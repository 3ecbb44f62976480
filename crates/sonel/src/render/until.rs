//! `until`: takes more batches, then more rays, until the targets are met, else states the rays or packets required.

use std::ops::ControlFlow;

use crate::study::pilot::Pilot;
use crate::study::plan::Names;
use crate::study::render_need::{Iteration, RenderNeed};
use crate::study::spread::readings;
use crate::study::target::Targets;
use crate::study::until::{MARGIN, Verdict, WORTH_WHILE, grown};
use serde_json::{Value, json};
use sonel_renderer::{MOST_RAYS, RenderSettings};

use crate::Result;
use crate::plan::{extension, overrun, reached, verdict, verdict_json};
use crate::render::job::{Job, Run};
use crate::render::planning::effort;
use crate::render::refinement::steps;

/// Rays of the second iteration over those of the first: their share of the variance halves, which shows it.
const SECOND_LOOK: u32 = 2;

/// Batches of the map over those of the first iteration: eight of 32, whose variance has a standard error of half of it. With four, intervals of
/// runs that stop would hold in 92 instead of 93 of 100 at worst (means of normal numbers, 60 000 runs).
const FIRST_BATCHES: u32 = 4;

/// Targets and limits of a rendering.
pub(super) struct Goal<'a> {
    /// Targets of the parameters.
    pub targets: &'a Targets,
    /// Rays at the most, where somebody says so.
    pub rays: Option<u32>,
    /// Seconds by the clock since the program began, where somebody says so.
    pub seconds: Option<f64>,
}

/// A rendering whose parameters were looked at.
pub(super) struct Finished<'a> {
    /// The last one.
    pub run: Run<'a>,
    /// Findings on the targets.
    pub verdict: Verdict,
    /// Text for stdout.
    pub told: Value,
}

/// Renders and evaluates, until the targets are kept, a bound is met, or more rays cannot help. Where a part of the batches is enough, the others
/// are left out. Iterations with all are their own pilot: where the first is not enough, a second with more rays tells what rays bring.
pub(super) fn until<'a>(job: &Job<'a>, settings: &RenderSettings, goal: &Goal<'_>) -> Result<Finished<'a>> {
    let watch = job.watch;
    let header = job.map.header();
    let (parameters, names) = (goal.targets.parameters(), Names::of(&header.scene, job.receivers));
    let most = goal.rays.unwrap_or(MOST_RAYS);
    let mut rays = RenderSettings::default().rays(header.settings.emissions).min(most);
    let some = RenderSettings { rays: Some(rays), ..settings.clone() };
    let mut iterations = match some_batches(job, &some, goal, &names)? {
        ControlFlow::Break(finished) => return Ok(finished),
        ControlFlow::Continue(iterations) => iterations,
    };
    let mut before: Option<Iteration> = None;
    loop {
        let begin = job.watch.seconds().0;
        let settings = RenderSettings { rays: Some(rays), ..settings.clone() };
        let map = effort(job, &settings);
        let run = job.render(settings)?;
        let iteration = Iteration { rays, parameters: sonel_analysis::parameters(&run.response) };
        iterations += 1;
        let found = Verdict::new(&readings(&iteration.parameters, &parameters), goal.targets);
        watch.info(&format!("{rays} rays: {}", verdict(&names, &found, goal.targets)));
        let forecast = if found.is_inside() {
            RayForecast::Inside
        } else if before.is_none() && run.renderer.casts_rays(job.receivers) {
            RayForecast::Unknown
        } else {
            let pilot = Pilot::of_iterations(before.as_ref(), &iteration, &parameters, map);
            RayForecast::Known(pilot.render_need(goal.targets, map))
        };
        let now = job.watch.seconds().0;
        // An iteration costs no more than in proportion to its rays.
        let affordable =
            goal.seconds.map_or(f64::INFINITY, |end| f64::from(rays) * (end - now) / (now - begin).max(1e-3));
        match forecast.next(rays, most.min(affordable.max(0.0) as u32)) {
            Some(next) => (rays, before) = (next, Some(iteration)),
            None => {
                let mut told = told(&names, &found, goal.targets, &run, iterations);
                told["rays_wanted"] = json!(forecast.rays_wanted());
                told["packets_wanted"] = json!(forecast.packets_wanted());
                let has_time = forecast.next(rays, most).is_none();
                let end = if has_time { "" } else { " (time limit of `at_most`)" };
                watch.info(&format!("{} with {rays} rays{end}: {}", reached(&found), goal.targets));
                for sentence in [forecast.advice(job.label), overrun(goal.seconds, now)].into_iter().flatten()
                {
                    watch.info(&sentence);
                }
                return Ok(Finished { run, verdict: found, told: json!({ "until": told }) });
            }
        }
    }
}

/// Renders a quarter of the batches and, where that promises to be enough, more of them. Goes on after so many iterations where all are needed.
fn some_batches<'a>(
    job: &Job<'a>,
    settings: &RenderSettings,
    goal: &Goal<'_>,
    names: &Names,
) -> Result<ControlFlow<Finished<'a>, u32>> {
    let (watch, targets, all) = (job.watch, goal.targets, job.map.header().settings.batches);
    let (mut batches, mut iterations) = (all.div_ceil(FIRST_BATCHES), 0);
    while batches < all {
        let begin = watch.seconds().0;
        let run = Job { batches: Some(batches), ..*job }.render(settings.clone())?;
        iterations += 1;
        let read = readings(&sonel_analysis::parameters(&run.response), &targets.parameters());
        let found = Verdict::new(&read, targets);
        watch.info(&format!("{batches} of {all} batches: {}", verdict(names, &found, targets)));
        let next = next_batches(batches, all, &found);
        let now = watch.seconds().0;
        let end = now + (now - begin) * f64::from(next - batches) / f64::from(batches);
        let has_time = goal.seconds.is_none_or(|limit| end <= limit);
        if found.is_reached() || !has_time {
            let limit = if has_time { "" } else { " (time limit of `at_most`)" };
            watch.info(&format!("{} with {batches} of {all} batches{limit}: {targets}", reached(&found)));
            overrun(goal.seconds, now).iter().for_each(|sentence| watch.info(sentence));
            let told = json!({ "until": told(names, &found, targets, &run, iterations) });
            return Ok(ControlFlow::Break(Finished { run, verdict: found, told }));
        }
        batches = next;
    }
    Ok(ControlFlow::Continue(iterations))
}

/// Batches of a next iteration. Half-widths go with the root of their number; what cannot be read yet may need all of them.
fn next_batches(batches: u32, all: u32, found: &Verdict) -> u32 {
    let needed = match found.worst {
        Some(worst) if found.not_estimable.is_empty() => {
            MARGIN * f64::from(batches) * worst.excess() * worst.excess()
        }
        _ => f64::INFINITY,
    };
    steps(all).into_iter().find(|&step| step > batches && f64::from(step) >= needed).unwrap_or(all)
}

/// Findings of the last iteration, as the report states them.
fn told(names: &Names, found: &Verdict, targets: &Targets, run: &Run<'_>, iterations: u32) -> Value {
    let mut told = verdict_json(names, found, targets);
    told["rays"] = json!(run.settings.rays);
    told["batches"] = json!(run.renderer.batches());
    told["iterations"] = json!(iterations);
    // Filled in where more of either would help.
    told["rays_wanted"] = Value::Null;
    told["packets_wanted"] = Value::Null;
    told
}

/// Prediction for the next iteration from those so far.
#[derive(Debug, Clone, Copy)]
enum RayForecast {
    /// Nothing is wanting, as far as parameters can be read.
    Inside,
    /// One iteration does not tell whether rays would help.
    Unknown,
    /// Rays and packets needed.
    Known(RenderNeed),
}

impl RayForecast {
    /// The rays of the next iteration after one with `rays`, where one with at most `most` is worth while.
    fn next(self, rays: u32, most: u32) -> Option<u32> {
        let wanted = match self {
            Self::Unknown => u64::from(SECOND_LOOK * rays),
            Self::Known(RenderNeed { lacking: None, effort, .. }) => {
                grown(rays.into(), f64::from(effort.rays))
            }
            Self::Inside | Self::Known(_) => return None,
        };
        let next = wanted.min(most.into()) as u32;
        (f64::from(next) >= WORTH_WHILE * f64::from(rays)).then_some(next)
    }

    /// Rays that would do.
    fn rays_wanted(self) -> Option<u32> {
        match self {
            Self::Known(RenderNeed { lacking: None, effort, .. }) => Some(effort.rays),
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
            Self::Known(RenderNeed { lacking: Some(packets), effort, .. }) => Some(format!(
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
    use crate::study::forecast::Effort;

    fn known(rays: u32, lacking: Option<u64>) -> RayForecast {
        let effort = Effort { emissions: 1000, rays, batches: 32 };
        RayForecast::Known(RenderNeed { effort, limited_by: None, lacking })
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
