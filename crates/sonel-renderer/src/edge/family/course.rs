//! Straight ways from the source, or an image of it, to the receiver.

use glam::DVec3;

use super::super::chain::Chain;
use super::super::image::SourceImage;
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
    /// Whether it is clear.
    pub clear: bool,
    /// What mirrors leave of its amplitude, per band.
    pub mirrored: Vec<f64>,
    /// Where it comes from [m].
    source: DVec3,
}

impl<'a> Course<'a> {
    /// The direct path.
    #[must_use]
    pub fn direct(world: &'a World, at: &Listening<'_>) -> Self {
        let mirrored = vec![1.0; at.attenuation.len()];
        let source = at.radiator.position;
        Self { world, origin: source, clear: at.clear, mirrored, source }
    }

    /// The path that the mirrors of `world` show, if the source or the receiver is before them.
    #[must_use]
    pub fn image(world: &'a World, at: &Listening<'_>, reflections: &[Reflection]) -> Option<Self> {
        let source = at.radiator.position;
        if !world.shown.is_met(source, at.receiver) {
            return None;
        }
        let origin = world.shown.image(source);
        let clear = find(at, reflections, &SourceImage::in_mirrors(origin, &world.shown)).is_some();
        let mut mirrored = vec![1.0; at.attenuation.len()];
        for mirror in mirrors_at_feet(&world.shown, at) {
            let left = at.specular(&mirror).map(f64::sqrt);
            mirrored.iter_mut().zip(left).for_each(|(product, left)| *product *= left);
        }
        Some(Self { world, origin, clear, mirrored, source })
    }

    /// The direct path over edges that a mirror shows both the source and the receiver, if they are before it: what that adds, and what is
    /// taken away.
    #[must_use]
    pub fn behind([added, taken]: &'a [World; 2], at: &Listening<'_>) -> Option<[Self; 2]> {
        let mirror = added.behind.filter(|mirror| is_between(mirror, at))?;
        let of = |world, sign: f64| Self {
            mirrored: at.specular(&mirror).map(|energy| sign * energy).collect(),
            ..Self::direct(world, at)
        };
        Some([of(added, 1.0), of(taken, -1.0)])
    }

    /// It to `receiver` [m].
    #[must_use]
    pub fn leg(&self, receiver: DVec3) -> Leg<'a> {
        Leg { source: self.origin, origin: self.source, receiver, shown: &self.world.shown }
    }

    /// What is seen of the source.
    #[must_use]
    pub fn seen(&self) -> SourceImage {
        SourceImage::in_mirrors(self.origin, &self.world.shown)
    }

    /// Number of reflections.
    #[must_use]
    pub fn order(&self) -> u32 {
        self.world.shown.order()
    }
}

/// The mirrors of `chain`, each with the surface that the source is seen in.
pub(crate) fn mirrors_at_feet(chain: &Chain, at: &Listening<'_>) -> Vec<PlaneMirror> {
    let feet = chain.feet(at.radiator.position, at.receiver);
    if feet.is_empty() {
        return chain.mirrors().to_vec();
    }
    feet.into_iter().map(|(mirror, foot)| mirror.at(at.geometry, foot)).collect()
}

/// Whether source and receiver are before a mirror.
fn is_between(mirror: &PlaneMirror, at: &Listening<'_>) -> bool {
    [at.radiator.position, at.receiver].into_iter().all(|end| mirror.height(end) > 0.0)
}
