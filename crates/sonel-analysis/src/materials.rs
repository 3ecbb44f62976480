//! Uncertainty of parameters that comes from the absorption of materials.
//!
//! Law of propagation of uncertainty, first order [GUM]: u²(P) = Σₘ cₘ², where cₘ = ∂P/∂α · uₘ(α) is the change of the parameter by one standard
//! uncertainty of the absorption of material m. Materials are independent of one another. Within a material all bands deviate together: what makes
//! a specimen differ from the wall, such as mounting, thickness or moisture, does so in neighbouring bands alike, and no standard states
//! correlations. The mean over bands is then as uncertain as the bands, which is the cautious choice. For the same reason changes are added with their signs in
//! means over bands and receivers before they are squared.
//!
//! The interval spans 1.96 u to either side, less where the absorption would leave its range. Times (EDT, T20, T30, Ts) are propagated as their
//! reciprocals, since a decay rate is about linear in the absorption (Sabine): the interval is that of the decay rate. Levels and ratios
//! are linear in dB: at α = 0.25 ± 0.1 everywhere within 0.5 dB, where energies that go as 1/α would be off by 0.7 dB.
//!
//! Reference: [GUM] clauses 5.1 and 6 (docs/references.md).

use crate::estimate::{Estimate, MaterialChange, ParameterValue};
use crate::receiver::ReceiverParameters;

/// Standard uncertainties in half an interval of the materials: 95 % of a normal distribution.
pub const COVERAGE_FACTOR: f64 = 1.96;

/// Parameters of a room in which the absorption of one material is changed.
#[derive(Debug, Clone, PartialEq)]
pub struct Varied {
    /// Name of the material.
    pub material: String,
    /// The change in standard uncertainties, above 0 and small.
    pub share: f64,
    /// How far the absorption may fall and rise within its range, by band [standard uncertainties].
    pub room: Vec<[f64; 2]>,
    /// Parameters with the change, of the same sources, receivers and bands as without.
    pub parameters: Vec<ReceiverParameters>,
}

impl Varied {
    /// The change by one standard uncertainty from `before` to `after` in a band, or over all bands, which stay in their ranges one by one.
    fn change(&self, band: Option<usize>, before: f64, after: f64) -> MaterialChange {
        let by_one = (after - before) / self.share;
        let rooms = || self.room.iter().enumerate().filter(|(at, _)| band.is_none_or(|band| band == *at));
        let [fall, rise] = [0, 1]
            .map(|end| rooms().fold(0.0_f64, |most, (_, room)| most.max(room[end])).min(COVERAGE_FACTOR));
        MaterialChange { by_one, at_ends: [-fall * by_one, rise * by_one] }
    }
}

/// Gives every value of `parameters` the changes by each material, from `before` and `varied`, which share their random numbers. A value gets none
/// where one of the changes is not known, and a warning where an absorption is cut.
pub fn attach(parameters: &mut [ReceiverParameters], before: &[ReceiverParameters], varied: &[Varied]) {
    for (at, receiver) in parameters.iter_mut().enumerate() {
        let Some(before) = before.get(at) else { continue };
        let before = before.values();
        let varied: Vec<(&Varied, Vec<&ParameterValue>)> =
            varied.iter().filter_map(|varied| Some((varied, varied.parameters.get(at)?.values()))).collect();
        for (index, (band, value)) in receiver.values_mut().into_iter().enumerate() {
            let Ok(estimate) = value else { continue };
            let change = |(varied, values): &(&Varied, Vec<&ParameterValue>)| {
                let (Ok(after), Ok(before)) = (values.get(index)?, before.get(index)?) else { return None };
                Some(varied.change(band, before.value, after.value))
            };
            let materials: Vec<MaterialChange> =
                varied.iter().map(change).collect::<Option<_>>().unwrap_or_default();
            let cut = cut(&materials, varied.iter().map(|(varied, _)| &*varied.material));
            *estimate = Estimate { materials, ..estimate.clone() }.warned(cut);
        }
    }
}

/// The warning where the absorption of one of the `names` is cut at an end of its range.
fn cut<'a>(changes: &[MaterialChange], names: impl Iterator<Item = &'a str>) -> Option<String> {
    let is_cut = |change: &MaterialChange| {
        let whole = COVERAGE_FACTOR * change.by_one.abs();
        change.at_ends.iter().any(|end| end.abs() < whole)
    };
    let names: Vec<String> = changes
        .iter()
        .zip(names)
        .filter(|(change, _)| is_cut(change))
        .map(|(_, name)| format!("\"{name}\""))
        .collect();
    (!names.is_empty()).then(|| {
        format!(
            "α ± 1.96 u of {} is cut at an end of its range: the interval of the materials is rough",
            names.join(", ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A time of 0.84 s, or a level, by a material of α and u, with the derivative of Sabine's time: ∂T/∂α = −T/α.
    fn estimate(is_time: bool, alpha: f64, u: f64) -> Estimate {
        let varied = Varied {
            material: "walls".to_owned(),
            share: 0.01,
            room: vec![[alpha / u, (1.0 - alpha) / u]],
            parameters: Vec::new(),
        };
        let time = |alpha: f64| 0.84 * 0.25 / alpha;
        let change = varied.change(Some(0), time(alpha), time(alpha) - 0.01 * time(alpha) * u / alpha);
        Estimate {
            is_time,
            materials: vec![change],
            ..Estimate::bare(time(alpha), Ok([0.99, 1.01].map(|part| part * time(alpha))))
        }
    }

    #[test]
    fn times_have_the_interval_of_their_decay_rate() {
        let [low, high] = estimate(true, 0.25, 0.05).material_interval().unwrap();
        assert!(
            (low - 0.84 * 0.25 / 0.348).abs() < 1e-9 && (high - 0.84 * 0.25 / 0.152).abs() < 1e-9,
            "{low} {high}"
        );
        let [low, high] = estimate(false, 0.25, 0.05).material_interval().unwrap();
        assert!((low + high - 2.0 * 0.84).abs() < 1e-9, "others are linear: {low} {high}");
    }

    /// α = 0.02 ± 0.05: T of 10.5 s is 1.78 s at α = 0.118, and without an end at 0; the symmetric interval began below 0.
    #[test]
    fn an_absorption_does_not_leave_its_range() {
        let hard = estimate(true, 0.02, 0.05);
        let [low, high] = hard.material_interval().unwrap();
        assert!((low - 0.84 * 0.25 / 0.118).abs() < 1e-9 && high > 1e9, "{low} {high}");
        let whole = hard.whole_interval().unwrap();
        assert!(whole[0] > 0.99 * low && whole[0] < low, "{whole:?}");
        assert!(cut(&hard.materials, ["walls"].into_iter()).unwrap().contains("\"walls\""));
        assert_eq!(cut(&estimate(true, 0.25, 0.05).materials, ["walls"].into_iter()), None);
    }

    #[test]
    fn means_of_times_are_times() {
        let [a, b] = [0.25, 0.02].map(|alpha| Ok(estimate(true, alpha, 0.05)));
        let mean = crate::average::average([&a, &b]).unwrap();
        assert!(mean.is_time && mean.whole_interval().is_err());
        let fall = |value: &ParameterValue| value.as_ref().unwrap().materials[0].at_ends[0];
        assert!((mean.materials[0].at_ends[0] - 0.5 * (fall(&a) + fall(&b))).abs() < 1e-6);
    }
}
