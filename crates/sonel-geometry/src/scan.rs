//! The watertight test of one ray against blocks of triangles.
//!
//! The ray is sheared onto its dominant axis [WoopBenthinWald2013]; two triangles that share an edge then compute the
//! very same edge function with opposite signs, so no ray slips through between them. Where `f32` cannot tell the sign
//! it is settled in `f64`, where the products are exact. Distances are computed in `f64` from the triangles' planes:
//! coplanar triangles get equal distances, and the lowest index wins.

use crate::PlaneId;
use glam::{DVec3, Vec3};

/// Triangles tested together.
pub(crate) const LANES: usize = 16;

/// Corner coordinates of some triangles, by corner and axis. Unused lanes hold NaN, which no test accepts.
#[derive(Clone)]
pub(crate) struct Block {
    corners: [[[f32; LANES]; 3]; 3],
    triangles: [u32; LANES],
    planes: [u32; LANES],
}

impl Block {
    /// A block of at most [`LANES`] triangles: corners (local), index and plane.
    pub fn new(triangles: &[([Vec3; 3], u32, PlaneId)]) -> Self {
        let mut block = Self {
            corners: [[[f32::NAN; LANES]; 3]; 3],
            triangles: [u32::MAX; LANES],
            planes: [u32::MAX; LANES],
        };
        for (lane, (corners, triangle, plane)) in triangles.iter().enumerate() {
            for (corner, position) in corners.iter().enumerate() {
                for axis in 0..3 {
                    block.corners[corner][axis][lane] = position[axis];
                }
            }
            block.triangles[lane] = *triangle;
            block.planes[lane] = plane.0;
        }
        block
    }
}

/// A ray as the test wants it.
pub(crate) struct ShearedRay {
    pub origin: Vec3,
    axes: [usize; 3],
    shear: [f32; 2],
    /// Planes that are not tested.
    pub ignored: [u32; 2],
}

impl ShearedRay {
    /// Prepares a ray; `ignored` planes are passed through.
    pub fn new(origin: Vec3, direction: Vec3, ignored: [Option<PlaneId>; 2]) -> Self {
        let size = direction.abs();
        let z = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        Self {
            origin,
            axes: [x, y, z],
            shear: [direction[x] / direction[z], direction[y] / direction[z]],
            ignored: ignored.map(|plane| plane.map_or(u32::MAX, |plane| plane.0)),
        }
    }

    /// Calls `found` with the triangle and plane of every lane whose triangle the ray's line passes through.
    #[inline(always)]
    pub fn pierce(&self, block: &Block, mut found: impl FnMut(u32, u32)) {
        let sheared = self.shear(block);
        let [[ax, ay], [bx, by], [cx, cy]] = &sheared;
        for lane in 0..LANES {
            let u = edge(cx[lane], cy[lane], bx[lane], by[lane]);
            let v = edge(ax[lane], ay[lane], cx[lane], cy[lane]);
            let w = edge(bx[lane], by[lane], ax[lane], ay[lane]);
            let plane = block.planes[lane];
            if accepts(u, v, w) && !self.ignored.contains(&plane) {
                found(block.triangles[lane], plane);
            }
        }
    }

    /// The corners in ray space, where the ray is the axis x = y = 0.
    #[inline(always)]
    fn shear(&self, block: &Block) -> [[[f32; LANES]; 2]; 3] {
        let [x, y, z] = self.axes;
        let mut sheared = [[[0.0; LANES]; 2]; 3];
        for (corner, out) in block.corners.iter().zip(&mut sheared) {
            for lane in 0..LANES {
                let depth = corner[z][lane] - self.origin[z];
                out[0][lane] = (corner[x][lane] - self.origin[x]) - self.shear[0] * depth;
                out[1][lane] = (corner[y][lane] - self.origin[y]) - self.shear[1] * depth;
            }
        }
        sheared
    }
}

/// Twice the signed area under an edge from p to q, with a sign that is right even where `f32` products cancel.
#[inline(always)]
fn edge(px: f32, py: f32, qx: f32, qy: f32) -> f64 {
    f64::from(px) * f64::from(qy) - f64::from(py) * f64::from(qx)
}

/// Whether no two edge functions have opposite signs and the triangle is not seen edge-on.
#[inline(always)]
fn accepts(u: f64, v: f64, w: f64) -> bool {
    ((u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0)) && u + v + w != 0.0
}

/// A plane in local coordinates.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LocalPlane {
    pub normal: DVec3,
    pub offset: f64,
}

impl LocalPlane {
    /// Distance along a ray at which it meets the plane, in multiples of the direction's length.
    #[inline(always)]
    pub fn distance(&self, origin: DVec3, direction: DVec3) -> f64 {
        (self.offset - self.normal.dot(origin)) / self.normal.dot(direction)
    }
}
