//! The classes without noise, L R and L S^k R with what edges do to them, at every receiver.

use glam::DVec3;
use rayon::prelude::*;
use sonel_geometry::PlaneId;
use sonel_map::coefficients::to_lanes;
use sonel_map::{Lanes, lanes_of};

use crate::deposit::{Deposits, add_lanes};
use crate::direct::{direct_path, spread};
use crate::edge::{Edges, Images, Listening, Place, RECEIVER_OUT, VisibleWave};
use crate::mirror::{MirrorChains, Radiator};
use crate::receiver::PreparedReceiver;
use crate::render::{PathClass, Renderer};
use crate::rendering::{CoarseEchogram, DiscreteArrival, EdgeWork, Rendering};

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
    edge_work: Option<EdgeWork>,
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
        let edges = self.edges.as_ref();
        let images =
            edges.map(|edges| edges.of_source(self.geometry, &self.table, radiator.position, chains));
        let over_edges = edges.zip(images.as_ref());
        let parts: Vec<Part> = receivers
            .par_iter()
            .zip(borders)
            .enumerate()
            .map(|(index, (receiver, borders))| {
                self.hear(index, radiator, chains, over_edges, receiver, borders)
            })
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
            rendering.edge_work.extend(part.edge_work);
        }
    }

    fn hear(
        &self,
        index: usize,
        radiator: Radiator,
        chains: &MirrorChains,
        over_edges: Option<(&Edges, &Images)>,
        receiver: &PreparedReceiver,
        borders: &[f64],
    ) -> Part {
        let bands = self.table.bands();
        let mut part = Part {
            fine: Deposits::new(1, self.bins.count, bands),
            coarse: CoarseEchogram::new(borders.len(), bands),
            classes: CLASSES.map(|_| vec![[0.0; 4]; lanes_of(bands)]),
            arrivals: Vec::new(),
            edge_work: None,
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
        let place =
            over_edges.map_or(place, |(edges, images)| edges.beside_corners(self.geometry, images, place));
        let at = Listening {
            geometry: self.geometry,
            table: &self.table,
            attenuation: &self.attenuation,
            radiator,
            receiver: place,
            complete_order: chains.order(),
        };
        let mut visible = self.visible(&at, chains);
        let is_direct = |wave: &VisibleWave| wave.order == 0;
        let is_clear = visible.iter().any(is_direct);
        let listed = self.settings.mirror_order.unwrap_or(LISTED_ORDER);
        let mut edge_work = None;
        if let Some((edges, images)) = over_edges {
            let sound = edges.hear(&at, images, &mut visible);
            edge_work = Some(sound.work);
            for arrival in sound.arrivals {
                let found = bare(arrival.length, arrival.towards, arrival.order, true);
                // Beside a clear direct path edges are many and weak: they are heard but not listed.
                deposit(2, found, &to_lanes(arrival.energy), !is_clear && arrival.order <= listed);
            }
        }
        for wave in visible {
            let class = usize::from(!is_direct(&wave));
            let found = bare(wave.length, wave.towards, wave.order, false);
            deposit(class, found, &to_lanes(wave.energy), wave.order <= listed);
        }
        part.edge_work = edge_work;
        part.arrivals.sort_by(|a, b| a.length.total_cmp(&b.length));
        part
    }

    /// Direct sound and the image sources of `chains` that are visible from the receiver, without edges.
    fn visible(&self, at: &Listening<'_>, chains: &MirrorChains) -> Vec<VisibleWave> {
        let bands = self.table.bands();
        let flat = |lanes: &[Lanes]| (0..bands).map(|band| lanes[band / 4][band % 4]).collect::<Vec<f64>>();
        let wave = |length: f64, towards: DVec3, order, planes: &[PlaneId], factor: Vec<f64>| {
            let mut energy = to_lanes(factor.iter().map(|factor| factor * spread(length)));
            if let Some(air) = self.air.as_ref().filter(|_| order > 0) {
                air.attenuate(length, &mut energy);
            }
            let place = Place::new(at.receiver + towards * length, planes.iter().copied());
            VisibleWave { place, length, towards, order, factor, energy: flat(&energy) }
        };
        let mut visible = Vec::new();
        if let Some((length, direction)) = direct_path(self.geometry, at.radiator.position, at.receiver) {
            let factor = vec![at.radiator.factor(direction); bands];
            let mut wave = wave(length, -direction, 0, &[], factor);
            let air = self.attenuation.iter().map(|m| libm::exp(-m * length));
            wave.energy.iter_mut().zip(air).for_each(|(energy, air)| *energy *= air);
            visible.push(wave);
        }
        chains.visit(self.geometry, &self.table, at.receiver, self.bins.reach, |found| {
            visible.push(wave(found.length, found.towards, found.order, &found.planes, flat(found.factor)));
        });
        visible
    }

    /// A source's or receiver's place [m] as edges are asked about it, `out` [resolutions] of the planes that it lies in.
    pub(crate) fn beside_planes(&self, place: DVec3, out: f64) -> DVec3 {
        self.edges.as_ref().map_or(place, |edges| edges.beside_planes(self.geometry, place, out))
    }
}
