//! Edges four by four, so that a way or a point is compared with several at once: which of them may be what is looked for.
//!
//! In f32 and without a division, with allowances for rounding: nothing that is looked for is left out, and what is let through is
//! decided exactly elsewhere.

use super::line::EdgeLine;
use super::question::{Point, Ray};
use glam::Vec4;

/// Edges in a block.
pub(super) const LANES: usize = 4;

/// Roundings that heights and distances along lines suffer, in units of the last place of the coordinates. Each is a sum of a few
/// products of two numbers with an error of one or two.
const ALLOWANCE: f32 = 128.0;

/// Up to [`LANES`] edges. Unused lanes repeat the first.
#[derive(Debug, Clone)]
pub(super) struct Block {
    /// Origin and direction, by axis.
    origin: [Vec4; 3],
    along: [Vec4; 3],
    length: Vec4,
    /// Their numbers.
    edges: [u32; LANES],
    count: usize,
}

impl Block {
    /// A block of `edges`, at least one and at most [`LANES`] of those along `lines`.
    pub fn new(edges: &[u32], lines: &[EdgeLine]) -> Self {
        let of = |lane: usize| &lines[edges[if lane < edges.len() { lane } else { 0 }] as usize];
        let gather = |value: &dyn Fn(&EdgeLine) -> f64| {
            Vec4::from_array(std::array::from_fn(|lane| value(of(lane)) as f32))
        };
        Self {
            origin: [0, 1, 2].map(|axis| gather(&|line| line.origin[axis])),
            along: [0, 1, 2].map(|axis| gather(&|line| line.along[axis])),
            length: gather(&|line| line.length),
            edges: std::array::from_fn(|lane| edges.get(lane).copied().unwrap_or(u32::MAX)),
            count: edges.len(),
        }
    }

    /// The edges whose shortest distance from a ray may lie within both and its reach.
    ///
    /// Each is asked times 1 − s², s the slant: the distance along the ray is h s − r then, that along the edge
    /// h (1 − s²) + s (h s − r), and the square of the distance (o² − h²)(1 − s²) − (h s − r)².
    #[inline]
    pub fn beside(&self, ray: &Ray, [from, to]: [f32; 2]) -> impl Iterator<Item = u32> {
        let ([ox, oy, oz], [ax, ay, az]) = (&self.origin, &self.along);
        let ([px, py, pz], [dx, dy, dz]) = (ray.origin, ray.direction);
        let (x, y, z) = (Vec4::splat(px) - ox, Vec4::splat(py) - oy, Vec4::splat(pz) - oz);
        let slant = dx * ax + dy * ay + dz * az;
        let height = x * ax + y * ay + z * az;
        let behind = x * dx + y * dy + z * dz;
        let across = 1.0 - slant * slant;
        let at = height * slant - behind;
        let along = height * across + at * slant;
        let aside = (x * x + y * y + z * z - height * height) * across - at * at;
        let slip = ALLOWANCE * ray.rounding;
        let beside = at.cmpge(from * across - slip)
            & at.cmple(to * across + slip)
            & along.cmpge(Vec4::splat(-2.0 * slip))
            & along.cmple(self.length * across + 2.0 * slip)
            & aside.cmple(ray.reach * ray.reach * across + 4.0 * slip * ray.scale);
        self.named(beside.bitmask())
    }

    /// The edges that may be nearer to a point than the square of a distance [m²].
    #[inline]
    pub fn about(&self, point: &Point, squared: f32) -> impl Iterator<Item = u32> {
        let ([ox, oy, oz], [ax, ay, az]) = (&self.origin, &self.along);
        let [px, py, pz] = point.position;
        let (x, y, z) = (Vec4::splat(px) - ox, Vec4::splat(py) - oy, Vec4::splat(pz) - oz);
        let along = (x * ax + y * ay + z * az).max(Vec4::ZERO).min(self.length);
        let (x, y, z) = (x - along * ax, y - along * ay, z - along * az);
        let slip = ALLOWANCE * point.rounding * point.scale;
        self.named((x * x + y * y + z * z).cmple(Vec4::splat(squared + slip)).bitmask())
    }

    /// All its edges.
    #[inline]
    pub fn all(&self) -> impl Iterator<Item = u32> {
        self.named(u32::MAX)
    }

    /// The edges in the lanes that a mask names.
    #[inline]
    fn named(&self, mask: u32) -> impl Iterator<Item = u32> {
        let edges = self.edges;
        super::question::lanes(mask & ((1 << self.count) - 1)).map(move |lane| edges[lane])
    }
}
