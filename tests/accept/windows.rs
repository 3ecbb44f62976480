//! Receivers outside of a room with a window: levels against image sources and the slow simulator, and intervals that hold over a hundred seeds.

use sonel_analysis::{Parameter, parameters};
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_tests::Traced;
use sonel_tests::window::RoomWithWindow;

const SEEDS: u64 = 100;
/// Receivers [m] and radii of the spheres in which the slow simulator counts scattered sound.
const PLACES: [([f64; 3], f64); 3] =
    [([16.0, 2.5, 1.5], 0.6), ([46.0, 2.5, 1.5], 1.4), ([58.0, 2.5, 1.5], 1.4)];

/// Deviation that is left to rounding of the judge's settings [dB].
const ROUNDED: f64 = 0.03;
/// Deviation where spheres reach across borders of beams [dB].
const SHARP_BEAMS: f64 = 0.2;
/// Half-widths, in 1.96 standard deviations, at most, as a mean over the places: far away they reach to paths of which none was seen, which spread
/// knows nothing of (0.05 dB behind the small window at 58 m, 1.7 of the spread's).
const WIDEST: f64 = 1.5;

/// Level and interval at every place.
fn levels(room: RoomWithWindow, emissions: u64, seed: u64) -> Vec<(f64, [f64; 2])> {
    let scene = room.scene(&PLACES.map(|(place, _)| place));
    let traced = Traced::with(&["transmission"], scene, Settings { emissions, seed, ..Settings::default() });
    let read = |receiver: &sonel_analysis::ReceiverParameters| {
        let level = receiver.bands[0].parameter(Parameter::Strength).as_ref().expect("a level");
        (level.value, *level.interval.as_ref().expect("an interval"))
    };
    parameters(&traced.respond(RenderSettings::default())).iter().map(read).collect()
}

/// What a hundred seeds say at a place.
struct Heard {
    place: [f64; 3],
    /// Mean level [dB], its distance to that of the judge, and three standard errors of the judge.
    mean: f64,
    bias: f64,
    error: f64,
    /// Standard deviation and mean half-width [dB].
    sd: f64,
    width: f64,
    /// Shares of intervals, and of intervals of half the width, that hold the mean.
    covered: [f64; 2],
}

fn heard(name: &str, room: RoomWithWindow, emissions: u64, rays: usize) -> Vec<Heard> {
    let runs: Vec<_> = (1..=SEEDS).map(|seed| levels(room, emissions, seed)).collect();
    let of_place = |(index, (place, radius)): (usize, ([f64; 3], f64))| {
        let counted = room.fluence(place, radius, rays);
        let judge = 10.0 * (400.0 * std::f64::consts::PI * counted.value).log10();
        let mean_of = |of: &dyn Fn((f64, [f64; 2])) -> f64| {
            runs.iter().map(|run| of(run[index])).sum::<f64>() / SEEDS as f64
        };
        let mean = mean_of(&|(value, _)| value);
        let covered = [1.0, 0.5].map(|scale| {
            mean_of(&|(value, [low, high])| {
                let holds = value - scale * (value - low) <= mean && mean <= value + scale * (high - value);
                f64::from(u8::from(holds))
            })
        });
        let sd = mean_of(&|(value, _)| (value - mean).powi(2)).sqrt();
        let width = mean_of(&|(_, [low, high])| 0.5 * (high - low));
        let error = 3.0 * 4.343 * counted.sigma / counted.value;
        println!(
            "{name} {place:?}: {mean:.3} ± {sd:.3} dB, judge {judge:.3} ± {error:.3} (3 σ), half-width {width:.3}, coverage {:.2}",
            covered[0]
        );
        Heard { place, mean, bias: (mean - judge).abs(), error, sd, width, covered }
    };
    PLACES.into_iter().enumerate().map(of_place).collect()
}

fn check(name: &str, room: RoomWithWindow, emissions: u64, rays: usize) {
    let places = heard(name, room, emissions, rays);
    let ratio = places.iter().map(|it| it.width / (1.96 * it.sd)).sum::<f64>() / places.len() as f64;
    assert!(ratio <= WIDEST, "half-widths are {ratio:.2} times those of the spread");
    for Heard { place, mean, bias, error, covered, .. } in places {
        assert!(bias <= error + ROUNDED, "{place:?}: {mean:.3} dB is {bias:.3} dB off");
        assert!(covered[0] >= 0.90 && covered[1] <= 0.9, "{place:?}: coverage {covered:?}");
    }
}

#[test]
fn a_window_wall_is_heard_outside_as_loud_as_it_is() {
    let room =
        RoomWithWindow { corners: [[0.1, 0.1], [4.9, 2.9]], transmission: Some(0.01), scattering: 0.5 };
    check("wall", room, 20_000, 4_000_000);
}

#[test]
fn a_small_window_is_heard_outside_as_loud_as_it_is() {
    let room =
        RoomWithWindow { corners: [[1.5, 0.75], [3.0, 2.25]], transmission: Some(1e-3), scattering: 0.3 };
    check("small window", room, 20_000, 6_000_000);
}

#[test]
fn an_opening_is_heard_outside_as_loud_as_it_is() {
    let room = RoomWithWindow { corners: [[1.5, 0.75], [3.0, 2.25]], transmission: None, scattering: 0.3 };
    check("opening", room, 20_000, 6_000_000);
}

/// All sound outside comes in beams with sharp borders there. Far away they are image sources alone, and the interval bounds what no packet
/// brought; nearby spheres bring the mean over their width, 0.15 dB off (docs/physics.md §4).
#[test]
fn an_opening_between_smooth_walls_is_heard_outside_within_a_fifth_of_a_decibel() {
    let room = RoomWithWindow { corners: [[1.5, 0.75], [3.0, 2.25]], transmission: None, scattering: 0.0 };
    for Heard { place, mean, bias, error, covered, width, .. } in
        heard("opening, s = 0", room, 20_000, 320_000)
    {
        assert!(bias <= error + SHARP_BEAMS, "{place:?}: {mean:.3} dB is {bias:.3} dB off");
        assert!(covered[0] >= 0.90 && width > 0.0, "{place:?}: coverage {covered:?}, half-width {width:.3}");
    }
}
