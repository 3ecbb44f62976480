//! What a sweep varies: one property at a time, about one base setting.
//!
//! All combinations of six properties would be thousands of runs.

use sonel_analysis::Parameter;
use sonel_map::{Mode, Settings, Spectral};
use sonel_renderer::{Estimator, RenderSettings};

/// The parameters compared: what a listener notices first.
pub const JUDGED: [Parameter; 4] =
    [Parameter::Level, Parameter::EarlyDecayTime, Parameter::T30, Parameter::ClarityC80];

/// Settings of a simulation, apart from the number of packets and the seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Setting {
    /// Difference from the others.
    pub name: String,
    /// Settings of the tracer.
    pub trace: Settings,
    /// Settings of the renderer.
    pub render: RenderSettings,
}

/// Values to be tried: the first of each belongs to the base setting, each other one is a setting of its own. An empty list
/// leaves the default.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Levels {
    /// Survival exponents β, 0 … 1.
    pub survival: Vec<f64>,
    /// Methods.
    pub mode: Vec<Mode>,
    /// Estimators.
    pub estimator: Vec<Estimator>,
    /// Visibility rays of a receiver.
    pub rays: Vec<u32>,
    /// Radii of the discs in which rays gather [m].
    pub radius: Vec<f64>,
}

/// Runs to be made.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Settings compared, the base setting first.
    pub settings: Vec<Setting>,
    /// Emissions per source, ascending.
    pub packets: Vec<u64>,
    /// Runs of each setting with each number of packets, each with a seed of its own; at least two.
    pub repeats: u32,
    /// Seed of the first repeat; later repeats use the following numbers.
    pub seed: u64,
    /// Emissions of the run that is the reference where no exact answer is known.
    pub reference_packets: u64,
}

impl Levels {
    /// The settings: `base` with the first of every list, then that with every other value.
    #[must_use]
    pub fn settings(&self, base: &Setting) -> Vec<Setting> {
        let modes = self.mode.iter().map(|&mode| Change::new(mode.name(), move |to| set_mode(to, mode)));
        let survivals = self
            .survival
            .iter()
            .map(|&survival| Change::new(format!("β {survival}"), move |to| to.trace.survival = survival));
        let estimators = self
            .estimator
            .iter()
            .map(|&estimator| Change::new(estimator.name(), move |to| to.render.estimator = estimator));
        let rays = self
            .rays
            .iter()
            .map(|&rays| Change::new(format!("{rays} rays"), move |to| to.render.rays = Some(rays)));
        let radii = self.radius.iter().map(|&radius| {
            Change::new(format!("h {radius} m"), move |to| to.render.gather_radius = Some(radius))
        });
        let mut changes: Vec<Vec<Change>> =
            vec![modes.collect(), survivals.collect(), estimators.collect(), rays.collect(), radii.collect()];
        changes.retain(|values| !values.is_empty());
        let mut base = base.clone();
        changes.iter().for_each(|values| (values[0].apply)(&mut base));
        let varied: Vec<&Vec<Change>> = changes.iter().filter(|values| values.len() > 1).collect();
        if let [values] = varied[..] {
            base.name = values[0].name.clone();
        }
        let others = varied.iter().flat_map(|values| &values[1..]).map(|change| {
            let mut setting = Setting { name: change.name.clone(), ..base.clone() };
            (change.apply)(&mut setting);
            setting
        });
        std::iter::once(base.clone()).chain(others).collect()
    }
}

/// A value of a property.
struct Change {
    name: String,
    apply: Box<dyn Fn(&mut Setting)>,
}

impl Change {
    fn new(name: impl Into<String>, apply: impl Fn(&mut Setting) + 'static) -> Self {
        Self { name: name.into(), apply: Box::new(apply) }
    }
}

fn set_mode(setting: &mut Setting, mode: Mode) {
    setting.trace.mode = mode;
    if mode == Mode::Paper {
        // docs/paper-mode.md: one band a packet, roulette on absorption alone, the paper's own estimator.
        setting.trace = Settings { spectral: Spectral::PerBand, survival: 1.0, ..setting.trace };
        setting.render.estimator = Estimator::Paper;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn base() -> Setting {
        Setting { name: "default".to_owned(), trace: Settings::default(), render: RenderSettings::default() }
    }

    #[test]
    fn one_property_is_changed_at_a_time() {
        let levels =
            Levels { survival: vec![0.15, 0.0], rays: vec![4000, 1000, 16_000], ..Levels::default() };
        let settings = levels.settings(&base());
        let names: Vec<&str> = settings.iter().map(|setting| setting.name.as_str()).collect();
        assert_eq!(names, ["default", "β 0", "1000 rays", "16000 rays"]);
        assert_eq!((settings[1].render.rays, settings[2].render.rays), (Some(4000), Some(1000)));
        assert!(settings[1].trace.survival == 0.0 && (settings[2].trace.survival - 0.15).abs() < 1e-12);
    }

    #[test]
    fn a_single_property_names_the_base_too_and_single_values_only_change_it() {
        let levels = Levels {
            estimator: vec![Estimator::Auto, Estimator::Sphere],
            rays: vec![99],
            ..Levels::default()
        };
        let settings = levels.settings(&base());
        assert_eq!(settings.iter().map(|s| s.name.as_str()).collect::<Vec<_>>(), ["auto", "sphere"]);
        assert!(settings.iter().all(|setting| setting.render.rays == Some(99)));
        assert_eq!(Levels::default().settings(&base()), [base()]);
    }
}
