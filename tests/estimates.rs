//! Energies of a rendering with their standard errors, and the comparison of two renderings.

use sonel_analysis::estimate::KernelShift;
use sonel_map::Settings;
use sonel_renderer::{CoarseEchogram, PathClass, RenderSettings, Rendering};
use sonel_scene::Scene;
use sonel_testkit::z_test::{Disagreement, Estimate, Within, agree};

use crate::Traced;

/// Fluences of one receiver and band in successive windows of time [1/m²].
pub type Windows = Vec<Estimate>;

/// Largest distance of two estimates that agree [standard errors of their difference].
const SIGMAS: f64 = 4.0;

/// Fluence between successive `borders` [s], which are borders of bins: `[receiver][band][window]`, with errors from the
/// batches.
#[must_use]
pub fn windows(traced: &Traced, settings: RenderSettings, borders: &[f64]) -> Vec<Vec<Windows>> {
    estimates(traced, settings, borders, |energy, _| Estimate::of(energy))
}

/// As [`windows`], with the bias of discs and spheres in the errors: what intervals of parameters include, as far as noise lets see,
/// is the tolerance that [`agree_in_windows`] adds.
#[must_use]
pub fn windows_with_bias(traced: &Traced, settings: RenderSettings, borders: &[f64]) -> Vec<Vec<Windows>> {
    estimates(traced, settings, borders, |energy, difference| {
        let (energy, difference) = (Estimate::of(energy), Estimate::of(difference));
        let shift = KernelShift { shift: 2.0 * difference.value, sigma: 2.0 * difference.sigma };
        Estimate { sigma: energy.sigma + shift.bias() / SIGMAS, ..energy }
    })
}

/// The same of energies in batches and of what kernels of half the area would have added to them.
fn estimates(
    traced: &Traced,
    settings: RenderSettings,
    borders: &[f64],
    estimate: impl Fn(&[f64], &[f64]) -> Estimate,
) -> Vec<Vec<Windows>> {
    let scene = &traced.map.header().scene;
    let all_borders = vec![borders.to_vec(); scene.receivers.len()];
    let (rendering, _) = traced.render_with(settings, &all_borders);
    let band = |receiver: usize, band: usize| -> Windows {
        let of_window = |batches: &[Vec<CoarseEchogram>], window: usize| -> Vec<f64> {
            batches.iter().filter_map(|batch| batch[receiver].band(band).nth(window)).collect()
        };
        (0..borders.len() - 1)
            .map(|window| {
                estimate(
                    &of_window(&rendering.batches, window),
                    &of_window(&rendering.kernel_differences, window),
                )
            })
            .collect()
    };
    (0..scene.receivers.len())
        .map(|receiver| (0..scene.bands.count()).map(|b| band(receiver, b)).collect())
        .collect()
}

/// Part of all energy below which a window's own energy is no measure of its error any more.
const LITTLE: f64 = 1e-3;
/// Windows in which both renderings have less than this part of all energy are not compared: 60 dB down a handful of packets carry everything,
/// and the spread of batches says nothing of their distribution.
const SILENT: f64 = 1e-6;

/// Whether two renderings agree in every window within four joint standard errors, none of which may exceed
/// `largest_error` of the energy in the window; in windows that hold next to nothing, of a thousandth of all energy.
///
/// # Errors
/// The first window that does not.
pub fn agree_in_windows(first: &Windows, second: &Windows, largest_error: f64) -> Result<(), Disagreement> {
    let all: f64 = second.iter().map(|window| window.value).sum();
    let audible = |(first, second): &(&Estimate, &Estimate)| first.value.max(second.value) >= SILENT * all;
    first.iter().zip(second).filter(audible).try_for_each(|(&first, &second)| {
        let maximal_sigma = largest_error * second.value.max(LITTLE * all);
        agree(first, second, Within { sigmas: SIGMAS, maximal_sigma })
    })
}

/// Who brought the energy, whoever owned the class: L S⁺ R, … D R, … D S⁺ R.
pub type ClassSums = [f64; 3];

/// Sums over receivers and time of what each class brings in `band` [1/m²].
#[must_use]
pub fn class_sums(rendering: &Rendering, band: usize) -> ClassSums {
    let energy = |class: PathClass| rendering.classes[class as usize].1[band];
    [
        energy(PathClass::ImageSource) + energy(PathClass::LateSpecular),
        energy(PathClass::Diffuse),
        energy(PathClass::DiffuseMirror) + energy(PathClass::LongDiffuseMirror),
    ]
}

/// Everything but the direct sound by class in every band, from `runs` runs with seeds of their own: `[band][class]`.
#[must_use]
pub fn class_estimates(scene: &Scene, settings: Settings, runs: u64) -> Vec<[Estimate; 3]> {
    let renderings: Vec<Rendering> = (1..=runs)
        .map(|seed| {
            Traced::new(scene.clone(), Settings { seed, ..settings }).render(RenderSettings::default())
        })
        .collect();
    (0..scene.bands.count())
        .map(|band| {
            let sums: Vec<ClassSums> =
                renderings.iter().map(|rendering| class_sums(rendering, band)).collect();
            [0, 1, 2].map(|class| Estimate::of(&sums.iter().map(|sums| sums[class]).collect::<Vec<_>>()))
        })
        .collect()
}
