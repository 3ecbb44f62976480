//! What one edge of a solid sends where it goes out of sight behind a face.
//!
//! A receiver that crosses the plane of a face beyond its far edge sees the near edge no more; what it heard from there comes over the far
//! edge from now on, by second order. Where that is left out the first order falls to nothing towards the plane, whole where the boundary of
//! its wave is, and the same with source and receiver exchanged.

use std::f64::consts::{FRAC_PI_6, PI};

use sonel_diffraction::{Wedge, WedgePoint};

/// Angle from the plane of a face [rad] from which on an edge is heard whole.
const WHOLE: f64 = FRAC_PI_6;

/// The share of the amplitude over one edge that is kept: 0 in the planes of its faces … 1.
#[must_use]
pub(crate) fn kept(wedge: &Wedge, source: WedgePoint, receiver: WedgePoint) -> f64 {
    if wedge.is_rim() {
        return 1.0;
    }
    let ends = [[source, receiver], [receiver, source]];
    ends.into_iter()
        .map(|[one, other]| {
            let turned = wedge.angle();
            off(one.angle, other.angle) * off(turned - one.angle, turned - other.angle)
        })
        .product()
}

/// The same for an end at `angle` from a face [rad], the other end at `opposite`.
fn off(angle: f64, opposite: f64) -> f64 {
    let boundary = (opposite - PI).abs().min(WHOLE);
    let share = if angle < boundary { (angle / boundary).max(0.0) } else { 1.0 };
    share * share * (3.0 - 2.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn an_edge_is_whole_on_its_boundary_and_nothing_in_the_planes_of_its_faces() {
        let ends = [dvec3(0.0, 0.0, 0.0), dvec3(1.0, 0.0, 0.0)];
        let angle = 1.5 * PI;
        let wedge = Wedge::new(ends, glam::DVec3::NEG_Z, glam::DVec3::NEG_Y, angle).unwrap();
        let at = |angle: f64| WedgePoint { radius: 1.0, angle, along: 0.5 };
        for source in [0.01, 0.2, 1.0, 1.5] {
            assert!(kept(&wedge, at(source), at(source + PI)) > 1.0 - 1e-12, "{source}");
            assert!(kept(&wedge, at(source), at(angle - 1e-9)) < 1e-6, "{source}");
            let [there, back] = [(source, 4.6), (4.6, source)].map(|(s, r)| kept(&wedge, at(s), at(r)));
            assert!((there - back).abs() < 1e-12, "{source}");
        }
        assert!(kept(&wedge, at(2.0), at(2.5)) > 1.0 - 1e-12);
    }
}
