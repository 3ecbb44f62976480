//! Intervals of materials against a Monte Carlo of rooms whose materials are drawn at random.

use sonel_testkit::uniform::Uniform;
use sonel_tests::material_uncertainty::{Uncertain, half_width, values};

const ROOMS: usize = 400;
/// The spread of 400 rooms is uncertain by 3.5 %: 3.5 of its standard errors for nine values, less than one in 2000 each, and 3 % for the curvature
/// over the drawn range.
const TOLERANCE: f64 = 0.15;

/// Normal by the sum of twelve uniform numbers.
fn normal(numbers: &mut Uniform) -> f64 {
    (0..12).map(|_| numbers.next_f64()).sum::<f64>() - 6.0
}

#[test]
fn drawn_rooms_spread_as_the_law_of_propagation_says() {
    let room = Uncertain::traced(10_000);
    let predicted = values(&room.predicted());
    let mut numbers = Uniform::new(7);
    let drawn: Vec<Vec<f64>> = (0..ROOMS)
        .map(|_| {
            let off = [0; 3].map(|_| normal(&mut numbers));
            values(&room.with(off)).iter().map(|estimate| estimate.value).collect()
        })
        .collect();
    for (index, estimate) in predicted.iter().enumerate() {
        let mean = drawn.iter().map(|values| values[index]).sum::<f64>() / ROOMS as f64;
        let squares: f64 = drawn.iter().map(|values| (values[index] - mean).powi(2)).sum();
        let spread = 1.96 * (squares / (ROOMS - 1) as f64).sqrt();
        let half = half_width(estimate);
        // Each tail has 2.5 % of the rooms, 10 ± 3.1: within 3.5 standard errors.
        let [low, high] = estimate.material_interval().expect("materials");
        let tails = [
            drawn.iter().filter(|values| values[index] < low).count(),
            drawn.iter().filter(|values| values[index] > high).count(),
        ];
        assert!(
            tails.iter().all(|tail| (1..=21).contains(tail)),
            "value {index}: {tails:?} of {ROOMS} rooms beyond the interval"
        );
        println!("value {index}: ± {half:.4} predicted, ± {spread:.4} of {ROOMS} rooms");
        assert!((half / spread - 1.0).abs() < TOLERANCE, "value {index}: {half} instead of {spread}");
        // Without the most important material it is another interval.
        let most = estimate.materials.iter().fold(0.0_f64, |most, change| most.max(change.by_one.abs()));
        let without = (half * half - (1.96 * most).powi(2)).max(0.0).sqrt();
        assert!((without / spread - 1.0).abs() > TOLERANCE, "value {index}");
    }
}
