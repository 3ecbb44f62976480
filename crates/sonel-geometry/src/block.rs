//! The watertight test of one ray against a block of triangles.
//!
//! The ray is sheared onto its dominant axis [WoopBenthinWald2013]; two triangles that share an edge then compute the
//! very same edge function with opposite signs, so no ray slips through between them. All lanes of a block are tested
//! in `f32`; rounding keeps the order of products, so an edge function that comes out with one sign is never of the
//! other, and zero leaves the question open. The few triangles that pass are settled in `f64`, where the products are
//! exact.

use crate::PlaneId;
use crate::probe::Probe;
use glam::Vec3;

/// Corner coordinates of up to `N` triangles. Unused lanes hold NaN, which no test accepts.
#[derive(Clone)]
pub(crate) struct Block<const N: usize> {
    /// By corner, axis and lane.
    corners: [[[f32; N]; 3]; 3],
    triangles: [u32; N],
    planes: [u32; N],
}

/// One triangle as the index wants it: local corners, index and plane.
#[derive(Clone, Copy)]
pub(crate) struct Facet {
    pub corners: [Vec3; 3],
    pub triangle: u32,
    pub plane: PlaneId,
}

/// A triangle of a block that the line of the ray passes through.
#[derive(Clone, Copy)]
pub(crate) struct Pierced {
    pub triangle: u32,
    pub plane: u32,
    /// Whether the ray arrives on the triangle's back.
    pub from_behind: bool,
    /// Barycentric coordinates of the point.
    pub weights: [f32; 3],
}

impl<const N: usize> Block<N> {
    /// A block of at most `N` triangles.
    pub(crate) fn new(facets: &[Facet]) -> Self {
        let mut block =
            Self { corners: [[[f32::NAN; N]; 3]; 3], triangles: [u32::MAX; N], planes: [u32::MAX; N] };
        for (lane, facet) in facets.iter().enumerate() {
            for (corner, position) in facet.corners.iter().enumerate() {
                for axis in 0..3 {
                    block.corners[corner][axis][lane] = position[axis];
                }
            }
            block.triangles[lane] = facet.triangle;
            block.planes[lane] = facet.plane.0;
        }
        block
    }

    /// The triangles in its lanes.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = u32> {
        self.triangles.into_iter().filter(|&triangle| triangle != u32::MAX)
    }

    /// Calls `found` for every triangle that the line of the ray passes through, unless its plane is ignored.
    #[inline(always)]
    pub(crate) fn pierce(&self, ray: &Probe, mut found: impl FnMut(Pierced)) {
        let sheared = self.shear(ray);
        let candidates = candidates(&sheared, 0.0);
        for (group, marks) in candidates.chunks(8).enumerate() {
            let mut word = [0; 8];
            word[..marks.len()].copy_from_slice(marks);
            let mut left = u64::from_le_bytes(word);
            while left != 0 {
                let lane = 8 * group + left.trailing_zeros() as usize / 8;
                left &= left - 1;
                let plane = self.planes[lane];
                if plane == ray.ignored[0] || plane == ray.ignored[1] {
                    continue;
                }
                let sides = exact(&sheared, lane);
                let doubled_area: f64 = sides.iter().sum();
                if doubled_area != 0.0 {
                    let from_behind = (doubled_area < 0.0) == ray.upward;
                    let weights = sides.map(|side| (side / doubled_area) as f32);
                    found(Pierced { triangle: self.triangles[lane], plane, from_behind, weights });
                }
            }
        }
    }

    /// Whether `visit` is true of any triangle that the line of the ray passes through, or beside by less than `slack` [m²] in an edge
    /// function, unless its plane is ignored.
    #[inline(always)]
    pub(crate) fn any_near(&self, ray: &Probe, slack: f32, mut visit: impl FnMut(u32) -> bool) -> bool {
        let candidates = candidates(&self.shear(ray), slack);
        (0..N).any(|lane| {
            let plane = self.planes[lane];
            let is_met = candidates[lane] != 0 && plane != ray.ignored[0] && plane != ray.ignored[1];
            is_met && visit(self.triangles[lane])
        })
    }

    /// The corners in ray space, where the ray is the axis x = y = 0: by corner, axis and lane.
    #[inline(always)]
    fn shear(&self, ray: &Probe) -> [[[f32; N]; 2]; 3] {
        let [x, y, z] = ray.axes;
        let (ox, oy, oz) = (ray.origin[x], ray.origin[y], ray.origin[z]);
        let mut sheared = [[[0.0; N]; 2]; 3];
        for (corner, out) in self.corners.iter().zip(&mut sheared) {
            let (cx, cy, cz) = (&corner[x], &corner[y], &corner[z]);
            for lane in 0..N {
                let depth = cz[lane] - oz;
                out[0][lane] = (cx[lane] - ox) - ray.shear[0] * depth;
                out[1][lane] = (cy[lane] - oy) - ray.shear[1] * depth;
            }
        }
        sheared
    }
}

/// Lanes (marked 1) whose edge functions do not certainly differ in sign; each is uncertain by `slack` beyond its rounding.
#[inline(always)]
fn candidates<const N: usize>(sheared: &[[[f32; N]; 2]; 3], slack: f32) -> [u8; N] {
    let [[ax, ay], [bx, by], [cx, cy]] = sheared;
    let mut pass = [0; N];
    for lane in 0..N {
        let u = cx[lane] * by[lane] - cy[lane] * bx[lane];
        let v = ax[lane] * cy[lane] - ay[lane] * cx[lane];
        let w = bx[lane] * ay[lane] - by[lane] * ax[lane];
        let low = lesser(lesser(u, v), w);
        let high = greater(greater(u, v), w);
        pass[lane] = u8::from((low >= -slack) | (high <= slack));
    }
    pass
}

/// The edge functions opposite the corners if the ray passes through the triangle or its rim, else zeros; their sum is twice its signed area
/// in ray space.
#[inline(always)]
fn exact<const N: usize>(sheared: &[[[f32; N]; 2]; 3], lane: usize) -> [f64; 3] {
    let [a, b, c] = sheared.each_ref().map(|corner| [f64::from(corner[0][lane]), f64::from(corner[1][lane])]);
    let edge = |p: [f64; 2], q: [f64; 2]| p[0] * q[1] - p[1] * q[0];
    let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
    let one_sided = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
    if one_sided { [u, v, w] } else { [0.0; 3] }
}

/// The lesser of two numbers in one instruction; `f32::min` spends three on NaN.
#[inline(always)]
pub(crate) fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater of two numbers in one instruction.
#[inline(always)]
pub(crate) fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
