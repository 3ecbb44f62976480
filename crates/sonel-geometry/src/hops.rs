//! Ways over a level where the speed of sound has a gradient: arcs from reflection to reflection, in closed form but for a root.
//!
//! With heights h from the plane c = 0, arcs are circles about places on it. One of radius ρ that meets the level h₀ spans 2a there, and is
//! s and r aside of its top at the heights of source and receiver: a² = ρ² − h₀², s² = ρ² − h₁², r² = ρ² − h₂². With k reflections source and
//! receiver are D = 2 k a ± s ± r apart, + where the source's arc rises and the receiver's falls; at a level that is met from the side where
//! sound is slower there is one reflection, D = s + r − 2a. A tube of rays has the cross section of
//!
//!   dΩ₁/dA₂ = h₁² a / (D ρ² |2 k s r + a (± r ± s)|).
//!
//! D(a) is monotonic or convex, so there are at most two ways for each choice of signs. The formulas are our own; they were compared with
//! rays of neighbouring directions (docs/physics.md §3).

use crate::arc::SpeedProfile;
use glam::DVec3;

/// Least horizontal distance [m] of ways: a vertical one is that of its neighbour.
const LEAST_DISTANCE: f64 = 1e-6;
/// Bisections of an interval: more than a double has digits.
const BISECTIONS: u32 = 100;
/// Most reflections that are looked for; a source that lies on the ground has ways of any number.
const MOST_REFLECTIONS: u32 = 4096;

/// A way from a source over reflections at a level to a receiver.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hops {
    /// Reflections, at least 1.
    pub reflections: u32,
    /// Horizontal distance from the source to the first of them [m].
    pub first: f64,
    /// Horizontal distance between two of them [m].
    pub between: f64,
    /// Solid angle at the source of the rays through a unit area across them at the receiver [1/m²].
    pub spread: f64,
}

/// Distances of one choice of signs.
struct Choice {
    /// k, −1 for a level that is met from the slower side.
    reflections: f64,
    signs: [f64; 2],
    /// h₁² − h₀² and h₂² − h₀² [m²].
    above: [f64; 2],
}

impl Choice {
    /// a − s and a − r [m], without a difference of large numbers.
    fn lacking(&self, a: f64) -> [f64; 2] {
        self.above.map(|above| above / (a + (a * a - above).max(0.0).sqrt()))
    }

    /// D [m].
    fn distance(&self, a: f64) -> f64 {
        let ([one, other], [source, receiver]) = (self.signs, self.lacking(a));
        (2.0 * self.reflections + one + other) * a - one * source - other * receiver
    }

    /// s r dD/da = 2 k s r + a (± r ± s) [m²].
    fn widening(&self, a: f64) -> f64 {
        let ([one, other], [source, receiver]) = (self.signs, self.lacking(a));
        let (s, r) = (a - source, a - receiver);
        let both = 0.5 * (one + other);
        let rest =
            if both == 0.0 { one * a * (source - receiver) } else { both * (s * receiver + r * source) };
        2.0 * (self.reflections + both) * s * r + rest
    }

    /// All a [m] with which source and receiver are `distance` [m] apart.
    fn spans(&self, distance: f64) -> Vec<f64> {
        let [source, receiver] = self.above;
        let least = source.max(receiver).max(0.0).sqrt();
        let slope = 2.0 * self.reflections + self.signs[0] + self.signs[1];
        let most = if slope > 0.0 {
            (distance + 2.0 * least + source.abs().sqrt() + receiver.abs().sqrt()) / slope
        } else {
            (source.abs() + receiver.abs()) / distance
        };
        let turn = bisect([least, most.max(least)], |a| self.widening(a) < 0.0);
        let branches = [[least, turn], [turn, most]];
        let nearer = |a| self.distance(a) < distance;
        let crosses = |[low, high]: &[f64; 2]| low < high && nearer(*low) != nearer(*high);
        let root = |[low, high]: [f64; 2]| bisect([low, high], |a| nearer(a) == nearer(low));
        branches.into_iter().filter(crosses).map(root).collect()
    }
}

/// Where in an interval `holds` ends to be true.
fn bisect([mut low, mut high]: [f64; 2], holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        *(if holds(middle) { &mut low } else { &mut high }) = middle;
    }
    0.5 * (low + high)
}

impl SpeedProfile {
    /// The ways from one place to another over reflections at one level alone, the plane that lies `level` [m] along the rise.
    #[must_use]
    pub fn hops(&self, from: DVec3, to: DVec3, level: f64) -> Vec<Hops> {
        let steepness = self.gradient().length();
        let rise = self.gradient() / steepness;
        let [height, ground] = [from, level * rise].map(|place| self.speed_at(place) / steepness);
        let above = [from, to].map(|place| {
            let above = rise.dot(place) - level;
            above * (above + 2.0 * ground)
        });
        let distance = (to - from).reject_from_normalized(rise).length().max(LEAST_DISTANCE);
        let mut found = Vec::new();
        let mut add = |reflections: f64, signs| {
            let choice = Choice { reflections, signs, above };
            for a in choice.spans(distance) {
                let radius_squared = a * a + ground * ground;
                let first = reflections.signum() + signs[0];
                found.push(Hops {
                    reflections: reflections.abs() as u32,
                    first: first * a - signs[0] * choice.lacking(a)[0],
                    between: 2.0 * a,
                    spread: height * height * a / (distance * radius_squared * choice.widening(a).abs()),
                });
            }
        };
        if above.iter().all(|&above| above < 0.0) {
            add(-1.0, [1.0, 1.0]);
        }
        // Between the reflections of k are at least k − 1 arcs of the least span.
        let least = above[0].max(above[1]).max(0.0).sqrt();
        let most = (0.5 * distance / least + 1.5).min(f64::from(MOST_REFLECTIONS)) as u32;
        for reflections in 1..=most {
            for signs in [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]] {
                // Only what is on the far side of the level falls to it, or rises from it.
                if signs.iter().zip(above).all(|(&sign, above)| sign > 0.0 || above > 0.0) {
                    add(f64::from(reflections), signs);
                }
            }
        }
        found
    }
}
