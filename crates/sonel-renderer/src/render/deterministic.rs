//! Deterministic path classes at every receiver: L R and L S^k R, with edge diffraction.

use glam::DVec3;
use rayon::prelude::*;
use sonel_acoustics::Pattern;
use sonel_map::lanes::to_lanes;
use sonel_map::{Lanes, lanes_of};

use super::Renderer;
use crate::deposit::{Deposits, add_lanes};
use crate::exact::direct::{DirectWay, direct_way, spread};
use crate::exact::edge::{Edges, Images, Listening, Place, RECEIVER_OUT, VisibleWave};
use crate::exact::mirror::{MirrorArrival, MirrorChains, Radiator};
use crate::path_class::PathClass;
use crate::receiver::{PreparedReceiver, axes};
use crate::rendering::{CoarseEchogram, DiscreteArrival, EdgeWork, Rendering};

/// Mirror arrivals up to this order are listed one by one unless an order was asked for.
const LISTED_ORDER: u32 = 6;

/// The classes, as [`Part`] lists them.
const CLASSES: [PathClass; 3] = [PathClass::Direct, PathClass::MirrorChain, PathClass::Edge];

/// What one receiver hears.
struct Part {
    fine: Deposits,
    coarse: Vec<CoarseEchogram>,
    classes: [Vec<Lanes>; CLASSES.len()],
    arrivals: Vec<DiscreteArrival>,
    edge_work: Option<EdgeWork>,
}

impl Renderer<'_> {
    /// Adds direct sound and mirror chains to `rendering`, and to each of its batches.
    pub(crate) fn add_deterministic(
        &self,
        rendering: &mut Rendering,
        (source, radiator): (usize, Radiator<'_>),
        chains: &MirrorChains<'_>,
        receivers: &[PreparedReceiver],
        borders: &[Vec<f64>],
    ) {
        let air = self.map.header().scene.air_at_source(source);
        let edges = self.edges_in(air);
        let images =
            edges.map(|edges| edges.of_source(self.geometry, &self.table, radiator.position, chains));
        let over_edges = edges.zip(images.as_ref());
        let parts: Vec<Part> = receivers
            .par_iter()
            .zip(borders)
            .enumerate()
            .map(|(index, (receiver, borders))| {
                self.arrivals_at(index, (air, radiator), chains, over_edges, receiver, borders)
            })
            .collect();
        for (index, part) in parts.into_iter().enumerate() {
            rendering.total.add_receivers(index * rendering.columns.fine, &part.fine, 1.0);
            for batch in &mut rendering.batches {
                batch.extend(part.coarse.iter().cloned());
            }
            let nothing = CoarseEchogram::new(borders[index].len(), self.table.bands());
            for differences in &mut rendering.kernel_differences {
                differences.extend(part.coarse.iter().map(|_| nothing.clone()));
            }
            for (class, energy) in CLASSES.into_iter().zip(&part.classes) {
                rendering.book(class, index, 1.0, energy);
            }
            rendering.arrivals.extend(part.arrivals);
            rendering.edge_work.extend(part.edge_work);
        }
    }

    fn arrivals_at(
        &self,
        index: usize,
        (air, radiator): (u32, Radiator<'_>),
        chains: &MirrorChains<'_>,
        over_edges: Option<(&Edges, &Images)>,
        receiver: &PreparedReceiver,
        borders: &[f64],
    ) -> Part {
        let bands = self.table.bands();
        let axes = axes(std::slice::from_ref(receiver));
        let columns = axes.columns();
        let mut part = Part {
            fine: Deposits::new(columns.fine, self.bins.count, bands),
            coarse: vec![CoarseEchogram::new(borders.len(), bands); columns.coarse],
            classes: CLASSES.map(|_| vec![[0.0; 4]; lanes_of(bands)]),
            arrivals: Vec::new(),
            edge_work: None,
        };
        // All of it is in the air of the source, and so is the receiver if anything arrives.
        let own_air = self.regions.as_ref().map(|regions| regions.air(air));
        let (stretch, impedance) = own_air.map_or((1.0, 1.0), |air| (air.stretch, air.impedance));
        let mut deposit = |class: usize, arrival: DiscreteArrival, energy: &[Lanes], listed: bool| {
            let arrival = DiscreteArrival { length: arrival.length * stretch, ..arrival };
            let own: Vec<Lanes>;
            let energy = if own_air.is_some() {
                own = energy.iter().map(|lanes| lanes.map(|band| band * impedance)).collect();
                &own
            } else {
                energy
            };
            let Some(bin) = self.bins.bin(arrival.length) else { return };
            let weights = axes.weights(0, arrival.towards.into()).into_iter().flatten();
            for (column, weight) in std::iter::once(1.0).chain(weights).enumerate() {
                part.fine.add_times(column, bin, energy, weight);
                if let Some(coarse) = part.coarse.get_mut(column) {
                    coarse.add_arrival(borders, self.bins.time(arrival.length), energy, weight);
                }
            }
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
            attenuation: own_air.map_or(&self.attenuation, |air| &air.attenuation),
            radiator,
            receiver: place,
            sensitivity: receiver.sensitivity,
            complete_order: chains.order(),
        };
        let listed = self.settings.mirror_order.unwrap_or(LISTED_ORDER);
        let class = |order: u32| usize::from(order > 0);
        let Some((edges, images)) = over_edges else {
            self.visit_visible(&at, chains, air, |wave, energy| {
                let found = bare(wave.length, wave.towards, wave.order, false);
                deposit(class(wave.order), found, energy, wave.order <= listed);
            });
            part.arrivals.sort_by(|a, b| a.length.total_cmp(&b.length));
            return part;
        };
        let mut visible = self.visible(&at, chains, air);
        let is_clear = visible.iter().any(|wave| wave.order == 0 && wave.place.through.is_empty());
        let sound = edges.arrivals_at(&at, images, &mut visible);
        for arrival in sound.arrivals {
            let found = bare(arrival.length, arrival.towards, arrival.order, true);
            // Beside a clear direct path edges are many and weak: they are heard but not listed.
            deposit(2, found, &to_lanes(arrival.energy), !is_clear && arrival.order <= listed);
        }
        for wave in visible {
            let found = bare(wave.length, wave.towards, wave.order, false);
            deposit(class(wave.order), found, &to_lanes(wave.energy), wave.order <= listed);
        }
        part.edge_work = Some(sound.work);
        part.arrivals.sort_by(|a, b| a.length.total_cmp(&b.length));
        part
    }

    /// Direct sound and the image sources of `chains` that are visible from the receiver, without edges.
    fn visible(&self, at: &Listening<'_>, chains: &MirrorChains<'_>, air: u32) -> Vec<VisibleWave> {
        let bands = self.table.bands();
        let flat = |lanes: &[Lanes]| (0..bands).map(|band| lanes[band / 4][band % 4]).collect::<Vec<f64>>();
        let mut visible = Vec::new();
        self.visit_visible(at, chains, air, |found, energy| {
            // Of an arc, the place that it begins at.
            let position = match at.table.profile() {
                Some(_) => at.radiator.position,
                None => at.receiver + found.towards * found.length,
            };
            visible.push(VisibleWave {
                place: Place::new(position, found.planes.iter().copied(), found.through.clone()),
                length: found.length,
                towards: found.towards,
                order: found.order,
                factor: flat(found.factor),
                energy: flat(energy),
            });
        });
        visible
    }

    /// Visits direct sound, as an arrival over no mirror, and the image sources of `chains` that are visible from the receiver, each with its
    /// energy after air [1/m²].
    fn visit_visible(
        &self,
        at: &Listening<'_>,
        chains: &MirrorChains<'_>,
        air: u32,
        mut visit: impl FnMut(&MirrorArrival<'_>, &[Lanes]),
    ) {
        let own_air = self.regions.as_ref().map(|regions| regions.air(air));
        let reach = self.bins.reach / own_air.map_or(1.0, |air| air.stretch);
        let table = own_air.map_or(self.air.as_ref(), |air| air.table.as_ref());
        let bands = self.table.bands();
        let direct = direct_way(self.geometry, &self.table, at.radiator.position, at.receiver);
        if let Some(DirectWay { length, departing, towards, spread, passed }) = direct {
            let radiation = at.radiator.towards(departing);
            let sensitivity = at.sensitivity.to(towards);
            let factors: Vec<f64> = (0..bands).map(|band| radiation.factor(band) * sensitivity).collect();
            let energy = factors.iter().zip(at.attenuation);
            let energy = energy.map(|(factor, m)| factor * spread * libm::exp(-m * length));
            let (mut energy, mut factors) = (to_lanes(energy), to_lanes(factors.iter().copied()));
            passed.weaken(self.geometry, &self.table, &mut factors);
            passed.weaken(self.geometry, &self.table, &mut energy);
            if at.table.profile().is_some() {
                let even = self::spread(length);
                factors.iter_mut().flatten().for_each(|factor| *factor *= spread / even);
            }
            let direct = MirrorArrival {
                length,
                towards,
                order: 0,
                planes: vec![],
                factor: &factors,
                through: passed.materials(self.geometry),
            };
            visit(&direct, &energy);
        }
        let mut energy = vec![[0.0; 4]; lanes_of(bands)];
        chains.visit(self.geometry, &self.table, at.receiver, reach, |found| {
            let (rendered, directional);
            let found = if at.sensitivity.pattern == Pattern::Omni {
                found
            } else {
                let sensitivity = at.sensitivity.to(found.towards);
                rendered = found
                    .factor
                    .iter()
                    .map(|lanes| lanes.map(|factor| factor * sensitivity))
                    .collect::<Vec<_>>();
                let (planes, through) = (found.planes.clone(), found.through.clone());
                directional = MirrorArrival { factor: &rendered, planes, through, ..*found };
                &directional
            };
            let spreading = spread(found.length);
            for (energy, factor) in energy.iter_mut().zip(found.factor) {
                *energy = factor.map(|factor| factor * spreading);
            }
            if let Some(air) = table {
                air.attenuate(found.length, &mut energy);
            }
            visit(found, &energy);
        });
    }

    /// A source's or receiver's place [m] as edges are asked about it, `out` [resolutions] of the planes that it lies in.
    pub(crate) fn beside_planes(&self, place: DVec3, out: f64) -> DVec3 {
        self.edges.first().map_or(place, |edges| edges.beside_planes(self.geometry, place, out))
    }
}
