//! Straight ways from the source, or an image of it, to the receiver.

use glam::DVec3;

use super::super::view::Leg;
use super::super::world::World;
use super::super::{Listening, PlaneMirror, Reflection};
use super::find;

/// A straight way to the receiver, and the edges that it meets.
#[derive(Clone)]
pub(crate) struct Course<'a> {
    pub world: &'a World,
    /// Where it seems to come from [m].
    pub origin: DVec3,
    /// Whether it comes from the image in the mirror of its world.
    pub shown: bool,
    /// Whether it is clear.
    pub clear: bool,
    /// What mirrors leave of its amplitude, per band.
    pub mirrored: Vec<f64>,
}

impl<'a> Course<'a> {
    /// The direct path.
    #[must_use]
    pub fn direct(world: &'a World, at: &Listening<'_>) -> Self {
        let mirrored = vec![1.0; at.attenuation.len()];
        Self { world, origin: at.radiator.position, shown: false, clear: at.clear, mirrored }
    }

    /// The path that the mirror of `world` shows, if source and receiver are before it.
    #[must_use]
    pub fn image(world: &'a World, at: &Listening<'_>, reflections: &[Reflection]) -> Option<Self> {
        let mirror = world.mirror.filter(|mirror| is_between(mirror, at))?;
        let origin = mirror.image(at.radiator.position);
        let clear = find(at, reflections, origin).is_some();
        let mirrored = at.specular(&mirror).map(f64::sqrt).collect();
        Some(Self { world, origin, shown: true, clear, mirrored })
    }

    /// The direct path over edges that a mirror shows both the source and the receiver, if they are before it: what that adds, and what is
    /// taken away.
    #[must_use]
    pub fn behind([added, taken]: &'a [World; 2], at: &Listening<'_>) -> Option<[Self; 2]> {
        let mirror = added.mirror.filter(|mirror| is_between(mirror, at))?;
        let of = |world, sign: f64| Self {
            mirrored: at.specular(&mirror).map(|energy| sign * energy).collect(),
            ..Self::direct(world, at)
        };
        Some([of(added, 1.0), of(taken, -1.0)])
    }

    /// It to `receiver` [m].
    #[must_use]
    pub fn leg(&self, receiver: DVec3) -> Leg {
        Leg { source: self.origin, receiver, mirror: self.world.mirror, shown: self.shown }
    }

    /// Whether it is mirrored twice, before the first edge and after the last.
    #[must_use]
    pub fn is_behind(&self) -> bool {
        self.world.mirror.is_some() && !self.shown
    }
}

/// Whether source and receiver are before a mirror.
fn is_between(mirror: &PlaneMirror, at: &Listening<'_>) -> bool {
    [at.radiator.position, at.receiver].into_iter().all(|end| mirror.height(end) > 0.0)
}
