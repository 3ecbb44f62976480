//! The waves that reach a receiver, by the image source that each belongs to, and their energy.
//!
//! Over an edge come three waves ([`sonel_diffraction::EdgePath`]): one completes the image source that is seen past the edge, two the images of
//! that in the faces of the edge. All waves of an image source are added coherently, with itself where it is visible: so nothing steps where it
//! is cut off. Different image sources add by their energies, as in the rest of the room. In shadow, where neither an image in a face is visible
//! nor its boundary near, its waves are those of a rigid face and are added coherently to the image source seen past the edge: with N the Fresnel
//! number of the clearance from the boundary they pass from the one to the other with the amplitude N²/(N² + 0.04).
//!
//! What passes partitions is not in phase with what goes around them: it belongs to an image source of its own for every set of their materials.
//!
//! Reference: docs/diffraction.md.

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::DVec3;
use sonel_diffraction::{Cell, Complex, Wave};
use sonel_geometry::PlaneId;

use super::{EdgeArrival, Edges, VisibleWave};

/// Differences of path length up to which paths over edges are one arrival [m]: of hidden image sources (29 ms), and beside visible ones (3 ms).
/// Chosen, not measured; doubled, arrivals are fewer and their times less certain.
const SAME_ARRIVAL: [f64; 2] = [10.0, 1.0];

/// Fresnel number at which half of the amplitude of a hidden image in a face is added to that of the image source past the edge. The smaller it
/// is the more is right in shadow.
const HALF: f64 = 0.2;
/// Fresnel number that stands for infinity: shares N²/(N² + 0.04) are 1 to 4e-14.
const FAR: f64 = 1e6;

/// Apparent position of an image source at the receiver, with its mirror planes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Place {
    /// About the scene's centre [m].
    pub position: DVec3,
    /// The planes and objects of its mirrors in ascending order, each that is met an odd number of times once.
    planes: Vec<(PlaneId, u32)>,
    /// Materials of the partitions between them, in ascending order.
    pub through: Vec<u32>,
}

impl Place {
    /// At `position` in `planes`, seen through partitions.
    #[must_use]
    pub(crate) fn new(
        position: DVec3,
        planes: impl IntoIterator<Item = (PlaneId, u32)>,
        through: Vec<u32>,
    ) -> Self {
        let mut planes: Vec<(PlaneId, u32)> = planes.into_iter().collect();
        planes.sort_unstable();
        let odd = planes.chunk_by(|one, other| one == other).filter(|run| run.len() % 2 == 1);
        Self { position, planes: odd.map(|run| run[0]).collect(), through }
    }

    /// About the place.
    #[must_use]
    pub(super) fn key(&self) -> Key {
        (self.position.to_array().map(|x| libm::round(1e3 * x) as i64), self.planes.clone())
    }
}

/// A place in millimetres and planes, to tell most image sources from one another.
pub(super) type Key = ([i64; 3], Vec<(PlaneId, u32)>);

/// The way of sound over the edges of an object.
#[derive(Clone)]
pub(super) struct Route {
    /// The object of the edges.
    pub object: u32,
    /// Factors of the directions of source and receiver on the amplitudes, per band.
    pub gain: Vec<f64>,
    /// The shortest way over the edges [m].
    pub way: f64,
    /// Unit direction from the receiver to where it comes from.
    pub towards: DVec3,
}

/// Waves of one length.
pub(super) struct Part {
    /// The image source that is seen past the edges.
    pub group: usize,
    pub route: Route,
    /// The length with which the amplitudes rotate [m].
    pub length: f64,
    /// Amplitudes of the wave past the edges, one a cell [1/m].
    pub direct: Vec<Complex>,
    /// Parts of the images in the faces.
    pub faces: [FacePart; 2],
}

/// Waves that complete the image in a face.
pub(super) struct FacePart {
    /// Image source of the face; none where nobody knows whether it is visible.
    pub group: Option<usize>,
    /// √((1−α)(1−s)) of the face, per band.
    pub mirrored: Vec<f64>,
    /// Whether the receiver is in the shadow of the image behind the edge.
    pub is_dark: bool,
    /// Share by which both ends are in front of the face, where its image may be visible: 0 … 1.
    pub in_front: f64,
    /// Detour of the path over the edge against that to the image [m].
    pub excess: f64,
    /// Amplitudes, one a cell [1/m].
    pub terms: Vec<Complex>,
}

/// The path of an image source as if nothing were in its way.
pub(super) struct Path {
    /// Amplitude at the receiver, of a source and a receiver that have no direction, per band [1/m].
    pub free: Vec<f64>,
    /// Factors of the directions.
    pub gain: Vec<f64>,
    /// Path length [m].
    pub length: f64,
    /// The objects that block it, or that it misses as a mirror.
    pub blocking: Vec<u32>,
    /// Surfaces that it is mirrored in.
    pub mirrors: Vec<u32>,
}

/// A wave with the way that it has come.
struct Sent {
    wave: Wave,
    route: Route,
}

/// An image source with the waves that belong to it.
struct Group {
    place: Place,
    order: u32,
    /// Index of the visible wave.
    visible: Option<usize>,
    path: Option<Path>,
    /// Least excess over an edge of each object that cuts it off [m].
    clearance: Vec<(u32, f64)>,
    sent: Vec<Sent>,
}

/// All waves at a receiver.
pub(super) struct Field<'a> {
    edges: &'a Edges,
    attenuation: &'a [f64],
    groups: Vec<Group>,
    by_planes: HashMap<Vec<(PlaneId, u32)>, Vec<usize>>,
    same_place: f64,
    parts: Vec<Part>,
}

impl<'a> Field<'a> {
    /// The `visible` waves, and nothing over edges yet. Places nearer than `same_place` [m] are one.
    #[must_use]
    pub(super) fn new(
        edges: &'a Edges,
        attenuation: &'a [f64],
        visible: &[VisibleWave],
        same_place: f64,
    ) -> Self {
        let mut field = Self {
            edges,
            attenuation,
            groups: Vec::new(),
            by_planes: HashMap::new(),
            same_place,
            parts: Vec::new(),
        };
        for (index, wave) in visible.iter().enumerate() {
            let group = field.group(wave.place.clone(), wave.order);
            field.groups[group].visible = Some(index);
        }
        field
    }

    /// The group of the image source at `place`, if it has one.
    #[must_use]
    pub(super) fn find(&self, place: &Place) -> Option<usize> {
        let is_there = |&&group: &&usize| {
            let known = &self.groups[group].place;
            known.position.distance(place.position) <= self.same_place && known.through == place.through
        };
        self.by_planes.get(&place.planes)?.iter().find(is_there).copied()
    }

    /// The group of the image source at `place`.
    pub(super) fn group(&mut self, place: Place, order: u32) -> usize {
        self.find(&place).unwrap_or_else(|| {
            let group = self.groups.len();
            self.by_planes.entry(place.planes.clone()).or_default().push(group);
            self.groups.push(Group {
                place,
                order,
                visible: None,
                path: None,
                clearance: Vec::new(),
                sent: Vec::new(),
            });
            group
        })
    }

    /// Whether nobody has set the path of a group yet.
    #[must_use]
    pub(super) fn lacks_path(&self, group: usize) -> bool {
        self.groups[group].path.is_none()
    }

    /// Sets the path of a group; nothing blocks one that is visible.
    pub(super) fn set_path(&mut self, group: usize, path: Path) {
        let group = &mut self.groups[group];
        let blocking = if group.visible.is_some() { Vec::new() } else { path.blocking };
        group.path = Some(Path { blocking, ..path });
    }

    /// Whether `object` blocks the path of a group.
    #[must_use]
    pub(super) fn is_blocked(&self, group: usize, object: u32) -> bool {
        self.groups[group].path.as_ref().is_some_and(|path| path.blocking.contains(&object))
    }

    /// Position of the image source of a group [m].
    #[must_use]
    pub(super) fn position(&self, group: usize) -> DVec3 {
        self.groups[group].place.position
    }

    /// Notes that an edge of `object` cuts the image source of a group off over which the way is longer by `excess` [m].
    pub(super) fn keep_clear(&mut self, group: usize, object: u32, excess: f64) {
        let clearance = &mut self.groups[group].clearance;
        match clearance.iter_mut().find(|(known, _)| *known == object) {
            Some((_, least)) => *least = least.min(excess),
            None => clearance.push((object, excess)),
        }
    }

    /// The least of these [m].
    fn clearance(&self, group: usize, object: u32) -> f64 {
        let of_object = self.groups[group].clearance.iter().find(|(known, _)| *known == object);
        of_object.map_or(f64::INFINITY, |(_, least)| *least)
    }

    /// Adds waves over edges.
    pub(super) fn add(&mut self, part: Part) {
        self.parts.push(part);
    }

    /// Sets the energies of the `visible` waves that edges change; returns what arrives over edges besides.
    #[must_use]
    pub(super) fn energies(mut self, visible: &mut [VisibleWave]) -> Vec<EdgeArrival> {
        for part in std::mem::take(&mut self.parts) {
            self.share_out(part);
        }
        let mut arrivals = Vec::new();
        for group in self.groups.iter().filter(|group| !group.sent.is_empty()) {
            arrivals.extend(self.arrivals_at(group, visible));
        }
        arrivals
    }

    /// Gives the waves of a part to the groups that they belong to.
    fn share_out(&mut self, part: Part) {
        let Part { group, route, length, mut direct, faces } = part;
        let object = route.object;
        let cells = self.edges.spectrum.cells();
        for face in faces {
            let is_visible = face.group.is_some_and(|group| !self.is_blocked(group, object));
            let clearance = face.group.map_or(face.excess, |group| self.clearance(group, object));
            let mut own = Vec::with_capacity(cells.len());
            for ((sum, term), cell) in direct.iter_mut().zip(face.terms).zip(cells) {
                let mirrored = face.mirrored[cell.band];
                let shaded = |way: f64, half: f64| {
                    let number = (way * cell.k / PI).min(FAR);
                    let near = half * half / (half * half + number * number);
                    1.0 - face.in_front * if face.is_dark || face.group.is_some() { near } else { 1.0 }
                };
                let rigid = if is_visible { 0.0 } else { shaded(clearance, HALF) };
                // Far in its shadow a face is rigid.
                let left = if face.is_dark { shaded(face.excess, 1.0) } else { 1.0 - face.in_front };
                *sum += term * (rigid * (mirrored + (1.0 - mirrored) * left));
                own.push(term * ((1.0 - rigid * rigid).sqrt() * mirrored));
            }
            if let Some(image) = face.group {
                let wave = Wave { length, amplitude: own };
                self.groups[image].sent.push(Sent { wave, route: route.clone() });
            }
        }
        let wave = Wave { length, amplitude: direct };
        self.groups[group].sent.push(Sent { wave, route });
    }

    /// The energy of a group, shared out to the visible wave and to arrivals in proportion to what each brings alone.
    fn arrivals_at(&self, group: &Group, visible: &mut [VisibleWave]) -> Vec<EdgeArrival> {
        let together = SAME_ARRIVAL[usize::from(group.visible.is_some())];
        let heard: Vec<Wave> = group.sent.iter().map(|sent| self.wave(sent, true)).collect();
        let mut sent: Vec<(&Wave, f64, DVec3)> = heard
            .iter()
            .zip(&group.sent)
            .map(|(wave, sent)| (wave, sent.route.way, sent.route.towards))
            .collect();
        let direct = group.visible.map(|index| self.visible(&visible[index]));
        if let (Some(index), Some(direct)) = (group.visible, &direct) {
            sent.push((direct, 0.0, visible[index].towards));
        }
        sent.sort_by(|one, other| one.1.total_cmp(&other.1));
        let mut energies: Vec<(f64, DVec3, Vec<f64>)> = Vec::new();
        let mut first = 0;
        for next in 1..=sent.len() {
            let start = if first == 0 && direct.is_some() { sent[0].0.length } else { sent[first].1 };
            if next == sent.len() || sent[next].1 > start + together {
                let waves: Vec<&Wave> = sent[first..next].iter().map(|sent| sent.0).collect();
                energies.push((start, sent[first].2, self.edges.spectrum.energy(&waves)));
                first = next;
            }
        }
        let total = self.total(group);
        for (band, total) in total.into_iter().enumerate() {
            let sum: f64 = energies.iter().map(|(.., energy)| energy[band]).sum();
            let gain = total / sum.max(f64::MIN_POSITIVE);
            energies.iter_mut().for_each(|(.., energy)| energy[band] *= gain);
        }
        let mut energies = energies.into_iter().map(|(length, towards, energy)| EdgeArrival {
            length,
            towards,
            order: group.order,
            energy: energy.into_iter().map(|energy| energy / (4.0 * PI)).collect(),
        });
        if let Some(index) = group.visible
            && let Some(first) = energies.next()
        {
            visible[index].energy = first.energy;
        }
        energies.collect()
    }

    /// The energy of a group per band [1/m²]: that past the object which leaves least of it, times what other objects leave.
    fn total(&self, group: &Group) -> Vec<f64> {
        let path = group.path.as_ref().expect("waves have a path");
        let mut objects: Vec<u32> = group.sent.iter().map(|sent| sent.route.object).collect();
        objects.extend(&path.blocking);
        objects.sort_unstable();
        objects.dedup();
        if let [object] = objects[..] {
            return self.past_object(group, object, true);
        }
        let alone = self.edges.spectrum.energy(&[self.past(path, None, false)]);
        let left = objects.iter().map(|&object| {
            let energies = self.past_object(group, object, false).into_iter().zip(&alone);
            energies.map(|(energy, alone)| energy / alone.max(f64::MIN_POSITIVE)).collect::<Vec<f64>>()
        });
        let left: Vec<Vec<f64>> = left.collect();
        let sum = |number: &usize| left[*number].iter().sum::<f64>();
        let least = (0..objects.len()).min_by(|a, b| sum(a).total_cmp(&sum(b))).expect("objects");
        let past_one = self.past_object(group, objects[least], true).into_iter().enumerate();
        past_one
            .map(|(band, energy)| {
                let of_band: Vec<(f64, u32)> =
                    left.iter().zip(&objects).map(|(left, object)| (left[band], *object)).collect();
                let of_all = self.combined(of_band, band);
                energy * of_all / left[least][band].max(f64::MIN_POSITIVE)
            })
            .collect()
    }

    /// What all objects leave of the energy in a band, of what each leaves: the two greatest gains count, the greatest loss, and the second one as far
    /// as it does beside that.
    fn combined(&self, mut left: Vec<(f64, u32)>, band: usize) -> f64 {
        left.sort_by(|one, other| one.0.total_cmp(&other.0));
        let gains: f64 = left.iter().rev().take(2).map(|(left, _)| left.max(1.0)).product();
        let losses = match left[..] {
            [] => 1.0,
            [(only, _)] => only.min(1.0),
            [(first, one), (second, other), ..] => {
                let share = self.edges.objects.second([one, other], self.edges.centres[band]);
                first.min(1.0) * libm::pow(second.min(1.0), share)
            }
        };
        gains * losses
    }

    /// The energy of a group past one object alone, per band [1/m²]; `heard` by a source and a receiver with their directions or without.
    fn past_object(&self, group: &Group, object: u32, heard: bool) -> Vec<f64> {
        let path = group.path.as_ref().expect("waves have a path");
        let sent = group.sent.iter().filter(|sent| sent.route.object == object);
        let mut waves: Vec<Wave> = sent.map(|sent| self.wave(sent, heard)).collect();
        waves.push(self.past(path, Some(object), heard));
        self.edges.spectrum.energy(&waves)
    }

    /// A path straight past an `object`: a small one hides little of it and mirrors little.
    fn past(&self, path: &Path, object: Option<u32>, heard: bool) -> Wave {
        let amplitude = |cell: &Cell| {
            let left = object.map_or(1.0, |object| {
                let described = self.edges.objects.described(object, cell.k);
                match (path.mirrors.contains(&object), path.blocking.contains(&object)) {
                    (true, true) => 0.0,
                    (true, false) => described,
                    (false, true) => 1.0 - described,
                    (false, false) => 1.0,
                }
            });
            let gain = if heard { path.gain[cell.band] } else { 1.0 };
            Complex::real(path.free[cell.band] * gain * left)
        };
        let amplitude = self.edges.spectrum.cells().iter().map(amplitude).collect();
        Wave { length: path.length, amplitude }
    }

    /// A wave that has been sent, `heard` by a source and a receiver with their directions or without.
    fn wave(&self, sent: &Sent, heard: bool) -> Wave {
        let Sent { wave, route } = sent;
        let gain = |cell: &Cell| {
            self.edges.objects.described(route.object, cell.k)
                * if heard { route.gain[cell.band] } else { 1.0 }
        };
        let cells = wave.amplitude.iter().zip(self.edges.spectrum.cells());
        let amplitude = cells.map(|(amplitude, cell)| *amplitude * gain(cell)).collect();
        Wave { length: wave.length, amplitude }
    }

    /// A visible wave without edges.
    fn visible(&self, wave: &VisibleWave) -> Wave {
        let amplitude = |band: usize| {
            (wave.factor[band] * libm::exp(-self.attenuation[band] * wave.length)).sqrt() / wave.length
        };
        let cells = self.edges.spectrum.cells().iter();
        Wave {
            length: wave.length,
            amplitude: cells.map(|cell| Complex::real(amplitude(cell.band))).collect(),
        }
    }
}
