//! Visibility rays: where a receiver looks, directly and by mirrors.

use glam::{DVec3, Vec3};
use smallvec::{SmallVec, smallvec};
use sonel_geometry::{Departure, Hit, SurfaceId};
use sonel_map::coefficients::MaterialRow;
use sonel_map::{BandValues, CoefficientTable, Lanes};
use sonel_sampling::{Frame, ScrambledSobol, Stream, warp};

use super::disc::{Disc, Sheet};
use crate::exact::mirror::chains::Chains;
use crate::receiver::PreparedReceiver;
use crate::stochastic::connection::normal_on;
use crate::stochastic::gather::sonel_sample::SonelSample;
use crate::stochastic::medium::Medium;

/// Settings of rays that gather.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GatherSettings {
    /// Rays of one receiver in one batch.
    pub rays: u32,
    /// Longest path that matters [m].
    pub reach: f64,
    /// Whether rays go on by mirrors; else they bring only what connections leave next to surfaces.
    pub by_mirrors: bool,
}

/// Splitting: a ray whose weight in any band exceeds this many times its initial weight goes on in parts of 2 … 4 times. Chosen, not measured;
/// doubled, fewer rays of more weight follow a focus.
const HEAVY: f64 = 4.0;
/// Russian roulette below this share of the initial weight in every band [1]. Where hard walls face each other, few rays bring most of the late
/// energy after twenty reflections: roulette at each of them would leave so few that their number alone decides the noise of T30. Chosen, not
/// measured; doubled, it begins 3 dB earlier.
pub(crate) const LIGHT: f64 = 0.02;

/// Energies or factors per band, in place for up to eight bands: discs and rays are made by the million.
pub(crate) type Weight = SmallVec<[Lanes; 2]>;

/// One disc that gathers.
#[derive(Debug, Clone)]
pub(crate) struct GatherPoint {
    /// Number of the receiver.
    pub receiver: u32,
    /// The disc.
    pub disc: Disc,
    /// Length of the ray before its last leg [m].
    pub length: f64,
    /// Start of that leg, relative to the scene's centre [m].
    pub start: DVec3,
    /// (4π/M) · T · δ / (π A) per band, times the share that is gathered [1/m²].
    pub weight: Weight,
    /// Whether the receiver sees the last diffuse reflection without a mirror.
    pub seen_directly: bool,
    /// Whether it leaves out sonels that the ray finds where it goes on from a near surface.
    pub is_followed: bool,
    /// Where the ray left the receiver to.
    pub towards: Vec3,
}

impl AsRef<Disc> for GatherPoint {
    fn as_ref(&self) -> &Disc {
        &self.disc
    }
}

/// A place near the receiver that reflects diffusely: what the source and its mirror images send there has still to be connected.
pub(crate) struct NearPlace<'a> {
    /// The ray that goes on from it: its throughput is the fluence at the receiver per irradiance at the place.
    pub ray: &'a Ray,
    /// The surface that it is on.
    pub surface: SurfaceId,
    /// Normal of its surface on the side that is seen.
    pub normal: Vec3,
    /// A random number, 0 … 1, that selects an image of the source.
    pub choice: f64,
}

/// Finding of a visibility ray.
pub(crate) enum GatherHit<'a> {
    /// A disc that gathers.
    Disc(GatherPoint),
    /// A place to be connected with the source.
    Near(NearPlace<'a>),
}

/// Receiver and targets of rays.
#[derive(Clone, Copy)]
pub(crate) struct Observer<'a> {
    /// Number of the receiver.
    pub number: u32,
    /// The receiver.
    pub receiver: &'a PreparedReceiver,
    /// Sonels of the source that it listens to.
    pub sample: &'a SonelSample,
}

/// Casts the rays of one receiver in one batch and hands over what they find. `stream` is that of the receiver and batch.
pub(crate) fn cast(
    medium: &Medium<'_>,
    sheets: &[Sheet],
    observer: Observer<'_>,
    settings: &GatherSettings,
    stream: &mut Stream,
    mut found: impl FnMut(GatherHit<'_>),
) {
    let mut points = || ScrambledSobol::from_keys([stream.bits(), stream.bits()]);
    let (directions, onward, choices) = (points(), points(), points());
    let mut near_places = 0;
    let mut rays: Vec<Ray> = Vec::new();
    for number in 0..settings.rays {
        rays.push(Ray::new(observer.receiver, directions.point(number), settings, medium.table));
        while let Some(mut ray) = rays.pop() {
            let Some(hit) = ray.arrive(medium, settings) else { continue };
            let surface = medium.geometry.surface(hit.surface);
            let row = medium.table.mean_row(hit.surface);
            let normal = normal_on(hit.side, surface.normal.as_vec3().normalize());
            let [gathered, followed] =
                if row.is_mirror { [0.0; 2] } else { ray.shares(&observer, &hit, normal, settings) };
            let mirrors = ray.goes_on_by_mirrors(observer.receiver, medium.chains, hit.surface, settings);
            let mut disc = |share: f64, is_followed: bool| {
                if share > 0.0 {
                    let sheet = &sheets[hit.surface.0 as usize];
                    let disc = sheet.disc(medium.geometry, &hit, observer.receiver.disc_radius);
                    found(GatherHit::Disc(GatherPoint {
                        receiver: observer.number,
                        length: ray.length - ray.at.distance(hit.position.as_dvec3()),
                        start: ray.at,
                        weight: product(&ray.throughput, &row.diffuse.energy, share / disc.view.area),
                        disc,
                        seen_directly: ray.is_seen_directly(),
                        is_followed,
                        towards: ray.towards,
                    }));
                }
            };
            disc(gathered, false);
            disc(followed, true);
            if followed > 0.0 {
                let on = ray.followed(medium, &hit, normal, &row.diffuse.energy, followed);
                let (surface, choice) = (hit.surface, f64::from(choices.point(near_places)[0]));
                found(GatherHit::Near(NearPlace { ray: &on, surface, normal, choice }));
                let point = if ray.is_scattered { stream.uniform_pair() } else { onward.point(near_places) };
                let on = on.scattered(normal, point).met_at_its_angle(medium.table, hit.surface);
                rays.extend(on.balanced(stream));
                near_places += 1;
            }
            if mirrors {
                ray.go_on(medium, observer.sample, &hit, normal, stream, &mut rays);
            }
        }
    }
}

/// A visibility ray, going against the packets.
#[derive(Clone)]
pub(crate) struct Ray {
    pub departure: Departure,
    direction: Vec3,
    /// Direction in which it left the receiver.
    pub towards: Vec3,
    /// Start of its next leg, relative to the scene's centre [m].
    pub at: DVec3,
    /// Per band.
    pub throughput: Weight,
    /// Weight in the strongest band at its start, less the losses in partitions on the way.
    reference_weight: f64,
    /// Path length so far [m].
    pub length: f64,
    /// Cost of the mirrors met before the first diffuse reflection.
    run: u32,
    /// Whether it has gone on from a diffuse reflection.
    is_scattered: bool,
}

impl Ray {
    /// The ray of `receiver` that a uniform `point` of the unit square chooses.
    fn new(
        receiver: &PreparedReceiver,
        point: [f32; 2],
        settings: &GatherSettings,
        table: &CoefficientTable,
    ) -> Self {
        let (direction, density) = receiver.directions.sample(point);
        let reference_weight = 4.0 / (f64::from(settings.rays) * density);
        let weight = reference_weight * receiver.sensitivity.to(direction.as_dvec3());
        Self {
            departure: Departure::free(receiver.position),
            direction,
            towards: direction,
            at: receiver.exact,
            throughput: smallvec![Lanes::splat(weight); sonel_map::lanes_of(table.bands())],
            reference_weight,
            length: 0.0,
            run: 0,
            is_scattered: false,
        }
    }

    /// Goes straight on to the next surface; [`None`] where nothing comes from there within reach.
    fn arrive(&mut self, medium: &Medium<'_>, settings: &GatherSettings) -> Option<Hit> {
        let hit = medium.geometry.closest_hit(self.departure, self.direction)?;
        self.length += f64::from(self.departure.origin.distance(hit.position));
        (self.length <= settings.reach).then_some(hit)
    }

    /// Leaves what goes on from `hit`, through a partition or by a mirror, with the other `rays`.
    fn go_on(
        mut self,
        medium: &Medium<'_>,
        sample: &SonelSample,
        hit: &Hit,
        normal: Vec3,
        stream: &mut Stream,
        rays: &mut Vec<Self>,
    ) {
        let row = medium.table.mean_row(hit.surface);
        if row.is_partition && self.is_to_pass(sample.through(hit, row), stream) {
            rays.extend(self.passed(medium, hit, row));
            return;
        }
        let met = medium.table.row(hit.surface, self.direction.as_dvec3());
        if self.reflect(medium, hit, normal, &met.specular.energy) {
            rays.extend(self.balanced(stream));
        }
    }

    /// The most that it carries of any band.
    fn weight(&self) -> f64 {
        self.throughput.largest()
    }

    /// The ray as it is; several that carry less each, where it carries much more than when it left; by roulette, where it carries little.
    fn balanced(mut self, stream: &mut Stream) -> impl Iterator<Item = Self> + use<> {
        let weight = self.weight() / self.reference_weight;
        let parts = if weight > HEAVY { libm::ceil(weight / HEAVY) } else { (weight / LIGHT).min(1.0) };
        let copies = copies(parts, stream);
        if copies > 0 {
            self.throughput.divide(parts);
        }
        std::iter::repeat_n(self, copies)
    }

    /// Shares of the diffuse reflection at `hit` that a disc gathers there, and that the ray goes on for, as the place is too near for discs as
    /// well; the rest is left to connections. All shares are functions of the place: so what a disc averages is irradiance alone.
    fn shares(
        &self,
        observer: &Observer<'_>,
        hit: &Hit,
        normal: Vec3,
        settings: &GatherSettings,
    ) -> [f64; 2] {
        let receiver = observer.receiver;
        let is_near = if self.is_scattered {
            receiver.is_near(hit.position)
        } else if self.run > 0 && settings.by_mirrors {
            receiver.is_near_along(self.length)
        } else {
            let cosine = f64::from(self.direction.dot(normal).abs());
            return [0.0, receiver.followed_share(cosine / (self.length * self.length))];
        };
        [f64::from(!is_near), f64::from(is_near)]
    }

    /// Whether the mirror in `surface` shows it what it has to find.
    fn goes_on_by_mirrors(
        &self,
        receiver: &PreparedReceiver,
        chains: &Chains,
        surface: SurfaceId,
        settings: &GatherSettings,
    ) -> bool {
        let by_images =
            || chains.after(self.run, surface) <= chains.limit && receiver.is_near_along(self.length);
        settings.by_mirrors || self.is_scattered || by_images()
    }

    /// Whether no mirror is between the receiver and the first diffuse reflection.
    pub(crate) fn is_seen_directly(&self) -> bool {
        self.run == 0
    }

    /// The ray at `hit`, with the part of what is reflected there that it goes on for.
    fn followed(&self, medium: &Medium<'_>, hit: &Hit, normal: Vec3, diffuse: &[Lanes], share: f64) -> Self {
        Self {
            throughput: product(&self.throughput, diffuse, share),
            direction: normal,
            departure: medium.geometry.leave(hit.position, hit.surface, hit.side),
            at: hit.position.as_dvec3(),
            is_scattered: true,
            ..self.clone()
        }
    }

    /// The ray in the direction of a random `point`, by Lambert's law about `normal`.
    fn scattered(mut self, normal: Vec3, point: [f32; 2]) -> Self {
        self.direction = Frame::about(normal).outward(warp::cosine_hemisphere(point));
        self
    }

    /// The ray with what `surface`, which it leaves, reflects of sound that comes along it.
    fn met_at_its_angle(mut self, table: &CoefficientTable, surface: SurfaceId) -> Self {
        if let Some(more) = table.relative_reflection(surface, self.direction.as_dvec3()) {
            self.throughput.multiply(&more);
        }
        self
    }

    /// Whether it goes through a partition, by chance, where a share goes `through`; what it carries allows for that either way.
    fn is_to_pass(&mut self, through: f64, stream: &mut Stream) -> bool {
        let passes = stream.uniform_fine() < through;
        let chance = if passes { through } else { 1.0 - through };
        self.throughput.divide(chance);
        self.reference_weight /= chance;
        passes
    }

    /// The ray behind the partition at `hit`; none where no face is opposite.
    fn passed(mut self, medium: &Medium<'_>, hit: &Hit, row: &MaterialRow) -> Option<Self> {
        let passage = medium.geometry.pass(hit)?;
        let before = self.weight();
        self.throughput.multiply(&row.transmitted.energy);
        self.reference_weight *= self.weight() / before;
        self.departure = passage.departure;
        self.at = hit.position.as_dvec3() + passage.shift;
        self.length += passage.thickness();
        Some(self)
    }

    /// Goes on as a mirror with the `specular` factors has it; false where nothing is left.
    fn reflect(&mut self, medium: &Medium<'_>, hit: &Hit, normal: Vec3, specular: &[Lanes]) -> bool {
        self.throughput.multiply(specular);
        if self.weight() <= 0.0 {
            return false;
        }
        self.direction = self.direction.reflect(normal).normalize();
        self.departure = medium.geometry.leave(hit.position, hit.surface, hit.side);
        self.at = hit.position.as_dvec3();
        if !self.is_scattered {
            self.run = medium.chains.after(self.run, hit.surface);
        }
        true
    }
}

fn product(energies: &[Lanes], factors: &[Lanes], scale: f64) -> Weight {
    let mut product = Weight::from_slice(energies);
    product.multiply(factors);
    product.scale(scale);
    product
}

/// A whole number that is `expected` on average.
fn copies(expected: f64, stream: &mut Stream) -> usize {
    let whole = libm::floor(expected);
    whole as usize + usize::from(stream.uniform_fine() < expected - whole)
}
