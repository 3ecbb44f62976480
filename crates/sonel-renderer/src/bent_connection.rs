//! … D R over one edge: from every sonel a way that is bent once and ends at the receiver, chosen at random among all there are.
//!
//! In the plane normal to the edge a packet leaves the sonel at the angle ψ from the edge's direction; its foot is on the circle over
//! sonel and edge, b = r sin ψ from the edge, and the angle θ there is what it takes to reach the receiver. The packet keeps what it
//! has along the edge, so with the ways l₁ before and l₂ behind the foot in that plane
//!
//!   F = e δ/π ∫ dψ cos θ_n p(tan θ; b) (1 + tan² θ) cos² β / (l₂ (l₁ + l₂)),
//!
//! tan β the height between both over l₁ + l₂ and θ_n the angle with the normal that is left. One ψ is drawn for all bands, with the
//! mean of densities that each suit one band, so that the largest weight is bounded by their number. A density that suits a band follows
//! from small angles, where with x = ψ r √(c/L), L = l₁l₂/(l₁ + l₂) and c of the law of bending the integrand is x φ(x (x − B)), B the
//! x of the straight line (negative in shadow) and φ the normal density: see `Proposal`.
//!
//! Ways that are bent more than once, or mirrored besides, are left to the spheres. Where visibility rays turn, they bring these ways, too.
//!
//! References: docs/physics.md §5.2, docs/diffraction.md.

use core::f64::consts::FRAC_PI_2;

use glam::DVec3;
use sonel_diffraction::bending;
use sonel_geometry::{Departure, EdgeLine, Side};
use sonel_map::Lanes;
use sonel_sampling::{Stream, warp};

use crate::alias::AliasTable;
use crate::bending::{Bends, Turn, WayEnd};
use crate::connection::{ClassDeposits, DiffuseSonel};
use crate::receiver::PreparedReceiver;
use crate::render::Medium;

/// Share of the ways that no band suits: drawn evenly over all angles, for what small angles do not foresee.
const EVEN_SHARE: f64 = 0.1;
/// Share of the choices of an edge that ignore how the receiver sees it.
const BLIND_SHARE: f64 = 0.1;
/// B below which what is nearer to the edge than the straight line is drawn evenly.
const CLOSE: f64 = 2.0;
/// Share of the ways beyond the straight line, seen from the edge.
const BEYOND: f64 = 0.5;
/// Share of the ways in the half towards the edge, of those between.
const INNER: f64 = 0.2;

/// What a receiver needs to be reached over edges.
#[derive(Debug)]
pub struct EdgeChoice {
    choice: AliasTable,
    inverse_probability: Vec<f64>,
}

impl EdgeChoice {
    /// Edges are chosen by the angle in which `receiver` (about the scene's centre) sees them.
    #[must_use]
    pub fn new(bends: &Bends, receiver: DVec3) -> Self {
        let angle = |line: &EdgeLine| {
            let [a, b] = [line.origin, line.point(line.length)].map(|end| end - receiver);
            libm::atan2(a.cross(b).length(), a.dot(b))
        };
        let seen: Vec<f64> = bends.lines().iter().map(angle).collect();
        let total = seen.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let blind = BLIND_SHARE / seen.len() as f64;
        let weights: Vec<f64> = seen.iter().map(|seen| (1.0 - BLIND_SHARE) * seen / total + blind).collect();
        let total: f64 = weights.iter().sum();
        Self {
            choice: AliasTable::new(&weights),
            inverse_probability: weights.iter().map(|weight| total / weight).collect(),
        }
    }
}

/// Sonel, edge and receiver in the plane normal to the edge.
struct Plane {
    /// Unit vector from the sonel towards the edge.
    towards: DVec3,
    /// Unit vector across, to the side on which ways pass.
    across: DVec3,
    /// Distance of the edge from the sonel [m].
    radius: f64,
    /// Where the receiver is from the sonel, along both [m].
    target: [f64; 2],
    /// Height of the receiver over the sonel along the edge [m].
    height: f64,
}

/// One way over an edge.
struct BentWay {
    /// Distance of its foot from the edge [m].
    distance: f64,
    /// Where its foot is [m].
    foot: DVec3,
    /// Tangent of the angle by which it is bent.
    tangent: f64,
    /// Unit direction in which it leaves the sonel.
    direction: DVec3,
    /// Length [m].
    length: f64,
    /// (1 + tan² θ) cos² β / (l₂ (l₁ + l₂)) [1/m²].
    spread: f64,
}

impl Plane {
    fn new(line: &EdgeLine, sonel: DVec3, receiver: DVec3, side: Side) -> Option<Self> {
        let flat = |offset: DVec3| offset - offset.dot(line.along) * line.along;
        let inward = flat(line.origin - sonel);
        let radius = inward.length();
        if radius <= 0.0 {
            return None;
        }
        let towards = inward / radius;
        // Counterclockwise about the edge is, seen from the sonel, on the right.
        let across = -side.sign() * line.along.cross(towards);
        let offset = receiver - sonel;
        Some(Self {
            towards,
            across,
            radius,
            target: [offset.dot(towards), offset.dot(across)],
            height: offset.dot(line.along),
        })
    }

    /// The way at the angle `psi`; [`None`] where the receiver is not ahead of its foot, or the foot not on the edge.
    fn way(&self, line: &EdgeLine, sonel: DVec3, psi: f64) -> Option<BentWay> {
        let (sine, cosine) = libm::sincos(psi);
        let before = self.radius * cosine;
        let [x, y] = self.target;
        let (ahead, aside) = (x * cosine + y * sine - before, y * cosine - x * sine);
        if ahead <= 0.0 || before <= 0.0 {
            return None;
        }
        let behind = (ahead * ahead + aside * aside).sqrt();
        let flat = before + behind;
        let rise = self.height / flat;
        let along = (sonel - line.origin).dot(line.along) + rise * before;
        if along <= 0.0 || along >= line.length {
            return None;
        }
        let flat_direction = cosine * self.towards + sine * self.across;
        let level = 1.0 / (1.0 + rise * rise);
        Some(BentWay {
            distance: self.radius * sine,
            foot: sonel + before * (flat_direction + rise * line.along),
            tangent: aside / ahead,
            direction: (flat_direction + rise * line.along) * level.sqrt(),
            length: flat / level.sqrt(),
            spread: behind * level / (ahead * ahead * flat),
        })
    }
}

/// Densities of ψ that suit the bands, small angles presumed.
struct Proposal<'a> {
    bent: &'a [(usize, f64)],
    /// The angle of the straight line to the receiver, negative where it passes on the other side.
    straight: f64,
    /// r² / L [1/m], so that the square of x over ψ is c times this.
    scale: f64,
    /// Largest angle at which any band is bent.
    widest: f64,
}

impl<'a> Proposal<'a> {
    /// For the bands that `edge` bends; [`None`] where it bends none.
    fn new(plane: &Plane, bends: &'a Bends, edge: u32) -> Option<Self> {
        // Bands ascend: an edge that bends one bends all shorter waves.
        let first = bends.bent().partition_point(|&(band, _)| !bends.may_bend(band, edge));
        let bent = &bends.bent()[first..];
        let reach = bent.iter().map(|&(band, _)| bends.reach_of_band(band)).fold(0.0, f64::max);
        if reach <= 0.0 {
            return None;
        }
        let [x, y] = plane.target;
        let beyond = libm::hypot(x - plane.radius, y).max(f64::MIN_POSITIVE);
        let widest = if reach < plane.radius { libm::asin(reach / plane.radius) } else { FRAC_PI_2 };
        Some(Self {
            bent,
            straight: libm::atan2(y, x),
            scale: plane.radius * (plane.radius + beyond) / beyond,
            widest,
        })
    }

    /// x per radian, and B, of a band with `concentration`.
    fn of_band(&self, concentration: f64) -> (f64, f64) {
        let stretch = (concentration * self.scale).sqrt();
        (stretch, stretch * self.straight)
    }

    /// An angle for all bands: evenly, or one that suits one of them.
    fn draw(&self, stream: &mut Stream) -> f64 {
        let (choice, u, v) = (stream.uniform_fine(), stream.uniform_fine(), stream.uniform_fine());
        let [normal, _] = warp::normal_pair(stream.uniform_pair());
        if choice < EVEN_SHARE {
            return u * self.widest;
        }
        let band = ((choice - EVEN_SHARE) / (1.0 - EVEN_SHARE) * self.bent.len() as f64) as usize;
        let (_, concentration) = self.bent[band.min(self.bent.len() - 1)];
        self.suiting(concentration, [u, v], normal.abs())
    }

    /// Density of [`Self::draw`].
    fn density(&self, psi: f64) -> f64 {
        let sum: f64 =
            self.bent.iter().map(|&(_, concentration)| self.density_suiting(concentration, psi)).sum();
        EVEN_SHARE / self.widest + (1.0 - EVEN_SHARE) * sum / self.bent.len() as f64
    }

    /// An angle that suits a band, from two uniform numbers and the size of a normal one.
    fn suiting(&self, concentration: f64, [u, v]: [f64; 2], normal: f64) -> f64 {
        let (stretch, line) = self.of_band(concentration);
        let x = if line <= 0.0 || u < BEYOND {
            0.5 * (line + (line * line + 4.0 * normal).sqrt())
        } else if line < CLOSE {
            v * line
        } else if v < INNER {
            within_half(2.0 * normal / line, line, false)
        } else {
            within_half(2.0 * normal / line, line, true)
        };
        x / stretch
    }

    /// Density of [`Self::suiting`].
    fn density_suiting(&self, concentration: f64, psi: f64) -> f64 {
        let (stretch, line) = self.of_band(concentration);
        let x = stretch * psi;
        let both = |normal: f64| 2.0 * FRAC_1_ROOT_TAU * libm::exp(-0.5 * normal * normal);
        let density = if line <= 0.0 || x > line {
            let beyond = both(x * (x - line)) * (2.0 * x - line);
            if line <= 0.0 { beyond } else { BEYOND * beyond }
        } else if line < CLOSE {
            (1.0 - BEYOND) / line
        } else {
            let (share, from_end) = if x < 0.5 * line { (INNER, x) } else { (1.0 - INNER, line - x) };
            (1.0 - BEYOND) * share * both(0.5 * line * from_end) * 0.5 * line
        };
        density * stretch
    }
}

/// A distance from either end of the line; beyond its middle there is nothing to be found.
fn within_half(from_end: f64, line: f64, outer: bool) -> f64 {
    if from_end > 0.5 * line {
        f64::INFINITY
    } else if outer {
        line - from_end
    } else {
        from_end
    }
}

/// 1/√(2π).
const FRAC_1_ROOT_TAU: f64 = 0.398_942_280_401_432_7;

/// Connects one sonel to `receiver`, number `index` of the deposits, over one of the edges.
pub fn connect_bent(
    sonel: &DiffuseSonel<'_>,
    (index, receiver, choice): (usize, &PreparedReceiver, &EdgeChoice),
    medium: &Medium<'_>,
    stream: &mut Stream,
    scratch: &mut [Lanes],
    deposits: &mut ClassDeposits<'_>,
) {
    let Some(bends) = medium.bends else { return };
    let edge = choice.choice.choose(stream.uniform_fine());
    let (line, edge) = (&bends.lines()[edge], edge as u32);
    let side = if stream.bits() & 1 == 0 { Side::Front } else { Side::Back };
    let from = sonel.position.as_dvec3();
    let Some(plane) = Plane::new(line, from, receiver.exact, side) else { return };
    let Some(proposal) = Proposal::new(&plane, bends, edge) else { return };
    let psi = proposal.draw(stream);
    if psi.is_nan() || psi <= 0.0 || psi >= proposal.widest {
        return;
    }
    let Some(way) = plane.way(line, from, psi) else { return };
    let (cosine, length) = (way.direction.dot(sonel.normal.as_dvec3()), sonel.length + way.length);
    let Some(bin) = medium.bins.bin(length) else { return };
    if cosine <= 0.0 {
        return;
    }
    // Each side is drawn half of the times.
    let inverse = 2.0 * choice.inverse_probability[edge as usize] / proposal.density(psi);
    let weight = inverse * cosine * way.spread;
    scratch.fill([0.0; 4]);
    let turn = Turn { edge, foot: way.foot, distance: way.distance, before: way.direction };
    let seen = bends.sizes_seen(&turn, way.tangent);
    for &(band, concentration) in bends.bent() {
        if bends.bends(band, way.distance, seen.before) {
            let density =
                bending::density(way.tangent, concentration, way.distance) * bends.preference(band, &seen);
            scratch[band / 4][band % 4] = sonel.radiosity[band / 4][band % 4] * density * weight;
        }
    }
    let is_nothing = |energy: &[Lanes]| energy.iter().flatten().all(|&energy| energy <= 0.0);
    let foot = way.foot.as_vec3();
    if is_nothing(scratch)
        || medium.geometry.is_blocked(sonel.departure, foot)
        || medium.geometry.is_blocked(Departure::free(foot), receiver.position)
    {
        return;
    }
    let ends = [WayEnd::at_surface(from, cosine), WayEnd::in_air(receiver.exact)];
    bends.keep_turned(medium.geometry, ends, &[turn], scratch);
    deposits.add(index, bin, length, scratch, medium);
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_geometry::{Geometry, Mesh, MeshTriangle};
    use sonel_map::EdgeTable;
    use sonel_sampling::{Purpose, StreamFamily};
    use sonel_testkit::analytic::knife_edge::kirchhoff;
    use sonel_testkit::z_test::{Estimate, Within, within_sigmas};

    /// An edge along y at the origin, a sonel 10 m before it, and a receiver 10 m behind it at `height`.
    fn plane(height: f64, aside: f64) -> (EdgeLine, DVec3, DVec3, Plane) {
        let line = EdgeLine::new([DVec3::new(0.0, -1e3, 0.0), DVec3::new(0.0, 1e3, 0.0)]);
        let (sonel, receiver) = (DVec3::new(-10.0, 0.0, 0.0), DVec3::new(10.0, aside, height));
        // Over the edge, which is counterclockwise about y.
        let plane = Plane::new(&line, sonel, receiver, Side::Front).unwrap();
        (line, sonel, receiver, plane)
    }

    fn bends(wavelengths: &[f64]) -> Bends {
        // A sheet below the edge makes it one.
        let corners = [[0.0, -1e3, 0.0], [0.0, 1e3, 0.0], [0.0, 0.0, -1e3]];
        let mesh = Mesh {
            vertices: corners.map(DVec3::from).to_vec(),
            triangles: vec![MeshTriangle { corners: [0, 1, 2], material: 0 }],
        };
        let geometry = Geometry::build(mesh).unwrap();
        let index = sonel_map::bending_edges(&geometry, wavelengths);
        let table = EdgeTable::of(&index, wavelengths, &sonel_map::edges::whole_reach(wavelengths));
        Bends::new(&geometry, &table, wavelengths.len())
    }

    /// What a way at `psi` brings in a band of `concentration`, relative to the free field over the straight distance.
    fn integrand(of: &(EdgeLine, DVec3, DVec3, Plane), concentration: f64, psi: f64) -> f64 {
        let (line, sonel, receiver, plane) = of;
        plane.way(line, *sonel, psi).map_or(0.0, |way| {
            let density = bending::density(way.tangent, concentration, way.distance);
            density * way.spread * sonel.distance_squared(*receiver)
        })
    }

    fn behind(of: &(EdgeLine, DVec3, DVec3, Plane), wavelength: f64) -> f64 {
        let (steps, concentration) = (400_000, bending::concentration(wavelength));
        let widest = libm::asin(bending::REACH * wavelength / 10.0);
        let width = widest / f64::from(steps);
        (0..steps).map(|step| integrand(of, concentration, (f64::from(step) + 0.5) * width) * width).sum()
    }

    /// Source and receiver 10 m from the edge, deflections below 30°, level and slanting along the edge.
    #[test]
    fn ways_over_a_knife_edge_add_up_to_kirchhoffs() {
        for (fresnel, wavelength) in [(0.0, 0.1_f64), (1.0, 0.1), (2.0, 0.1), (5.0, 0.05), (10.0, 0.025)] {
            let height = -depth(fresnel * fresnel * wavelength / 4.0);
            assert!(height > -5.7, "deflections below 30°");
            for aside in [0.0, 8.0] {
                let level = 10.0 * behind(&plane(height, aside), wavelength).log10();
                let exact = 10.0 * kirchhoff(fresnel).log10();
                assert!((level - exact).abs() < 0.5, "{fresnel}, {aside} m aside: {level} dB, {exact} dB");
            }
        }
        let spoilt = 10.0 * (2.0 * behind(&plane(-depth(0.025), 0.0), 0.1)).log10();
        assert!((spoilt - 10.0 * kirchhoff(1.0).log10()).abs() > 0.5, "twice the energy is rejected");
    }

    /// How far below the edge the receiver is for a way over the edge that is longer than the straight one by `detour`, which is
    /// ν²λ/4 [m].
    fn depth(detour: f64) -> f64 {
        let longer = |depth: f64| 10.0 + depth.hypot(10.0) - depth.hypot(20.0);
        let (mut low, mut high) = (0.0, 10.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if longer(middle) < detour { low = middle } else { high = middle }
        }
        low
    }

    /// Shared draws say in every band what adding up says, in shadow and in light, with weights that stay small.
    #[test]
    fn drawn_ways_bring_on_average_what_all_bring() {
        let wavelengths = [2.7, 0.34, 0.086];
        let bends = bends(&wavelengths);
        let mut stream = StreamFamily::new(5, Purpose::BendChoice, [0; 4]).stream(0);
        for height in [-4.0, -1.0, 0.0, 0.4, 3.0] {
            let of = plane(height, 3.0);
            let proposal = Proposal::new(&of.3, &bends, 0).unwrap();
            let drawn: Vec<f64> = (0..60_000).map(|_| proposal.draw(&mut stream)).collect();
            for wavelength in wavelengths {
                let concentration = bending::concentration(wavelength);
                let widest = libm::asin((bending::REACH * wavelength / 10.0).min(1.0));
                let weight = |psi: f64| {
                    let within = psi > 0.0 && psi < widest;
                    if within { integrand(&of, concentration, psi) / proposal.density(psi) } else { 0.0 }
                };
                let samples: Vec<f64> = drawn.iter().map(|&psi| weight(psi)).collect();
                let expected = if wavelength < 2.0 { behind(&of, wavelength) } else { wide(&of, wavelength) };
                let largest = samples.iter().copied().fold(0.0, f64::max);
                assert!(largest <= 8.0, "{height} m, {wavelength} m: a weight of {largest}");
                let estimate = Estimate::of(&samples);
                // Far in the light a short wave passes out of reach: nothing is bent.
                if expected < 1e-9 {
                    assert!(estimate.value < 1e-6);
                    continue;
                }
                let within = Within { sigmas: 4.0, maximal_sigma: 0.05 * expected };
                within_sigmas(estimate, expected, within).unwrap();
                let spoilt = Within { sigmas: 4.0, maximal_sigma: f64::INFINITY };
                assert!(within_sigmas(estimate, 1.25 * expected, spoilt).is_err(), "another sum is rejected");
            }
        }
    }

    /// As [`behind`] where the reach is beyond the sonel.
    fn wide(of: &(EdgeLine, DVec3, DVec3, Plane), wavelength: f64) -> f64 {
        let (steps, concentration) = (400_000, bending::concentration(wavelength));
        let width = FRAC_PI_2 / f64::from(steps);
        (0..steps).map(|step| integrand(of, concentration, (f64::from(step) + 0.5) * width) * width).sum()
    }
}
