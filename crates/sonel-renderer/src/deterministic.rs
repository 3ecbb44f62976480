//! The classes without noise, L R and L S^k R, at every receiver.

use rayon::prelude::*;
use sonel_map::{Lanes, lanes_of};

use crate::deposit::{Deposits, add_lanes};
use crate::direct::{direct_path, spread};
use crate::mirror::{MirrorChains, Radiator};
use crate::receiver::PreparedReceiver;
use crate::render::{PathClass, Renderer};
use crate::rendering::{CoarseEchogram, DiscreteArrival, Rendering};

/// Mirror arrivals up to this order are listed one by one unless an order was asked for.
const LISTED_ORDER: u32 = 6;

/// What one receiver hears.
struct Part {
    fine: Deposits,
    coarse: CoarseEchogram,
    classes: [Vec<Lanes>; 2],
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
            rendering.book(PathClass::Direct, 1.0, &part.classes[0]);
            rendering.book(PathClass::MirrorChain, 1.0, &part.classes[1]);
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
            classes: [vec![[0.0; 4]; lanes_of(bands)], vec![[0.0; 4]; lanes_of(bands)]],
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
        };
        if let Some((length, direction)) = direct_path(self.geometry, radiator.position, receiver.exact) {
            let factor = radiator.factor(direction) * spread(length);
            for (band, attenuation) in self.attenuation.iter().enumerate() {
                energy[band / 4][band % 4] = factor * libm::exp(-attenuation * length);
            }
            deposit(0, bare(length, (-direction).to_array(), 0), &energy, true);
        }
        let listed = self.settings.mirror_order.unwrap_or(LISTED_ORDER);
        chains.visit(self.geometry, &self.table, receiver.exact, self.bins.reach, |found| {
            let spreading = spread(found.length);
            for (energy, factor) in energy.iter_mut().zip(found.factor) {
                *energy = factor.map(|factor| factor * spreading);
            }
            if let Some(air) = &self.air {
                air.attenuate(found.length, &mut energy);
            }
            let arrival = bare(found.length, found.towards.to_array(), found.order);
            deposit(1, arrival, &energy, found.order <= listed);
        });
        part.arrivals.sort_by(|a, b| a.length.total_cmp(&b.length));
        part
    }
}
