//! Receivers, prepared for the estimators.

use glam::{DVec3, Vec3};
use sonel_acoustics::Pattern;
use sonel_geometry::Geometry;
use sonel_map::Lanes;
use sonel_scene::Receiver;

use crate::ball::{AboutReceiver, Balls};
use crate::directions::Axes;
use crate::guided_directions::GuidedDirections;

/// A place where the echogram is wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceiverPoint {
    /// Name.
    pub name: String,
    /// Position in the scene's axes [m].
    pub position: DVec3,
    /// How sensitive it is.
    pub sensitivity: Sensitivity,
}

/// Sensitivity of a receiver over directions, in energy, 1 on its axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitivity {
    /// Pattern about the aim.
    pub pattern: Pattern,
    /// Unit vector. The zero vector is that of an omnidirectional receiver without an aim: it looks at the first source.
    pub aim: DVec3,
}

impl Sensitivity {
    /// The same in every direction.
    pub const OMNI: Self = Self { pattern: Pattern::Omni, aim: DVec3::ZERO };

    /// Sensitivity to what comes from `towards`, seen from the receiver [m].
    #[inline]
    #[must_use]
    pub fn to(&self, towards: DVec3) -> f64 {
        if self.pattern == Pattern::Omni {
            return 1.0;
        }
        self.pattern.sensitivity(self.aim.dot(towards.normalize()).clamp(-1.0, 1.0))
    }
}

impl ReceiverPoint {
    /// An omnidirectional receiver at `position` in the scene's axes [m].
    #[must_use]
    pub fn omni(name: &str, position: DVec3) -> Self {
        Self { name: name.to_owned(), position, sensitivity: Sensitivity::OMNI }
    }
}

impl From<&Receiver> for ReceiverPoint {
    fn from(receiver: &Receiver) -> Self {
        let Receiver { name, position, aim, pattern } = receiver;
        let sensitivity = Sensitivity { pattern: *pattern, aim: *aim };
        Self { name: name.clone(), position: *position, sensitivity }
    }
}

/// A receiver as the estimators see it.
#[derive(Debug, Clone)]
pub(crate) struct PreparedReceiver {
    /// About the scene's centre [m], exact.
    pub exact: DVec3,
    /// The same in the precision of the geometry.
    pub position: Vec3,
    /// The air that stands for the point where segments are counted.
    pub balls: Balls,
    /// Radius h of the discs where its rays end [m].
    pub disc_radius: f64,
    /// Directions of its rays.
    pub directions: GuidedDirections,
    /// Largest cos θ / d² of a sonel that connections take whole [1/m²]; what is beyond is left to rays. Infinite where no surface
    /// is near, or where no rays are cast.
    pub brightest: f64,
    /// cos θ / d² below which sonels of brightness 1 are connected by chance [1/m²].
    pub thinned_below: f64,
    /// Number of the air that it is in, 0 for the scene's.
    pub air: u32,
    /// c₀/c of that air.
    pub stretch: f64,
    /// How sensitive it is.
    pub sensitivity: Sensitivity,
    /// Factors of the [boundary term](crate::boundary), per band; empty without.
    pub boundary: Vec<Lanes>,
    /// Lateral axis, where directions are asked for.
    pub lateral_axis: Option<DVec3>,
}

/// The lateral axes of `receivers`.
#[must_use]
pub(crate) fn axes(receivers: &[PreparedReceiver]) -> Axes {
    Axes::of(receivers.iter().map(|receiver| receiver.lateral_axis))
}

/// Radius of a receiver's sphere at [`REFERENCE_EMISSIONS`], relative to the mean free path [1]. Chosen, not measured; doubled, the O(r²) bias
/// is four times as large and four times as many packets cross the sphere.
const RADIUS_PER_FREE_PATH: f64 = 0.12;
/// Radii shrink as N^(−1/6) from here, so that its O(r²) bias vanishes as fast as the noise (docs/physics.md §4).
pub(crate) const REFERENCE_EMISSIONS: f64 = 50_000.0;
/// Limit below which sonels are thinned, over Σg² / Σg of g = cos θ / d² [1], which doubles the variance that connections bring at most. Intervals are
/// 1 to 2 % wider; with 1 up to 5 % (C50, office) at a tenth less time (church).
const THINNED: f64 = 0.5;
/// Distance within which a surface is near [radii of a disc]: nearer, few sonels bring much, and rays are less noisy than connections. Chosen,
/// not measured.
const NEAR_PER_DISC: f64 = 8.0;

impl PreparedReceiver {
    /// Prepares `receiver`, which has this `about` it, for a map of `emissions` emissions. Where rays gather, surfaces are near by `disc_radius` [m].
    #[must_use]
    pub(crate) fn new(
        receiver: &ReceiverPoint,
        geometry: &Geometry,
        about: AboutReceiver<'_>,
        emissions: u64,
        disc_radius: Option<f64>,
    ) -> Self {
        let shrink = libm::pow((emissions.max(1)) as f64 / REFERENCE_EMISSIONS, -1.0 / 6.0);
        let wanted = RADIUS_PER_FREE_PATH * about.free_path * shrink;
        let nearest = geometry.distance_to_nearest_surface(receiver.position);
        let near = disc_radius.map(|radius| NEAR_PER_DISC * radius).filter(|near| nearest < *near);
        let exact = receiver.position - geometry.center();
        let brightest = near.map_or(f64::INFINITY, |near| 1.0 / (near * near));
        let solid_angles = about.solid_angles.iter().map(|angle| angle.min(brightest));
        let sums = solid_angles.fold([0.0; 2], |[sum, squares], g| [sum + g, squares + g * g]);
        Self {
            position: geometry.to_local(receiver.position),
            balls: Balls::new(geometry, exact, wanted, nearest, about),
            brightest,
            thinned_below: if sums[0] > 0.0 { THINNED * sums[1] / sums[0] } else { 0.0 },
            sensitivity: receiver.sensitivity,
            ..Self::point(exact)
        }
    }

    /// A point that only images are made of, about the scene's centre [m].
    #[must_use]
    pub(crate) fn point(exact: DVec3) -> Self {
        Self {
            exact,
            position: exact.as_vec3(),
            balls: Balls::default(),
            disc_radius: 0.0,
            directions: GuidedDirections::default(),
            brightest: f64::INFINITY,
            thinned_below: 0.0,
            air: 0,
            stretch: 1.0,
            sensitivity: Sensitivity::OMNI,
            boundary: Vec::new(),
            lateral_axis: None,
        }
    }

    /// Whether a surface is so near that connections share with the gather.
    #[must_use]
    pub(crate) fn is_near_surface(&self) -> bool {
        self.brightest.is_finite()
    }

    /// cos θ / d² of what is `projected` = d cos θ [m] and `squared` = d² [m²] away [1/m²]; what is brighter than the limit is left to rays.
    #[inline]
    #[must_use]
    pub(crate) fn solid_angle(&self, projected: f32, squared: f32) -> f64 {
        let squared = f64::from(squared);
        (f64::from(projected) / (squared.sqrt() * squared)).min(self.brightest)
    }

    /// How much of what a place under `solid_angle` (cos θ / d², d by way of mirrors if need be) [1/m²] reflects diffusely is left to rays:
    /// connections bring the rest.
    #[must_use]
    pub(crate) fn followed_share(&self, solid_angle: f64) -> f64 {
        if solid_angle > self.brightest { 1.0 - self.brightest / solid_angle } else { 0.0 }
    }

    /// Whether `position` is so near that rays go on from there instead of gathering.
    #[must_use]
    pub(crate) fn is_near(&self, position: Vec3) -> bool {
        self.is_near_along(f64::from(self.position.distance(position)))
    }

    /// Whether a place at the end of a way of `length` [m] can be near.
    #[must_use]
    pub(crate) fn is_near_along(&self, length: f64) -> bool {
        length * length * self.brightest < 1.0
    }
}
