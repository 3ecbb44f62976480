//! Options with a few named values that several programs have.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use sonel::map::{Mode, Spectral};
use sonel::rendering::Estimator;

/// Reads one of `choices`, each with what help says of it, by the words that `name` gives them.
fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    choices: [(T, &'static str); N],
    name: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    let words = choices.map(|(choice, help)| PossibleValue::new(name(choice)).help(help));
    PossibleValuesParser::new(words).map(move |word| {
        let chosen = choices.iter().find(|(choice, _)| name(*choice) == word);
        chosen.expect("clap accepts these words alone").0
    })
}

/// `--mode`.
#[must_use]
pub fn mode() -> impl TypedValueParser<Value = Mode> {
    let choices = [
        (Mode::Accurate, "Weighted packets that carry all bands"),
        (Mode::Paper, "One band per packet, roulette with the absorption coefficient"),
    ];
    one_of(choices, Mode::name)
}

/// `--spectral`.
#[must_use]
pub fn spectral() -> impl TypedValueParser<Value = Spectral> {
    let choices = [
        (Spectral::Shared, "Every path carries all bands"),
        (Spectral::PerBand, "Every path carries one band"),
    ];
    one_of(choices, Spectral::name)
}

/// `--estimator`.
#[must_use]
pub fn estimator() -> impl TypedValueParser<Value = Estimator> {
    let choices = [
        (Estimator::Auto, "The most efficient estimator for each path class"),
        (
            Estimator::Connection,
            "Connections for diffuse arrivals, receiver spheres for specular reflections after a diffuse one",
        ),
        (
            Estimator::Gather,
            "Connections for diffuse arrivals, visibility rays and density estimation for specular reflections after a diffuse one",
        ),
        (Estimator::Sphere, "Receiver spheres for everything but the direct sound"),
        (
            Estimator::Paper,
            "That of the founding paper: visibility rays that gather at the first diffuse reflection, a sphere \
             about the source, the first Fresnel zone over edges",
        ),
    ];
    one_of(choices, Estimator::name)
}
