//! Mirrors that sound meets one after the other.

use glam::DVec3;
use sonel_geometry::Geometry;

use super::mirror::{PlaneMirror, feet, reflects};

/// Mirrors in the order in which they are met. Two at a right angle make the same image in either order and are met in either.
#[derive(Debug, Clone, Default)]
pub(crate) struct Chain {
    mirrors: Vec<PlaneMirror>,
}

impl Chain {
    /// Of `mirrors`, the first one that is met first.
    #[must_use]
    pub fn of(mirrors: &[PlaneMirror]) -> Self {
        Self { mirrors: mirrors.to_vec() }
    }

    #[must_use]
    pub fn mirrors(&self) -> &[PlaneMirror] {
        &self.mirrors
    }

    /// Whether `other` is this one.
    #[must_use]
    pub fn is(&self, other: &Self) -> bool {
        self.order() == other.order()
            && self.mirrors.iter().zip(&other.mirrors).all(|(one, other)| one.is(other))
    }

    /// On the way back.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self { mirrors: self.mirrors.iter().rev().copied().collect() }
    }

    /// It and all other orders of its mirrors that make the same image: neighbours at a right angle are met in either order.
    #[must_use]
    pub fn orders(&self) -> Vec<Self> {
        let mut orders = vec![self.clone()];
        let mut looked_at = 0;
        while looked_at < orders.len() {
            for later in 1..self.mirrors.len() {
                let mut order = orders[looked_at].clone();
                order.mirrors.swap(later - 1, later);
                let [one, other] = [later - 1, later].map(|met| &order.mirrors[met]);
                if one.is_across(other) && orders.iter().all(|known| !known.is(&order)) {
                    orders.push(order);
                }
            }
            looked_at += 1;
        }
        orders
    }

    /// Number of reflections.
    #[must_use]
    pub fn order(&self) -> u32 {
        self.mirrors.len() as u32
    }

    /// Whether its two mirrors are met in either order.
    #[must_use]
    pub fn is_either_way(&self) -> bool {
        matches!(&self.mirrors[..], [one, other] if one.is_across(other))
    }

    /// Where what is at `point` seems to be behind all mirrors.
    #[must_use]
    pub fn image(&self, point: DVec3) -> DVec3 {
        self.mirrors.iter().fold(point, |point, mirror| mirror.image(point))
    }

    /// Image of `face` behind all mirrors.
    #[must_use]
    pub fn image_of(&self, face: &PlaneMirror) -> PlaneMirror {
        self.mirrors.iter().fold(*face, |face, mirror| mirror.image_of(&face))
    }

    /// Whether sound can come from `from` to the first mirror, or go from the last one to `to`, as far as their planes are concerned.
    #[must_use]
    pub fn is_met(&self, from: DVec3, to: DVec3) -> bool {
        let is_before =
            |mirrors: &[PlaneMirror], point| mirrors.iter().all(|mirror| mirror.height(point) > 0.0);
        let [first, last] = match &self.mirrors[..] {
            both if self.is_either_way() => [both; 2],
            [first, .., last] => [first, last].map(std::slice::from_ref),
            one => [one; 2],
        };
        is_before(first, from) || is_before(last, to)
    }

    /// All mirrors, each with where the straight way between two places meets it [m]; none where it does not meet all of them.
    #[must_use]
    pub fn feet(&self, from: DVec3, to: DVec3) -> Vec<(PlaneMirror, DVec3)> {
        let in_order = |mirrors: &[PlaneMirror]| -> Option<Vec<(PlaneMirror, DVec3)>> {
            feet(mirrors, from, to).map(|feet| mirrors.iter().copied().zip(feet).collect())
        };
        let back = || in_order(self.reversed().mirrors()).filter(|_| self.is_either_way());
        in_order(&self.mirrors).or_else(back).unwrap_or_default()
    }

    /// Whether sound goes over all mirrors from `from` to `to`.
    #[must_use]
    pub fn reaches(&self, geometry: &Geometry, from: DVec3, to: DVec3) -> bool {
        let back = || [self.mirrors[1], self.mirrors[0]];
        reflects(geometry, &self.mirrors, from, to)
            || self.is_either_way() && reflects(geometry, &back(), from, to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_geometry::{Mesh, Side, SurfaceId};

    /// Mirrors of a rectangular room, by the direction that each is in.
    fn chain(directions: &[DVec3]) -> Chain {
        let geometry = Geometry::build(Mesh::shoebox([5.0, 4.0, 3.0], [0; 6])).unwrap();
        let planes: Vec<PlaneMirror> = (0..geometry.surfaces().len())
            .map(|surface| PlaneMirror::new(&geometry, SurfaceId(surface as u32), Side::Front))
            .collect();
        let mirror = |direction: &DVec3| *planes.iter().find(|p| p.normal().dot(*direction) < -0.9).unwrap();
        Chain::of(&directions.iter().map(mirror).collect::<Vec<PlaneMirror>>())
    }

    #[test]
    fn mirrors_at_right_angles_are_met_in_every_order_and_parallel_ones_in_one() {
        let [x, y, z] = DVec3::AXES;
        for (directions, count) in [
            (vec![x, y, z], 6),
            (vec![x, -x, x], 1),
            (vec![x, y, -x], 3),
            (vec![x, y, -x, -y], 6),
            (vec![x, -x, y, z, -y], 30),
        ] {
            let chain = chain(&directions);
            let orders = chain.orders();
            assert_eq!(orders.len(), count, "{directions:?}");
            let point = DVec3::new(0.3, -0.7, 0.4);
            assert!(orders.iter().all(|order| order.image(point).distance(chain.image(point)) < 1e-9));
            assert!(orders.iter().all(|order| orders.iter().filter(|other| other.is(order)).count() == 1));
        }
    }
}
