//! The classes without noise, L R and L S^k R with what edges do to them, at every receiver.

use glam::DVec3;
use rayon::prelude::*;
use sonel_map::coefficients::to_lanes;
use sonel_map::{Lanes, lanes_of};

use crate::deposit::{Deposits, add_lanes};
use crate::direct::{direct_path, spread};
use crate::edge::{EdgeArrival, Listening, RECEIVER_OUT, Reflection};
use crate::mirror::{MirrorChains, Radiator};
use crate::receiver::PreparedReceiver;
use crate::render::{PathClass, Renderer};
use crate::rendering::{CoarseEchogram, DiscreteArrival, Rendering};

/// Mirror arrivals up to this order are listed one by one unless an order was asked for.
const LISTED_ORDER: u32 = 6;

/// Reflections of a mirror image that edges may change.
const EDGE_ORDER: u32 = 2;

/// The classes, as [`Part`] lists them.
const CLASSES: [PathClass; 3] = [PathClass::Direct, PathClass::MirrorChain, PathClass::Edge];

/// What one receiver hears.
struct Part {
    fine: Deposits,
    coarse: CoarseEchogram,
    classes: [Vec<Lanes>; CLASSES.len()],
    arrivals: Vec<DiscreteArrival>,
}

impl Renderer<'_> {
    /// Adds direct sound and mirror chains to `rendering`, and to each of its batches.
    pub(crate) fn add_deterministic(
        &self,
        rendering: &mut Rendering,
        radiator: Radiator,
        chains: &MirrorChains,
        receivers: &[PreparedReceiver],
        borders: &[Vec<f64>],
    ) {
        let parts: Vec<Part> = receivers
            .par_iter()
            .zip(borders)
            .enumerate()
            .map(|(index, (receiver, borders))| self.hear(index, radiator, chains, receiver, borders))
            .collect();
        for (index, part) in parts.into_iter().enumerate() {
            rendering.total.add_receivers(index, &part.fine, 1.0);
            for batch in &mut rendering.batches {
                batch.push(part.coarse.clone());
            }
            for (class, energy) in CLASSES.into_iter().zip(&part.classes) {
                rendering.book(class, 1.0, energy);
            }
            rendering.arrivals.extend(part.arrivals);
        }
    }

    fn hear(
        &self,
        index: usize,
        radiator: Radiator,
        chains: &MirrorChains,
        receiver: &PreparedReceiver,
        borders: &[f64],
    ) -> Part {
        let bands = self.table.bands();
        let mut part = Part {
            fine: Deposits::new(1, self.bins.count, bands),
            coarse: CoarseEchogram::new(borders.len(), bands),
            classes: CLASSES.map(|_| vec![[0.0; 4]; lanes_of(bands)]),
            arrivals: Vec::new(),
        };
        let mut energy = vec![[0.0; 4]; lanes_of(bands)];
        let mut deposit = |class: usize, arrival: DiscreteArrival, energy: &[Lanes], listed: bool| {
            let Some(bin) = self.bins.bin(arrival.length) else { return };
            part.fine.add(0, bin, energy);
            part.coarse.add_arrival(borders, self.bins.time(arrival.length), energy);
            add_lanes(&mut part.classes[class], energy);
            if listed {
                let energy = (0..bands).map(|band| energy[band / 4][band % 4]).collect();
                part.arrivals.push(DiscreteArrival { energy, ..arrival });
            }
        };
        let bare = |length, towards, order| DiscreteArrival {
            receiver: index,
            length,
            energy: vec![],
            towards,
            order,
            over_edges: false,
        };
        let place = self.beside_planes(receiver.exact, RECEIVER_OUT);
        let direct = direct_path(self.geometry, radiator.position, place);
        let (over_edges, mut reflections) = self.hear_edges(radiator, chains, place, direct.is_some());
        // Beside a clear direct path edges are many and weak: they are heard but not listed.
        let is_direct = |arrival: &EdgeArrival| !arrival.shaded;
        let clear = over_edges.iter().any(is_direct);
        for arrival in &over_edges {
            let class = if arrival.shaded { 2 } else { 0 };
            let found = DiscreteArrival {
                over_edges: arrival.shaded,
                ..bare(arrival.length, arrival.towards.to_array(), arrival.order)
            };
            deposit(class, found, &to_lanes(arrival.energy.iter().copied()), !clear || is_direct(arrival));
        }
        if let Some((length, direction)) = direct
            && !clear
        {
            let factor = radiator.factor(direction) * spread(length);
            for (band, attenuation) in self.attenuation.iter().enumerate() {
                energy[band / 4][band % 4] = factor * libm::exp(-attenuation * length);
            }
            deposit(0, bare(length, (-direction).to_array(), 0), &energy, true);
        }
        let listed = self.settings.mirror_order.unwrap_or(LISTED_ORDER);
        chains.visit(self.geometry, &self.table, place, self.bins.reach, |found| {
            let spreading = spread(found.length);
            for (energy, factor) in energy.iter_mut().zip(found.factor) {
                *energy = factor.map(|factor| factor * spreading);
            }
            if let Some(air) = &self.air {
                air.attenuate(found.length, &mut energy);
            }
            if found.order <= EDGE_ORDER
                && let Some(reflection) = reflections.next()
            {
                for (band, ratio) in reflection.ratio.iter().enumerate() {
                    energy[band / 4][band % 4] *= ratio;
                }
            }
            let arrival = bare(found.length, found.towards.to_array(), found.order);
            deposit(1, arrival, &energy, found.order <= listed);
        });
        part.arrivals.sort_by(|a, b| a.length.total_cmp(&b.length));
        part
    }

    /// A source's or receiver's place [m] as edges are asked about it, `out` [resolutions] of the planes that it lies in.
    pub(crate) fn beside_planes(&self, place: DVec3, out: f64) -> DVec3 {
        self.edges.as_ref().map_or(place, |edges| edges.beside_planes(self.geometry, place, out))
    }

    /// What edges bring, and the mirror images of low order in the order of their visit, with what edges do to them.
    fn hear_edges(
        &self,
        radiator: Radiator,
        chains: &MirrorChains,
        receiver: DVec3,
        clear: bool,
    ) -> (Vec<EdgeArrival>, std::vec::IntoIter<Reflection>) {
        let Some(edges) = &self.edges else { return (Vec::new(), Vec::new().into_iter()) };
        let mut reflections = Vec::new();
        chains.visit(self.geometry, &self.table, receiver, self.bins.reach, |found| {
            if found.order <= EDGE_ORDER {
                reflections.push(Reflection::new(found, receiver, self.table.bands()));
            }
        });
        let at = Listening {
            geometry: self.geometry,
            table: &self.table,
            attenuation: &self.attenuation,
            radiator,
            receiver,
            clear,
            complete_order: chains.order(),
        };
        let arrivals = edges.hear(&at, &mut reflections);
        (arrivals, reflections.into_iter())
    }
}
