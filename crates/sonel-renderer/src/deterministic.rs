//! The classes without noise, L R and L S^k R with what edges do to them, at every receiver.

use glam::DVec3;
use rayon::prelude::*;
use sonel_map::coefficients::to_lanes;
use sonel_map::{Lanes, lanes_of};

use crate::deposit::{Deposits, add_lanes};
use crate::direct::{direct_path, spread};
use crate::edge::{
    Beside, EDGE_ORDER, EdgeArrival, LaterImage, Listening, RECEIVER_OUT, Reflection, SourceImage,
};
use crate::mirror::{MirrorArrival, MirrorChains, Radiator};
use crate::receiver::PreparedReceiver;
use crate::render::{PathClass, Renderer};
use crate::rendering::{CoarseEchogram, DiscreteArrival, Rendering};

/// Mirror arrivals up to this order are listed one by one unless an order was asked for.
const LISTED_ORDER: u32 = 6;

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
        let bare = |length, towards: DVec3, order, over_edges| DiscreteArrival {
            receiver: index,
            length,
            energy: vec![],
            towards: towards.to_array(),
            order,
            over_edges,
        };
        let place = self.beside_planes(receiver.exact, RECEIVER_OUT);
        let direct = direct_path(self.geometry, radiator.position, place);
        let at = Listening {
            geometry: self.geometry,
            table: &self.table,
            attenuation: &self.attenuation,
            radiator,
            receiver: place,
            clear: direct.is_some(),
            complete_order: chains.order(),
        };
        let (over_edges, reflections) = self.hear_edges(&at, receiver.exact, chains);
        // Beside a clear direct path edges are many and weak: they are heard but not listed.
        let is_direct = |arrival: &EdgeArrival| !arrival.shaded;
        let clear = over_edges.iter().any(is_direct);
        let mut heard = vec![[0.0; 4]; lanes_of(bands)];
        for arrival in &over_edges {
            let class = if arrival.shaded { 2 } else { 0 };
            let found = bare(arrival.length, arrival.towards, arrival.order, arrival.shaded);
            let energy = to_lanes(arrival.energy.iter().copied());
            add_lanes(&mut heard, &energy);
            deposit(class, found, &energy, !clear || is_direct(arrival));
        }
        if let Some((length, direction)) = direct
            && !clear
        {
            let factor = radiator.factor(direction) * spread(length);
            let attenuated = self.attenuation.iter().map(|m| factor * libm::exp(-m * length));
            let energy = to_lanes(attenuated);
            add_lanes(&mut heard, &energy);
            deposit(0, bare(length, -direction, 0, false), &energy, true);
        }
        let listed = self.settings.mirror_order.unwrap_or(LISTED_ORDER);
        let (mut later, mut lit) = (Vec::new(), Vec::new());
        self.visit_images(&at, chains, &reflections, |found, energy| {
            if self.edges.is_some() && found.order > EDGE_ORDER {
                lit.push(SourceImage::of(found, place));
                later.push((found.length, found.towards, found.order, energy.to_vec()));
            } else {
                add_lanes(&mut heard, energy);
                deposit(
                    1,
                    bare(found.length, found.towards, found.order, false),
                    energy,
                    found.order <= listed,
                );
            }
        });
        for image in self.hear_later(&at, chains, &lit, &heard) {
            let energy = to_lanes(image.energy);
            match image.lit {
                Some(lit) => later[lit].3 = energy,
                None => {
                    let towards = (image.position - place).normalize();
                    deposit(
                        2,
                        bare(image.length, towards, image.order, true),
                        &energy,
                        image.order <= listed,
                    );
                }
            }
        }
        for (length, towards, order, energy) in later {
            deposit(1, bare(length, towards, order, false), &energy, order <= listed);
        }
        part.arrivals.sort_by(|a, b| a.length.total_cmp(&b.length));
        part
    }

    /// Visits the images of `chains` that reach the receiver, each with its energy [1/m²], in which `reflections`, those of low order in the order
    /// of their visit, have what edges do to them.
    fn visit_images(
        &self,
        at: &Listening<'_>,
        chains: &MirrorChains,
        reflections: &[Reflection],
        mut visit: impl FnMut(&MirrorArrival<'_>, &[Lanes]),
    ) {
        let mut energy = vec![[0.0; 4]; lanes_of(self.table.bands())];
        let mut reflections = reflections.iter();
        chains.visit(self.geometry, &self.table, at.receiver, self.bins.reach, |found| {
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
            visit(found, &energy);
        });
    }

    /// A source's or receiver's place [m] as edges are asked about it, `out` [resolutions] of the planes that it lies in.
    pub(crate) fn beside_planes(&self, place: DVec3, out: f64) -> DVec3 {
        self.edges.as_ref().map_or(place, |edges| edges.beside_planes(self.geometry, place, out))
    }

    /// What edges bring, and the mirror images of low order in the order of their visit, with what edges do to them; as much of it as there is between
    /// both sides of the boundaries that the receiver is next to, in truth at `place` [m].
    fn hear_edges(
        &self,
        at: &Listening<'_>,
        place: DVec3,
        chains: &MirrorChains,
    ) -> (Vec<EdgeArrival>, Vec<Reflection>) {
        let (mut arrivals, mut reflections) = self.hear_edges_at(at, chains);
        let Some(between) = self.energy_between(at, place, chains, 0) else { return (arrivals, reflections) };
        let energy = self.energy_over_edges(at, &arrivals, &reflections);
        let gain = |(between, &here)| if here > 0.0 { between / here } else { 1.0 };
        let gain: Vec<f64> = between.iter().zip(&energy).map(gain).collect();
        let parts = arrivals.iter_mut().map(|arrival| &mut arrival.energy);
        for part in parts.chain(reflections.iter_mut().map(|reflection| &mut reflection.ratio)) {
            part.iter_mut().zip(&gain).for_each(|(part, gain)| *part *= gain);
        }
        (arrivals, reflections)
    }

    /// Energy at `place` [m] between both sides of the boundaries from number `first` on that it is next to, if there is one, per band [1/m²]: on
    /// either side of the first one that between both sides of the others.
    fn energy_between(
        &self,
        at: &Listening<'_>,
        place: DVec3,
        chains: &MirrorChains,
        first: usize,
    ) -> Option<Vec<f64>> {
        let edges = self.edges.as_ref()?;
        let source = at.radiator.position;
        let (number, Beside { places, share }) = edges.beside(self.geometry, source, place, first)?;
        let [one, other] = places.map(|place| {
            self.energy_between(at, place, chains, number + 1).unwrap_or_else(|| {
                let receiver = self.beside_planes(place, RECEIVER_OUT);
                let clear = direct_path(self.geometry, source, receiver).is_some();
                let there = Listening { receiver, clear, ..*at };
                let (arrivals, reflections) = self.hear_edges_at(&there, chains);
                self.energy_over_edges(&there, &arrivals, &reflections)
            })
        });
        Some(one.iter().zip(&other).map(|(one, other)| one + (other - one) * share).collect())
    }

    /// Energy of direct sound, of what edges bring and of mirror images of low order, per band [1/m²].
    fn energy_over_edges(
        &self,
        at: &Listening<'_>,
        arrivals: &[EdgeArrival],
        reflections: &[Reflection],
    ) -> Vec<f64> {
        let mut energy = vec![0.0; self.table.bands()];
        let mut add = |part: &mut dyn Iterator<Item = f64>| {
            energy.iter_mut().zip(part).for_each(|(energy, part)| *energy += part);
        };
        arrivals.iter().for_each(|arrival| add(&mut arrival.energy.iter().copied()));
        reflections.iter().for_each(|reflection| add(&mut reflection.energy(at.receiver, &self.attenuation)));
        energy
    }

    /// What edges bring, and the mirror images of low order, as they are where `at` is.
    fn hear_edges_at(
        &self,
        at: &Listening<'_>,
        chains: &MirrorChains,
    ) -> (Vec<EdgeArrival>, Vec<Reflection>) {
        let Some(edges) = &self.edges else { return Default::default() };
        let mut reflections = Vec::new();
        chains.visit(self.geometry, &self.table, at.receiver, self.bins.reach, |found| {
            if found.order <= EDGE_ORDER {
                reflections.push(Reflection::new(found, at.receiver, self.table.bands()));
            }
        });
        let arrivals = edges.hear(at, &mut reflections);
        (arrivals, reflections)
    }

    /// The images of more reflections that edges change; `lit` are those that reach the receiver, `heard` is the energy of all else that does
    /// [1/m²].
    fn hear_later(
        &self,
        at: &Listening<'_>,
        chains: &MirrorChains,
        lit: &[SourceImage],
        heard: &[Lanes],
    ) -> Vec<LaterImage> {
        match (&self.edges, chains) {
            (Some(edges), MirrorChains::Tree(tree)) => {
                let heard: Vec<f64> = (0..self.table.bands()).map(|band| heard[band / 4][band % 4]).collect();
                edges.hear_later(at, tree, lit, &heard)
            }
            _ => Vec::new(),
        }
    }
}
