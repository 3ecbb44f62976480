//! Visibility rays: where a receiver looks, directly and by mirrors.

use glam::{DVec2, DVec3, Vec3};
use sonel_geometry::{Departure, Geometry, Hit, SurfaceId};
use sonel_map::{CoefficientTable, Lanes};
use sonel_sampling::{ScrambledSobol, Stream, warp};

use super::disc::{Sheet, View};
use super::turning::{Look, Turning};
use crate::bending::{Bends, Turn, WayEnd};
use crate::connection::normal_on;
use crate::receiver::PreparedReceiver;
use crate::render::Medium;

/// How rays gather.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GatherSettings {
    /// Rays of one receiver in one batch.
    pub rays: u32,
    /// Radius h of the discs [m].
    pub radius: f64,
    /// Longest path that matters [m].
    pub reach: f64,
    /// Whether rays go on by mirrors; else they gather near surfaces only.
    pub by_mirrors: bool,
}

/// Turns weigh bands differently: a ray that carries so many times what it left with goes on in parts.
const HEAVY: f64 = 4.0;

/// One disc that gathers.
#[derive(Debug, Clone)]
pub struct GatherPoint {
    /// Number of the receiver.
    pub receiver: u32,
    /// Surface and side, as [`place`] numbers them.
    pub place: u32,
    /// Centre in the plane of the surface [m].
    pub centre: DVec2,
    /// Length of the ray [m].
    pub length: f64,
    /// What the disc sees of its surface.
    pub view: View,
    /// (4π/M) · T · δ / (π A) per band, times the share that is gathered [1/m²].
    pub weight: Vec<Lanes>,
    /// Whether the receiver sees it without a mirror: it gathers only what connections leave.
    pub seen_directly: bool,
}

/// Number of a surface's side.
#[inline]
#[must_use]
pub fn place(surface: SurfaceId, side: sonel_geometry::Side) -> u32 {
    2 * surface.0 + u32::from(side == sonel_geometry::Side::Back)
}

/// Casts the rays of one receiver in one batch and hands every disc to `found`. Where edges bend, rays that go on by mirrors turn at them,
/// and a ray carries the bands alone that come its way. `stream` is that of the receiver and batch.
pub fn cast(
    medium: &Medium<'_>,
    table: &CoefficientTable,
    sheets: &[Sheet],
    receiver: (u32, &PreparedReceiver),
    settings: &GatherSettings,
    stream: &mut Stream,
    mut found: impl FnMut(GatherPoint),
) {
    let directions = ScrambledSobol::from_keys([stream.bits(), stream.bits()]);
    let mut rays: Vec<Ray> = Vec::new();
    for number in 0..settings.rays {
        rays.push(Ray::new(receiver.1, warp::uniform_sphere(directions.point(number)), settings, table));
        while let Some(mut ray) = rays.pop() {
            let Some(hit) = ray.arrive(medium, settings, stream, &mut rays) else { continue };
            let surface = medium.geometry.surface(hit.surface);
            let row = table.material(surface.material);
            let normal = normal_on(hit.side, surface.normal.as_vec3().normalize());
            let share = match (row.is_mirror, ray.is_connected()) {
                (true, _) => 0.0,
                (false, true) => receiver.1.gathered_share(hit.position, normal),
                (false, false) => 1.0,
            };
            if share > 0.0 || settings.by_mirrors {
                ray.keep(medium, &hit, normal);
            }
            if share > 0.0 && ray.weight() > 0.0 {
                let sheet = &sheets[hit.surface.0 as usize];
                let centre = sheet.flat(hit.position.as_dvec3());
                let view = sheet.view(hit.side, centre, settings.radius);
                let weight = product(&ray.throughput, &row.diffuse.energy, share / view.area);
                found(GatherPoint {
                    receiver: receiver.0,
                    place: place(hit.surface, hit.side),
                    centre,
                    length: ray.length,
                    weight,
                    view,
                    seen_directly: ray.reflections == 0,
                });
            }
            if settings.by_mirrors && ray.reflect(medium, &hit, normal, &row.specular.energy, stream) {
                match medium.bends {
                    Some(_) => rays.extend(ray.balanced(settings, stream)),
                    None => rays.push(ray),
                }
            }
        }
    }
}

/// A visibility ray, going against the packets.
#[derive(Clone)]
struct Ray {
    departure: Departure,
    direction: Vec3,
    /// Where it goes on from, about the scene's centre [m].
    at: DVec3,
    /// Per band.
    throughput: Vec<Lanes>,
    /// Its way so far [m].
    length: f64,
    reflections: u32,
    /// Where packets on this way end.
    end: WayEnd,
    /// Where it turned since it left that.
    turns: Vec<Turn>,
}

impl Ray {
    fn new(
        receiver: &PreparedReceiver,
        direction: Vec3,
        settings: &GatherSettings,
        table: &CoefficientTable,
    ) -> Self {
        Self {
            departure: Departure::free(receiver.position),
            direction,
            at: receiver.exact,
            throughput: vec![[4.0 / f64::from(settings.rays); 4]; sonel_map::lanes_of(table.bands())],
            length: 0.0,
            reflections: 0,
            end: WayEnd::in_air(receiver.exact),
            turns: Vec::new(),
        }
    }

    /// Goes straight on to the next surface, and leaves what turns at edges on the way with the other `rays`; [`None`] where nothing
    /// comes from there within reach.
    fn arrive(
        &mut self,
        medium: &Medium<'_>,
        settings: &GatherSettings,
        stream: &mut Stream,
        rays: &mut Vec<Self>,
    ) -> Option<Hit> {
        let hit = medium.geometry.closest_hit(self.departure, self.direction)?;
        let distance = f64::from(self.departure.origin.distance(hit.position));
        if let Some(bends) = medium.bends.filter(|_| settings.by_mirrors) {
            self.turn(medium.geometry, bends, settings, distance, stream, rays);
            if self.weight() <= 0.0 {
                return None;
            }
        }
        self.length += distance;
        (self.length <= settings.reach).then_some(hit)
    }

    /// Leaves what turns on the way of `distance` [m] to the next surface with the other `rays`, and keeps the rest.
    fn turn(
        &mut self,
        geometry: &Geometry,
        bends: &Bends,
        settings: &GatherSettings,
        distance: f64,
        stream: &mut Stream,
        rays: &mut Vec<Self>,
    ) {
        let from = if self.turns.is_empty() { self.end.lifted(bends.least_distance()) } else { 0.0 };
        let direction = self.direction.as_dvec3().normalize();
        let look = Look { origin: self.at, direction, part: [from, distance] };
        let Some(turning) = Turning::new(geometry, bends, look, &self.turns, &self.throughput) else {
            return;
        };
        // What turns is known to come this way or not when a surface is met: no ray turns in parts.
        let parts = (turning.expected * f64::from(settings.rays) / 4.0 / HEAVY).min(1.0);
        for _ in 0..copies(parts, stream) {
            let mut turned = self.clone();
            turned.throughput.iter_mut().flatten().for_each(|energy| *energy /= parts);
            let turn = turning.turn(geometry, bends, &self.turns, &mut turned.throughput, stream);
            if let Some(turn) = turn {
                turned.length += self.at.distance(turn.foot);
                turned.at = turn.foot;
                turned.departure = Departure::free(turn.foot.as_vec3());
                turned.direction = -turn.before.as_vec3();
                turned.turns.push(turn);
                rays.push(turned);
            }
        }
        turning.keep_straight(&mut self.throughput);
    }

    /// The most that it carries of any band.
    fn weight(&self) -> f64 {
        self.throughput.iter().flatten().copied().fold(0.0, f64::max)
    }

    /// Several of it that carry less each, where it carries much more than when it left, and few where it carries less.
    fn balanced(
        mut self,
        settings: &GatherSettings,
        stream: &mut Stream,
    ) -> impl Iterator<Item = Self> + use<> {
        let weight = self.weight() * f64::from(settings.rays) / 4.0;
        let parts = if weight > 1.0 { libm::ceil(weight / HEAVY) } else { weight };
        let copies = copies(parts, stream);
        if copies > 0 {
            self.throughput.iter_mut().flatten().for_each(|energy| *energy /= parts);
        }
        std::iter::repeat_n(self, copies)
    }

    /// Whether connections reach what it sees now.
    fn is_connected(&self) -> bool {
        self.reflections == 0 && self.turns.is_empty()
    }

    /// Keeps what comes this way from `hit` on a surface with unit `normal`, where edges bend.
    fn keep(&mut self, medium: &Medium<'_>, hit: &Hit, normal: Vec3) {
        let Some(bends) = medium.bends else { return };
        let steepness = f64::from(self.direction.dot(normal).abs());
        let far = self.at + self.direction.as_dvec3().normalize() * self.at.distance(hit.position.as_dvec3());
        let start = WayEnd::at_surface(far, steepness);
        self.turns.reverse();
        bends.keep_turned(medium.geometry, [start, self.end], &self.turns, &mut self.throughput);
    }

    /// Goes on as a mirror with the `specular` factors has it; false where it ends.
    fn reflect(
        &mut self,
        medium: &Medium<'_>,
        hit: &Hit,
        normal: Vec3,
        specular: &[Lanes],
        stream: &mut Stream,
    ) -> bool {
        if self.throughput.iter().flatten().all(|&band| band <= 0.0) {
            return false;
        }
        // Roulette with the strongest band's reflection: no band's throughput grows.
        let survival = specular.iter().flatten().copied().fold(0.0, f64::max);
        if stream.uniform_fine() >= survival {
            return false;
        }
        self.throughput = product(&self.throughput, specular, 1.0 / survival);
        self.end = WayEnd::at_surface(hit.position.as_dvec3(), f64::from(self.direction.dot(normal).abs()));
        self.direction = (self.direction - 2.0 * self.direction.dot(normal) * normal).normalize();
        self.departure = medium.geometry.leave(hit.position, hit.surface, hit.side);
        self.at = hit.position.as_dvec3();
        self.turns.clear();
        self.reflections += 1;
        true
    }
}

/// A whole number that is `expected` on average.
fn copies(expected: f64, stream: &mut Stream) -> usize {
    let whole = libm::floor(expected);
    whole as usize + usize::from(stream.uniform_fine() < expected - whole)
}

fn product(a: &[Lanes], b: &[Lanes], scale: f64) -> Vec<Lanes> {
    a.iter()
        .zip(b)
        .map(|(a, b)| {
            let mut out = [0.0; 4];
            for lane in 0..4 {
                out[lane] = a[lane] * b[lane] * scale;
            }
            out
        })
        .collect()
}
