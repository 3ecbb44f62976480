//! `until`: repeats work with more effort until the targets are kept, a limit is met, or more effort cannot help.

use serde_json::{Value, json};
use sonel_analysis::ReceiverParameters;

use crate::Result;
use crate::observer::Watch;
use crate::plan::{check_in_words, check_json, overrun, reached};
use crate::study::forecast::Effort;
use crate::study::plan::Names;
use crate::study::spread::readings;
use crate::study::target::Targets;
use crate::study::until::TargetCheck;

/// Targets and limits.
#[derive(Clone, Copy)]
pub(crate) struct Goal<'a> {
    /// Targets of the parameters.
    pub targets: &'a Targets,
    /// Most packets of a trace, most rays of a rendering; by default as many as can be.
    pub most: Option<u64>,
    /// Limit by the clock [s].
    pub seconds: Option<f64>,
    /// Observer.
    pub watch: Watch<'a>,
}

/// Work that is done again with more effort.
pub(crate) trait Growing {
    /// Result of an iteration.
    type Run;

    /// Does the work, after `before`, and reads the parameters.
    fn run(
        &mut self,
        effort: Effort,
        before: Option<Look<Self::Run>>,
    ) -> Result<(Self::Run, Vec<ReceiverParameters>)>;

    /// Effort after `last`, where more is wanted and possible. There is time for an iteration `growth` times as long as the last.
    fn next(&self, last: &Look<Self::Run>, growth: f64) -> Option<Effort>;

    /// The effort in words, such as `2000 packets`.
    fn in_words(&self, effort: Effort) -> String;

    /// Limit other than time that ended the work after `last`, in brackets.
    fn limit(&self, _last: &Look<Self::Run>) -> &'static str {
        ""
    }
}

/// An iteration whose parameters were read.
pub(crate) struct Look<R> {
    /// Result.
    pub run: R,
    /// Effort.
    pub effort: Effort,
    /// All parameters.
    pub parameters: Vec<ReceiverParameters>,
    /// Findings on the targets.
    pub found: TargetCheck,
}

/// Does `work` with the effort `first` and more; returns the last iteration and its report.
pub(crate) fn until<G: Growing>(
    work: &mut G,
    first: Effort,
    names: &Names,
    goal: &Goal<'_>,
) -> Result<(Look<G::Run>, Value)> {
    let Goal { targets, seconds, watch, .. } = *goal;
    let (mut effort, mut before, mut iterations) = (first, None, 0);
    loop {
        let begin = watch.seconds().0;
        let (run, parameters) = work.run(effort, before.take())?;
        iterations += 1;
        let found = TargetCheck::new(&readings(&parameters, &targets.parameters()), targets);
        let words = work.in_words(effort);
        watch.info(&format!("{words}: {}", check_in_words(names, &found, targets)))?;
        let now = watch.seconds().0;
        let growth = seconds.map_or(f64::INFINITY, |end| (end - now) / (now - begin).max(1e-3));
        let look = Look { run, effort, parameters, found };
        if let Some(next) = work.next(&look, growth) {
            (effort, before) = (next, Some(look));
            continue;
        }
        let has_time = work.next(&look, f64::INFINITY).is_none();
        let limit = if has_time { work.limit(&look) } else { " (time limit of `at_most`)" };
        watch.info(&format!("{} with {words}{limit}: {targets}", reached(&look.found)))?;
        overrun(seconds, now).iter().try_for_each(|sentence| watch.info(sentence))?;
        let mut report = check_json(names, &look.found, targets);
        report["rays"] = json!(effort.rays);
        report["iterations"] = json!(iterations);
        return Ok((look, report));
    }
}
