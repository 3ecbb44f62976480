//! Insertion loss of a straight rigid screen by every law.
//!
//! The screen ends at the origin and reaches down from there without end; source and receiver lie in one plane across its edge.
//!
//! References: docs/diffraction.md, docs/paper-mode.md; [Maekawa1968], [KurzeAnderson1971], [BornWolf1999] (docs/references.md).

use std::f64::consts::{FRAC_1_SQRT_2, PI, SQRT_2, TAU};

use glam::{DVec2, DVec3};
use sonel_diffraction::{Complex, EdgePath, Spectrum, Visibility, Wave, Wedge};
use sonel_testkit::analytic::knife_edge::kirchhoff;

/// Speed of sound of all figures [m/s].
pub(super) const SPEED: f64 = 343.0;
/// Half the length of an edge without end [m].
const ENDLESS: f64 = 1e4;

/// Source and receiver about an edge at the origin [m]: across the screen, and up.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrangement {
    /// Before the screen.
    pub source: DVec2,
    /// Behind it.
    pub receiver: DVec2,
}

/// Insertion losses in an octave [dB].
#[derive(Debug, Clone, Copy)]
pub(super) struct Losses {
    /// Fresnel number at the centre, negative in sight.
    pub fresnel: f64,
    /// By law, in the order of [`LAWS`]; none where a law has no answer.
    pub by_law: [Option<f64>; LAWS.len()],
}

/// The laws, as figures call them.
pub(super) const LAWS: [&str; 5] = ["exact", "Kirchhoff", "Maekawa", "Kurze and Anderson", "the paper's v₁"];

impl Arrangement {
    /// Losses in the octave about `center_frequency` [Hz]: the exact one as a mean over the octave, the others at its centre.
    pub(super) fn losses(&self, center_frequency: f64) -> Losses {
        let wavelength = SPEED / center_frequency;
        let fresnel = 2.0 * self.detour() / wavelength * if self.is_clear() { -1.0 } else { 1.0 };
        let by_law = [
            Some(self.exact(center_frequency)),
            Some(level(kirchhoff((2.0 * fresnel.abs()).sqrt().copysign(fresnel)))),
            maekawa(fresnel),
            kurze_anderson(fresnel),
            paper(fresnel),
        ];
        Losses { fresnel, by_law: by_law.map(|loss| loss.filter(|loss| loss.is_finite())) }
    }

    /// The way over the edge less the straight one [m].
    pub(super) fn detour(&self) -> f64 {
        self.source.length() + self.receiver.length() - self.source.distance(self.receiver)
    }

    /// Whether the straight way passes over the edge.
    fn is_clear(&self) -> bool {
        self.source.perp_dot(self.receiver) <= 0.0
    }

    fn exact(&self, center_frequency: f64) -> f64 {
        let edge = [-DVec3::Z * ENDLESS, DVec3::Z * ENDLESS];
        let wedge = Wedge::new(edge, -DVec3::Y, -DVec3::X, TAU).expect("a sheet is a wedge");
        let about = |point: DVec2| wedge.locate(point.extend(0.0)).expect("a sheet has no inside");
        let spectrum = Spectrum::new(&[(center_frequency * FRAC_1_SQRT_2, center_frequency * SQRT_2)], SPEED);
        let path = EdgePath::new(
            &wedge,
            about(self.source),
            about(self.receiver),
            [0.0, wedge.length()],
            Visibility::default(),
            spectrum.range(),
        );
        let amplitude = |piece: usize, k: f64| {
            path.amplitudes(piece, &k.into())[0].into_iter().fold(Complex::ZERO, |sum, term| sum + term)
        };
        let wave = |(piece, length): (usize, f64)| Wave {
            length,
            amplitude: spectrum.cells().iter().map(|cell| amplitude(piece, cell.k)).collect(),
        };
        let mut waves: Vec<Wave> = path.lengths().enumerate().map(wave).collect();
        let distance = self.source.distance(self.receiver);
        if self.is_clear() {
            waves.push(spectrum.flat(distance, 1.0 / distance));
        }
        level(spectrum.energy(&waves)[0] * distance * distance)
    }
}

/// A loss of what leaves `energy` of the free field [dB].
fn level(energy: f64) -> f64 {
    -10.0 * energy.log10()
}

/// Maekawa's chart for N above 0.
fn maekawa(fresnel: f64) -> Option<f64> {
    (fresnel > 0.0).then(|| 10.0 * (3.0 + 20.0 * fresnel).log10())
}

/// Kurze's and Anderson's fit to it, with its continuation into sight.
fn kurze_anderson(fresnel: f64) -> Option<f64> {
    let x = (TAU * fresnel.abs()).sqrt();
    let ratio = if fresnel > 0.0 { x / x.tanh() } else { x / x.tan() };
    match fresnel {
        -0.19..=0.0 if x > 0.0 => Some(5.0 + 20.0 * ratio.log10()),
        ..-0.19 => Some(0.0),
        _ if x > 0.0 => Some(5.0 + 20.0 * ratio.log10()),
        _ => Some(5.0),
    }
}

/// v₁ as energy where the straight way is blocked; nothing is left from N = 1 on.
fn paper(fresnel: f64) -> Option<f64> {
    let u = fresnel.max(0.0).sqrt();
    match fresnel {
        ..=0.0 => Some(0.0),
        0.0..1.0 => Some(level((u.acos() - u * (1.0 - u * u).sqrt()) / PI)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OCTAVES: [f64; 6] = [125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0];

    fn screen(below: f64) -> Arrangement {
        Arrangement { source: DVec2::new(-10.0, -below), receiver: DVec2::new(10.0, -below) }
    }

    /// Known losses, 1 and 3 m below the edge; and the charts give 0.4 to 3 dB less.
    #[test]
    fn a_rigid_screen_shades_as_known_and_the_charts_say_less() {
        let known = [
            (1.0, [8.13, 9.60, 11.41, 13.62, 16.19, 19.01]),
            (3.0, [12.78, 15.43, 18.30, 21.26, 24.26, 27.26]),
        ];
        for (below, expected) in known {
            for (center, expected) in OCTAVES.into_iter().zip(expected) {
                let [exact, _, maekawa, kurze, _] = screen(below).losses(center).by_law;
                assert!((exact.unwrap() - expected).abs() < 0.02, "{below} m, {center} Hz: {exact:?}");
                for chart in [maekawa, kurze] {
                    let missing = exact.unwrap() - chart.unwrap();
                    assert!((0.4..3.1).contains(&missing), "{below} m, {center} Hz: {missing}");
                }
            }
        }
    }

    #[test]
    fn the_paper_s_share_of_the_zone_loses_all_beyond_it() {
        assert!((paper(1e-12).unwrap() - 3.01).abs() < 0.01);
        assert_eq!(paper(1.0), None);
        assert!((paper(0.5).unwrap() - 10.4).abs() < 0.05);
    }
}
