//! Interaction of a packet with a surface: event and outgoing direction.
//!
//! Specular is an ideal mirror, diffuse is Lambert about the normal on the side of arrival; scattering is a choice per
//! arrival, not a mixture of directions (docs/physics.md §3).

use glam::Vec3;
use sonel_geometry::Side;
use sonel_map::Event;
use sonel_sampling::{Frame, warp};

/// The event that the uniform number `u` selects among the intervals ending at `thresholds` (specular, diffuse,
/// transmitted); beyond the last the packet is absorbed.
#[inline]
#[must_use]
pub fn draw_event(thresholds: &[f64; 3], u: f64) -> Event {
    if u < thresholds[0] {
        Event::Specular
    } else if u < thresholds[1] {
        Event::Diffuse
    } else if u < thresholds[2] {
        Event::Transmitted
    } else {
        Event::Absorbed
    }
}

/// The mirror image of `direction` at a surface with unit `normal` of either sign.
#[inline]
#[must_use]
pub fn mirrored(direction: Vec3, normal: Vec3) -> Vec3 {
    let mirrored = direction.reflect(normal);
    // One Newton step towards unit length: rounding cannot add up over many reflections, and no root or division makes
    // the next ray wait.
    mirrored * (1.5 - 0.5 * mirrored.length_squared())
}

/// A Lambert direction on `side` of the surface with `frame`, from two uniform numbers.
#[inline]
#[must_use]
pub fn scattered(frame: &Frame, side: Side, u: [f32; 2]) -> Vec3 {
    let local = warp::cosine_hemisphere(u);
    frame.outward(match side {
        Side::Front => local,
        Side::Back => local.with_z(-local.z),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_take_their_share_of_the_unit_interval() {
        let thresholds = [0.25, 0.5, 0.75];
        let events: Vec<Event> = [0.0, 0.25, 0.5, 0.75].map(|u| draw_event(&thresholds, u)).to_vec();
        assert_eq!(events, [Event::Specular, Event::Diffuse, Event::Transmitted, Event::Absorbed]);
    }

    #[test]
    fn mirrors_keep_the_angle() {
        let normal = Vec3::new(1.0, 2.0, -2.0) / 3.0;
        let incoming = Vec3::new(-0.6, 0.0, 0.8);
        let outgoing = mirrored(incoming, normal);
        assert!((outgoing.dot(normal) + incoming.dot(normal)).abs() < 1e-6);
        assert!((outgoing - mirrored(incoming, -normal)).length() < 1e-6);
    }

    #[test]
    fn a_million_mirrors_keep_the_length() {
        let normals = [Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, -0.8, 0.6), Vec3::new(1.0, 2.0, -2.0) / 3.0];
        let mut direction = Vec3::new(0.36, 0.48, 0.8);
        for bounce in 0..1_000_000 {
            direction = mirrored(direction, normals[bounce % 3]);
        }
        assert!((direction.length() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn scattering_stays_on_the_side_of_arrival() {
        let frame = Frame::about(Vec3::new(0.0, 0.6, 0.8));
        for step in 0_u16..100 {
            let u = [f32::from(step) / 100.0, f32::from(step * 37 % 100) / 100.0];
            assert!(scattered(&frame, Side::Front, u).dot(frame.normal) > 0.0);
            assert!(scattered(&frame, Side::Back, u).dot(frame.normal) < 0.0);
        }
    }
}
