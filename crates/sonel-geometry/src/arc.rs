//! Sound paths where the speed of sound changes linearly along one direction: circular arcs in closed form.
//!
//! c(x) = c₀ + G · x. With ds/c as length, space is hyperbolic: paths are circles that meet the plane c = 0 at right angles, sound arrives
//! after the time of the straight line's length d in that geometry, and a tube of rays has the cross section of a cone there:
//!
//!   t = (2/g) asinh(g d / (2 √(c₁c₂))), dΩ₁/dA₂ = c₁ / (c₂ d² (1 + g²d²/(4c₁c₂))), g = |G|.
//!
//! Every pair of places is joined by one arc. Rays are cast along chords of it that are at most [`SAGITTA`] away: the curvature
//! κ = g cos φ / c is constant along an arc, and a chord of length ℓ is less than κℓ²/8 away. Holds for any g and, as all rays, where c
//! changes little over a wavelength.
//!
//! References: [Salomons2001] (docs/references.md), docs/physics.md §3.

use glam::{DVec3, Vec3};

use crate::{Departure, Geometry, Hit};

/// Farthest that a chord is from its arc [m]: a fortieth of the wavelength at 8 kHz.
pub const SAGITTA: f64 = 1e-3;
/// Largest product of gradient and duration of a chord [1]: its length is bounded by e^0.1 times that at the speed of its beginning. Chosen;
/// only chords of steep gradients are that short, doubled they are 10 % shorter and half as many.
const LARGEST_STEP: f64 = 0.1;
/// Part of a chord by which the search for what it meets goes on beyond its end, so that nothing slips through between two chords. So far
/// beyond it the chord is nearer to the arc than in its middle: 4 x (x − 1) < 1 at x = 17/16.
const OVERLAP: f32 = 1.0 / 16.0;
/// Chords of an arc at most: as many as the longest run has. Damaged maps have longer arcs.
const MOST_CHORDS: u32 = 1 << 18;
/// Largest product of gradient and duration [1]. Beyond it paths that leave a scene end where single precision cannot tell their speed.
pub const LARGEST_TURN: f64 = 8.0;

/// A speed of sound that changes linearly along one direction; places are about the scene's centre [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedProfile {
    /// Speed of sound at the centre [m/s].
    speed: f64,
    /// Unit vector along which it rises.
    rise: DVec3,
    /// g [1/s], above 0.
    gradient: f64,
}

impl SpeedProfile {
    /// `speed` [m/s] at the centre, and its `gradient` [1/s]; none where that is zero.
    #[must_use]
    pub fn new(speed: f64, gradient: DVec3) -> Option<Self> {
        let steepness = gradient.length();
        (steepness > 0.0).then(|| Self { speed, rise: gradient / steepness, gradient: steepness })
    }

    /// Speed of sound [m/s].
    #[must_use]
    pub fn speed_at(&self, place: DVec3) -> f64 {
        (self.speed + self.gradient * self.rise.dot(place)).max(f64::MIN_POSITIVE)
    }

    /// Gradient [1/s].
    #[must_use]
    pub fn gradient(&self) -> DVec3 {
        self.gradient * self.rise
    }

    /// Longest run, and longer than any way through a room [s].
    #[must_use]
    pub fn longest_time(&self) -> f64 {
        LARGEST_TURN / self.gradient
    }

    /// Travel time along the arc between two places [s].
    #[must_use]
    pub fn travel_time(&self, from: DVec3, to: DVec3) -> f64 {
        let speeds = self.speed_at(from) * self.speed_at(to);
        2.0 / self.gradient * libm::asinh(0.5 * self.gradient * from.distance(to) / speeds.sqrt())
    }

    /// dΩ₁/dA₂: solid angle at `from` of the rays through a unit area across them at `to` [1/m²].
    #[must_use]
    pub fn spread(&self, from: DVec3, to: DVec3) -> f64 {
        let (here, there) = (self.speed_at(from), self.speed_at(to));
        let squared = from.distance_squared(to);
        let bent = 1.0 + 0.25 * self.gradient * self.gradient * squared / (here * there);
        here / (there * squared * bent)
    }
}

/// An arc from a place on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    profile: SpeedProfile,
    from: DVec3,
    /// Speed of sound there [m/s].
    speed: f64,
    /// The part of its unit direction there across the rise of the speed of sound.
    level: DVec3,
    /// The part along it.
    climb: f64,
}

impl Arc {
    /// The arc from a place on that leaves in a unit direction.
    #[must_use]
    pub fn leaving(profile: SpeedProfile, from: DVec3, direction: DVec3) -> Self {
        let climb = direction.dot(profile.rise);
        Self { profile, from, speed: profile.speed_at(from), level: direction - climb * profile.rise, climb }
    }

    /// The arc between two places that are not the same.
    #[must_use]
    pub fn between(profile: SpeedProfile, from: DVec3, to: DVec3) -> Self {
        let offset = to - from;
        let height = offset.dot(profile.rise);
        let level = offset - height * profile.rise;
        let (here, there) = (profile.speed_at(from), profile.speed_at(to));
        // The centre of the circle is where c = 0.
        let climb = profile.gradient * level.length_squared() + (here + there) * height;
        let direction = 2.0 * here * level + climb * profile.rise;
        Self::leaving(profile, from, direction.normalize())
    }

    /// Position after `time` [s].
    #[must_use]
    pub fn at(&self, time: f64) -> DVec3 {
        let SpeedProfile { gradient, rise, .. } = self.profile;
        let turn = gradient * time;
        let half = libm::sinh(0.5 * turn);
        let (across, down) = (libm::sinh(turn) / gradient, 2.0 * half * half / gradient);
        let reach = self.speed / self.slowing(turn);
        self.from + reach * (across * self.level + (self.climb * across - down) * rise)
    }

    /// Unit direction after `time` [s].
    #[must_use]
    pub fn direction(&self, time: f64) -> DVec3 {
        let turn = self.profile.gradient * time;
        let climb = self.climb * libm::cosh(turn) - libm::sinh(turn);
        ((self.level + climb * self.profile.rise) / self.slowing(turn)).normalize()
    }

    /// Speed at the beginning over that after a `turn` of g t.
    fn slowing(&self, turn: f64) -> f64 {
        libm::cosh(turn) - self.climb * libm::sinh(turn)
    }

    /// Longest chord [m].
    fn chord(&self) -> f64 {
        let curvature = self.profile.gradient * self.level.length() / self.speed;
        (8.0 * SAGITTA / curvature).sqrt()
    }

    /// When the chord ends that begins at `time` [s].
    #[must_use]
    pub fn chord_end(&self, time: f64) -> f64 {
        let gradient = self.profile.gradient;
        let speed = self.speed / self.slowing(gradient * time);
        // Until then c grows by no more than the exponential of LARGEST_STEP.
        let fastest = speed * libm::exp(LARGEST_STEP);
        time + (self.chord() / fastest).min(LARGEST_STEP / gradient)
    }

    /// Into how many chords of equal times the first `time` [s] are divided.
    #[must_use]
    pub fn chords(&self, time: f64) -> u32 {
        let turn = self.profile.gradient * time;
        let turns_back = self.climb > 0.0 && self.direction(time).dot(self.profile.rise) < 0.0;
        let fastest = if turns_back {
            self.speed / self.level.length()
        } else {
            self.speed.max(self.speed / self.slowing(turn))
        };
        ((fastest * time / self.chord()).ceil() as u32).clamp(1, MOST_CHORDS)
    }

    /// The ends of these chords but the last.
    pub fn joints(&self, time: f64) -> impl Iterator<Item = DVec3> {
        let chords = self.chords(time);
        (1..chords).map(move |chord| self.at(time * f64::from(chord) / f64::from(chords)))
    }
}

impl Geometry {
    /// The first surface on the straight way from a start towards the end of a chord, or little beyond it. The plane that was left is met
    /// like any other, since an arc may come back to it.
    #[must_use]
    pub fn hit_on_chord(&self, from: Vec3, to: Vec3) -> Option<Hit> {
        let offset = to - from;
        let length = offset.length();
        let hit = self.closest_hit(Departure::free(from), offset / length)?;
        (hit.distance <= length * (1.0 + OVERLAP)).then_some(hit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    /// c and its gradient; a place.
    fn profile(gradient: f64) -> SpeedProfile {
        SpeedProfile::new(340.0, gradient * DVec3::Z).unwrap()
    }

    const PLACES: [DVec3; 5] = [
        dvec3(100.0, -40.0, 3.0),
        dvec3(700.0, 2.0, -1.0),
        dvec3(0.0, 0.0, 25.0),
        dvec3(0.0, 1e-7, -30.0),
        dvec3(1.0, 0.0, 0.0),
    ];

    #[test]
    fn arcs_between_places_reach_them_and_lead_back() {
        for gradient in [1e-9, 0.1, -0.1, 3.0, -3.0] {
            let profile = profile(gradient);
            for to in PLACES {
                let from = dvec3(0.0, 0.0, 2.0);
                let (arc, time) = (Arc::between(profile, from, to), profile.travel_time(from, to));
                assert!(arc.at(time).distance(to) < 1e-9 * to.length().max(1.0), "{gradient} {to}");
                let back = Arc::between(profile, to, from);
                assert!(back.direction(0.0).distance(-arc.direction(time)) < 1e-7, "{gradient} {to}");
                assert!((profile.travel_time(to, from) / time - 1.0).abs() < 1e-14);
                let speeds = profile.speed_at(from) / profile.speed_at(to);
                let symmetric = profile.spread(from, to) / profile.spread(to, from) / speeds.powi(2);
                assert!((symmetric - 1.0).abs() < 1e-12, "c² dΩ/dA is the same both ways");
            }
        }
    }

    #[test]
    fn chords_are_no_farther_from_their_arc_than_their_bound() {
        for gradient in [0.1, -0.1, 3.0, -30.0] {
            let profile = profile(gradient);
            for direction in [dvec3(1.0, 0.0, 0.0), dvec3(0.6, 0.0, 0.8), dvec3(1e-3, 0.0, -1.0)] {
                let arc = Arc::leaving(profile, dvec3(0.0, 0.0, 2.0), direction.normalize());
                let total = 0.2;
                let mut ends = vec![0.0];
                while ends[ends.len() - 1] < total {
                    ends.push(arc.chord_end(ends[ends.len() - 1]));
                }
                let equal = arc.chords(total);
                let even = (0..=equal).map(|part| total * f64::from(part) / f64::from(equal)).collect();
                for times in [ends, even] {
                    let farthest = times.windows(2).map(|ends| {
                        let [start, end] = [arc.at(ends[0]), arc.at(ends[1])];
                        let along = (end - start).normalize();
                        let aside = |share: f64| {
                            let offset = arc.at(ends[0] + share * (ends[1] - ends[0])) - start;
                            (offset - offset.dot(along) * along).length()
                        };
                        (1..10).map(|tenth| aside(f64::from(tenth) / 10.0)).fold(0.0, f64::max)
                    });
                    let farthest = farthest.fold(0.0, f64::max);
                    assert!(farthest <= SAGITTA, "{gradient} {direction}: {farthest}");
                    // Not so short either that the bound means nothing.
                    assert!(times.len() < 3 || farthest > 0.2 * SAGITTA || direction.x < 0.1, "{farthest}");
                }
            }
        }
    }

    #[test]
    fn without_a_gradient_there_is_no_arc() {
        assert_eq!(SpeedProfile::new(340.0, DVec3::ZERO), None);
        let (from, to) = (DVec3::ZERO, dvec3(30.0, 40.0, 0.0));
        let gentle = profile(1e-9);
        assert!((gentle.travel_time(from, to) * 340.0 / 50.0 - 1.0).abs() < 1e-12);
        assert!((gentle.spread(from, to) * 2500.0 - 1.0).abs() < 1e-12);
        assert_eq!(Arc::between(gentle, from, to).chords(0.15), 1);
    }
}
