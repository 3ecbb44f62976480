//! Deterministic path classes at every receiver: L R and L S^k R, with edge diffraction.

use glam::DVec3;
use rayon::prelude::*;
use sonel_acoustics::Pattern;
use sonel_map::{BandValues, Lanes, lanes_of, to_lanes};

use super::{Preparation, Renderer};
use crate::deposit::Deposits;
use crate::directions::Axes;
use crate::exact::direct::{DirectWay, direct_way, spread};
use crate::exact::edge::{Edges, Images, ReceiverContext, VisibleWave};
use crate::exact::mirror::{ImageSources, MirrorArrival, Radiator};
use crate::path_class::PathClass;
use crate::receiver::{PreparedReceiver, axes};
use crate::regions::RegionAir;
use crate::rendering::{CoarseEchogram, DiscreteArrival, EdgeWork, Rendering};

/// Order up to which image-source arrivals are listed one by one unless an order was asked for. Chosen, not measured; doubled, a box lists
/// 2625 arrivals instead of 377.
const LISTED_ORDER: u32 = 6;

/// The classes, as [`ReceiverArrivals`] lists them.
const CLASSES: [PathClass; 3] = [PathClass::Direct, PathClass::ImageSource, PathClass::Edge];

/// Deterministic sound of a source, common to all receivers.
struct Emitted<'a> {
    /// Number of the air at the source.
    air: u32,
    radiator: Radiator<'a>,
    image_sources: &'a ImageSources,
    /// What edges see of the source, where any diffract.
    over_edges: Option<&'a Images<'a>>,
    /// Share of the map's batches that is rendered.
    share: f64,
}

/// Deterministic arrivals at one receiver.
struct ReceiverArrivals<'a> {
    renderer: &'a Renderer<'a>,
    index: usize,
    /// Time borders of the batches [s].
    borders: &'a [f64],
    axes: Axes,
    /// The air of the source: all of it is in that, and so is the receiver if anything arrives.
    air: &'a RegionAir,
    /// Factors of the boundary term.
    boundary: &'a [Lanes],
    /// Energy of the arrival that is added, times ρc of its air over that of the scene.
    arriving: Vec<Lanes>,
    fine: Deposits,
    coarse: Vec<CoarseEchogram>,
    classes: [Vec<Lanes>; CLASSES.len()],
    arrivals: Vec<DiscreteArrival>,
    edge_work: Option<EdgeWork>,
}

impl<'a> ReceiverArrivals<'a> {
    /// Nothing yet, at `receiver` number `index`.
    fn new(
        renderer: &'a Renderer<'a>,
        index: usize,
        receiver: &'a PreparedReceiver,
        air: &'a RegionAir,
        borders: &'a [f64],
    ) -> Self {
        let bands = renderer.prepared.table.bands();
        let axes = axes(std::slice::from_ref(receiver));
        let columns = axes.columns();
        Self {
            renderer,
            index,
            borders,
            axes,
            air,
            boundary: &receiver.boundary,
            arriving: vec![Lanes::ZERO; lanes_of(bands)],
            fine: Deposits::new(columns.fine, renderer.prepared.bins.count, bands),
            coarse: vec![CoarseEchogram::new(borders.len(), bands); columns.coarse],
            classes: CLASSES.map(|_| vec![Lanes::ZERO; lanes_of(bands)]),
            arrivals: Vec::new(),
            edge_work: None,
        }
    }

    /// Adds the `energy` of an arrival of `class` by its length, direction and order, by itself where it is `listed`.
    fn add(&mut self, class: usize, length: f64, towards: DVec3, order: u32, energy: &[Lanes], listed: bool) {
        let length = length * self.air.stretch;
        self.arriving.set_times(energy, self.air.impedance);
        if order > 0 {
            self.arriving.multiply(self.boundary);
        }
        let energy = &self.arriving[..];
        let Preparation { bins, table, .. } = &*self.renderer.prepared;
        let Some(bin) = bins.bin(length) else { return };
        let weights = self.axes.weights(0, towards).into_iter().flatten();
        for (column, weight) in std::iter::once(1.0).chain(weights).enumerate() {
            self.fine.add_times(column, bin, energy, weight);
            if let Some(coarse) = self.coarse.get_mut(column) {
                coarse.add_arrival(self.borders, bins.time(length), energy, weight);
            }
        }
        self.classes[class].add(energy);
        if listed {
            let energy = energy.values().take(table.bands()).collect();
            let (receiver, over_edges) = (self.index, CLASSES[class] == PathClass::Edge);
            let towards = towards.to_array();
            self.arrivals.push(DiscreteArrival { receiver, length, energy, towards, order, over_edges });
        }
    }
}

impl Renderer<'_> {
    /// Adds direct sound, image-source paths and edges to `rendering`, which has all else, and to each of its batches.
    pub(crate) fn add_deterministic(
        &self,
        rendering: &mut Rendering,
        source: usize,
        radiator: Radiator<'_>,
        image_sources: &ImageSources,
        receivers: &[PreparedReceiver],
        borders: &[Vec<f64>],
    ) {
        let air = self.map.header().scene.air_at_source(source);
        let edges = self.edges_in(air);
        let images = edges.map(|edges| {
            edges.of_source(self.geometry, &self.prepared.table, radiator.position, image_sources)
        });
        let share = rendering.batches.len() as f64 / self.prepared.emissions.batches.len() as f64;
        let emitted = Emitted { air, radiator, image_sources, over_edges: images.as_ref(), share };
        let parts: Vec<ReceiverArrivals<'_>> = receivers
            .par_iter()
            .zip(borders)
            .enumerate()
            .map(|(index, (receiver, borders))| {
                let bands = 0..self.prepared.table.bands();
                let others: Vec<f64> = bands.map(|band| rendering.energy(index, band)).collect();
                self.arrivals_at(index, &emitted, receiver, borders, &others)
            })
            .collect();
        for (index, part) in parts.into_iter().enumerate() {
            rendering.total.add_receivers(index * rendering.columns.fine, &part.fine, 1.0);
            let first = index * rendering.columns.coarse;
            for batch in &mut rendering.batches {
                batch[first..].iter_mut().zip(&part.coarse).for_each(|(batch, arrived)| batch.add(arrived));
            }
            for (class, energy) in CLASSES.into_iter().zip(&part.classes) {
                rendering.record(class, index, 1.0, energy);
            }
            rendering.arrivals.extend(part.arrivals);
            rendering.edge_work.extend(part.edge_work);
        }
    }

    /// Arrivals at `receiver` number `index`, where all other classes bring `others` per band [1/m²].
    fn arrivals_at<'b>(
        &'b self,
        index: usize,
        emitted: &Emitted<'_>,
        receiver: &'b PreparedReceiver,
        borders: &'b [f64],
        others: &[f64],
    ) -> ReceiverArrivals<'b> {
        let Emitted { air, radiator, image_sources, over_edges, share } = *emitted;
        let air = self.prepared.airs.air(air);
        let mut part = ReceiverArrivals::new(self, index, receiver, air, borders);
        let at = ReceiverContext {
            geometry: self.geometry,
            table: &self.prepared.table,
            attenuation: &air.attenuation,
            radiator,
            receiver: receiver.exact,
            sensitivity: receiver.sensitivity,
            complete_order: image_sources.order(),
            share,
        };
        let listed = self.prepared.settings.mirror_order.unwrap_or(LISTED_ORDER);
        let class = |order: u32| usize::from(order > 0);
        match over_edges {
            None => self.visit_visible(&at, emitted, |wave, energy| {
                let MirrorArrival { length, towards, order, .. } = *wave;
                part.add(class(order), length, towards, order, energy, order <= listed);
            }),
            Some(images) => {
                let mut visible = self.visible(images.edges, &at, emitted);
                let is_clear = visible.iter().any(|wave| wave.order == 0 && wave.place.through.is_empty());
                let (arrivals, work) = images.edges.arrivals_at(&at, images, &mut visible, others);
                for arrival in arrivals {
                    // Beside a clear direct path edges are many and weak: they count but are not listed.
                    let listed = !is_clear && arrival.order <= listed;
                    let energy = to_lanes(arrival.energy);
                    part.add(2, arrival.length, arrival.towards, arrival.order, &energy, listed);
                }
                for VisibleWave { length, towards, order, energy, .. } in visible {
                    part.add(class(order), length, towards, order, &to_lanes(energy), order <= listed);
                }
                part.edge_work = Some(work);
            }
        }
        self.visit_levels(&at, |wave, energy| {
            part.add(1, wave.length, wave.towards, wave.order, energy, wave.order <= listed);
        });
        part.arrivals.sort_by(|a, b| a.length.total_cmp(&b.length));
        part
    }

    /// Direct sound and the image sources of `image_sources` that are visible from the receiver, without edges.
    fn visible(&self, edges: &Edges, at: &ReceiverContext<'_>, emitted: &Emitted<'_>) -> Vec<VisibleWave> {
        let bands = self.prepared.table.bands();
        let mut visible = Vec::new();
        self.visit_visible(at, emitted, |found, energy| {
            let ends = [at.radiator.position, at.receiver];
            visible.push(edges.visible(self.geometry, ends, found, energy.values().take(bands).collect()));
        });
        visible
    }

    /// Visits direct sound, as an arrival over no mirror, and the image sources of `image_sources` that are visible from the receiver, each with its
    /// energy after air [1/m²].
    fn visit_visible(
        &self,
        at: &ReceiverContext<'_>,
        emitted: &Emitted<'_>,
        mut visit: impl FnMut(&MirrorArrival<'_>, &[Lanes]),
    ) {
        self.visit_direct(at, &mut visit);
        let air = self.prepared.airs.air(emitted.air);
        let reach = self.prepared.bins.reach / air.stretch;
        let mut energy = vec![Lanes::ZERO; lanes_of(self.prepared.table.bands())];
        emitted.image_sources.visit(
            self.geometry,
            &self.prepared.table,
            emitted.radiator,
            at.receiver,
            reach,
            |found| {
                let (rendered, directional);
                let found = if at.sensitivity.pattern == Pattern::Omni {
                    found
                } else {
                    let sensitivity = at.sensitivity.to(found.towards);
                    rendered = found.factor.iter().map(|&factor| factor * sensitivity).collect::<Vec<_>>();
                    let (mirrors, through) = (found.mirrors.clone(), found.through.clone());
                    directional = MirrorArrival { factor: &rendered, mirrors, through, ..*found };
                    &directional
                };
                energy.set_times(found.factor, spread(found.length));
                air.table.attenuate(found.length, &mut energy);
                visit(found, &energy);
            },
        );
    }

    /// Visits direct sound, where nothing hides it.
    fn visit_direct(&self, at: &ReceiverContext<'_>, visit: &mut impl FnMut(&MirrorArrival<'_>, &[Lanes])) {
        let direct = direct_way(self.geometry, &self.prepared.table, at.radiator.position, at.receiver);
        if let Some(way) = direct {
            self.arrive(at, way, visit);
        }
    }

    /// Visits reflections at level surfaces where the speed of sound has a gradient.
    fn visit_levels(&self, at: &ReceiverContext<'_>, mut visit: impl FnMut(&MirrorArrival<'_>, &[Lanes])) {
        let ends = [at.radiator.position, at.receiver];
        for way in self.prepared.levels.iter().flat_map(|it| it.ways(self.geometry, at.table, ends)) {
            self.arrive(at, way, &mut visit);
        }
    }

    /// Visits what comes along `way`.
    fn arrive(
        &self,
        at: &ReceiverContext<'_>,
        way: DirectWay,
        visit: &mut impl FnMut(&MirrorArrival<'_>, &[Lanes]),
    ) {
        let DirectWay { length, departing, towards, spread, passed, mirrors } = way;
        let radiation = at.radiator.towards(departing);
        let sensitivity = at.sensitivity.to(towards);
        let bands = 0..self.prepared.table.bands();
        let factors: Vec<f64> = bands.map(|band| radiation.factor(band) * sensitivity).collect();
        let energy = factors.iter().zip(at.attenuation);
        let energy = energy.map(|(factor, m)| factor * spread * libm::exp(-m * length));
        let (mut energy, mut factors) = (to_lanes(energy), to_lanes(factors.iter().copied()));
        passed.attenuate(&self.prepared.table, &mut factors);
        passed.attenuate(&self.prepared.table, &mut energy);
        for &mirror in &mirrors {
            let specular = &at.table.mean_row(mirror).specular.energy;
            factors.multiply(specular);
            energy.multiply(specular);
        }
        if !at.table.propagation().is_straight() || passed.thickness() > 0.0 {
            factors.scale(spread / self::spread(length));
        }
        let direct = MirrorArrival {
            length,
            towards,
            order: mirrors.len() as u32,
            mirrors: vec![],
            factor: &factors,
            through: passed.materials(self.geometry),
        };
        visit(&direct, &energy);
    }
}
