//! Where a visibility ray turns at edges.
//!
//! A ray that passes edges goes on straight with the bands that none of them bends, and turned with what they bend: at places about their
//! feet, by the law of [`super::backwards`]. Bands have deviations of their own and share a place, drawn from the mean of their densities, each
//! band with the weight of what it carries. The edges that turn a ray are most often those that it passes, from the first on as long as what is turned
//! behind that reaches the ray unbent, and those that are nearest at the ends of the way, whose closest point may be beyond. All others nearby are
//! asked now and then, since an edge that is not the nearest from the ray's closest point may be so beside it.
//!
//! Which bands come this way and no other is for the packet to say, when the ray has met a surface: [`Bends::keep_turned`].
//!
//! References: docs/physics.md §5.2, docs/diffraction.md.

use glam::DVec3;
use sonel_geometry::{EdgePass, Geometry, Nearby, Way};
use sonel_map::Lanes;
use sonel_map::bend_history::MOST_BENDS;
use sonel_sampling::{Stream, warp};

use super::backwards::{ReverseBend, density, likelihood, place};
use crate::stochastic::bending::{Bends, Turn};

/// Share of the turns that ask all edges nearby, and not only those that turn most often.
const BLIND_SHARE: f64 = 0.1;
/// Edges passed on a way that are looked for.
const MOST_PASSAGES: usize = 12;
/// So many times what rays are lifted off surfaces, the ends of a way are off them when they are asked what edge is nearest.
const OFF_SURFACES: f64 = 8.0;

/// A straight way of a ray, against the packets.
#[derive(Debug, Clone, Copy)]
pub struct Look {
    /// Where it starts, about the scene's centre [m].
    pub origin: DVec3,
    /// Unit direction.
    pub direction: DVec3,
    /// Part of it on which packets pass edges: from … to [m].
    pub part: [f64; 2],
}

/// A band that edges may turn.
#[derive(Debug, Clone)]
struct Band {
    concentration: f64,
    /// How likely the band is asked.
    chance: f64,
    /// How likely each edge nearby is asked for it.
    chances: Vec<f64>,
}

/// How a ray may go on.
#[derive(Debug)]
pub struct Turning {
    look: Look,
    nearby: Vec<Nearby>,
    bands: Vec<Band>,
    /// What turns in all bands together, as far as is known before.
    pub expected: f64,
    /// Bands that do not go straight on.
    passed: Vec<usize>,
}

impl Turning {
    /// What may turn a ray of `throughput` on a way behind `turns`; [`None`] where no edge is near.
    #[must_use]
    pub fn new(
        geometry: &Geometry,
        bends: &Bends,
        look: Look,
        turns: &[Turn],
        throughput: &[Lanes],
    ) -> Option<Self> {
        let reach = bends.reach_of(throughput);
        if reach < 0.0 || turns.len() >= MOST_BENDS {
            return None;
        }
        let [from, to] = look.part;
        let way = Way { origin: look.origin, direction: look.direction, from, to, reach };
        let mut nearby = Vec::new();
        bends.nearby(&way, |near| {
            if near.distance > 0.0 && turns.iter().all(|turn| turn.edge != near.edge) {
                nearby.push(near);
            }
        });
        if nearby.is_empty() {
            return None;
        }
        let edge_passes = edge_passes(geometry, bends, way, turns, throughput);
        let beside = OFF_SURFACES * bends.least_distance();
        let at_ends = [from + beside, to - beside]
            .map(|at| bends.nearest(geometry, look.origin + at * look.direction, reach))
            .concat();
        let turns_here = |near: &Nearby| {
            edge_passes.iter().any(|edge_pass| edge_pass.edge == near.edge)
                || at_ends.iter().any(|(edge, _)| *edge == near.edge)
        };
        let known: Vec<bool> = nearby.iter().map(turns_here).collect();
        let mut this = Self { look, nearby, bands: Vec::new(), expected: 0.0, passed: Vec::new() };
        for &(band, concentration) in bends.bent() {
            let energy = throughput[band / 4][band % 4];
            if energy > 0.0 {
                let first = edge_passes.iter().find(|edge_pass| {
                    bends.bends(band, edge_pass.distance, bends.size_seen(edge_pass.edge, look.direction))
                });
                this.passed.extend(first.map(|_| band));
                let first = first.map_or(f64::INFINITY, |first| first.at);
                let is_free = |near: &Nearby| clear(near) <= first && (turns.is_empty() || clear(near) > 0.0);
                let reach = bends.reach_of_band(band);
                let likelihood = |near: &Nearby| {
                    let bends = bends.may_bend(band, near.edge);
                    if bends { likelihood(near, concentration, reach) } else { 0.0 }
                };
                let likelihoods: Vec<f64> = this.nearby.iter().map(likelihood).collect();
                this.add(energy, concentration, &likelihoods, |index, near| known[index] && is_free(near));
            }
        }
        this.bands.iter_mut().for_each(|band| band.chance /= this.expected);
        (!this.bands.is_empty()).then_some(this)
    }

    /// Adds a band that carries `energy`, which edges turn that are known to, and others that might with these `likelihoods`.
    fn add(
        &mut self,
        energy: f64,
        concentration: f64,
        likelihoods: &[f64],
        turns: impl Fn(usize, &Nearby) -> bool,
    ) {
        let of_known =
            |(index, near): (usize, &Nearby)| if turns(index, near) { likelihoods[index] } else { 0.0 };
        let mut chances: Vec<f64> = self.nearby.iter().enumerate().map(of_known).collect();
        // The nearer an edge, the likelier it is the nearest of all.
        let nearness =
            |(near, likelihood): (&Nearby, &f64)| likelihood / (1.0 + concentration * near.distance);
        let guesses: Vec<f64> = self.nearby.iter().zip(likelihoods).map(nearness).collect();
        let (known, all) = (chances.iter().sum::<f64>(), guesses.iter().sum::<f64>());
        if all <= 0.0 {
            return;
        }
        let blind = if known > 0.0 { BLIND_SHARE } else { 1.0 };
        for (chance, guess) in chances.iter_mut().zip(&guesses) {
            *chance *= (1.0 - blind) / known.max(f64::MIN_POSITIVE);
            *chance += blind * guess / all;
        }
        let likeliest = likelihoods.iter().copied().fold(0.0, f64::max);
        let chance = energy * known.max(BLIND_SHARE * likeliest);
        self.expected += chance;
        self.bands.push(Band { concentration, chance, chances });
    }

    /// Takes from `throughput` what does not go straight on.
    pub fn keep_straight(&self, throughput: &mut [Lanes]) {
        self.passed.iter().for_each(|&band| throughput[band / 4][band % 4] = 0.0);
    }

    /// Turns a ray at random and weighs its `throughput`; [`None`] where nothing comes that way.
    pub fn turn(
        &self,
        geometry: &Geometry,
        bends: &Bends,
        turns: &[Turn],
        throughput: &mut [Lanes],
        stream: &mut Stream,
    ) -> Option<Turn> {
        let at = self.draw(stream);
        let place = self.look.origin + at * self.look.direction;
        let [from, to] = self.look.part;
        if !(at > from && at < to) {
            return None;
        }
        let passed = bends.nearest(geometry, place, bends.reach_of(throughput));
        // Each of them as likely.
        let (edge, point) = *passed.get((stream.uniform_fine() * passed.len() as f64) as usize)?;
        if turns.iter().any(|turn| turn.edge == edge) {
            return None;
        }
        let back = ReverseBend::new(&bends.lines()[edge as usize], point, place, self.look.direction)?;
        let turn = Turn { edge, closest: place, distance: back.distance, before: back.before };
        let seen = bends.sizes_seen(&turn, back.tangent);
        let inverse = passed.len() as f64 / self.density(at);
        let mut weights = vec![[0.0; 4]; throughput.len()];
        for &(band, concentration) in bends.bent() {
            if bends.bends(band, back.distance, seen.before) {
                let density = back.density(concentration) * bends.preference(band, &seen);
                weights[band / 4][band % 4] = density * inverse;
            }
        }
        for (energy, weight) in throughput.iter_mut().flatten().zip(weights.iter().flatten()) {
            *energy *= weight;
        }
        Some(turn)
    }

    /// A place on the ray for all bands [m].
    fn draw(&self, stream: &mut Stream) -> f64 {
        let band = &self.bands[chosen(self.bands.iter().map(|band| band.chance), stream.uniform_fine())];
        let near = &self.nearby[chosen(band.chances.iter().copied(), stream.uniform_fine())];
        let [normal, _] = warp::normal_pair(stream.uniform_pair());
        place(near, normal, band.concentration)
    }

    /// Density of [`Self::draw`] [1/m].
    fn density(&self, at: f64) -> f64 {
        let of_band = |band: &Band| -> f64 {
            let chances = self.nearby.iter().zip(&band.chances).filter(|(_, chance)| **chance > 0.0);
            let sum: f64 = chances.map(|(near, chance)| chance * density(near, at, band.concentration)).sum();
            band.chance * sum
        };
        self.bands.iter().map(of_band).sum()
    }
}

/// Which of some `chances`, which add up to 1, a uniform number picks.
fn chosen(chances: impl Iterator<Item = f64>, uniform: f64) -> usize {
    let (mut left, mut last) = (uniform, 0);
    for (index, chance) in chances.enumerate() {
        if chance > 0.0 {
            if left < chance {
                return index;
            }
            last = index;
        }
        left -= chance;
    }
    last
}

/// Up to where on the ray a packet that was turned at an edge is not turned again [m].
fn clear(near: &Nearby) -> f64 {
    near.at.clamp(near.part[0], near.part[1]) - near.distance
}

/// What the ray passes: the first edge, and those from whose feet packets may reach it unbent.
fn edge_passes(
    geometry: &Geometry,
    bends: &Bends,
    mut way: Way,
    turns: &[Turn],
    throughput: &[Lanes],
) -> Vec<EdgePass> {
    let mut edge_passes: Vec<EdgePass> = Vec::new();
    while edge_passes.len() < MOST_PASSAGES
        && let Some(edge_pass) = bends.next(geometry, &way, turns, throughput)
    {
        way.from = edge_pass.at;
        if edge_passes.first().is_some_and(|first| edge_pass.at > first.at + way.reach) {
            break;
        }
        edge_passes.push(edge_pass);
    }
    edge_passes
}
