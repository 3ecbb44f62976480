//! Random buildings whose walls are solids, drawn in four styles, and the air in them as thin shells.
//!
//! Rooms stand on a grid of walls and slabs with thickness. There are doors between rooms, windows with panes, columns and storeys. All
//! is made of boxes between the planes of an uneven grid, so that volume, area and image sources of every room are those of its shell.

use crate::numbers::Numbers;
use glam::{DMat3, DVec3, dvec3};
use sonel_geometry::{Departure, FaceKind, Geometry, Mesh, MeshTriangle};
use std::collections::{BTreeMap, BTreeSet};

/// Buildings in four styles each; the larger number in release, where `cargo xtask accept` runs it.
const BUILDINGS: u64 = if cfg!(debug_assertions) { 8 } else { 1000 };
/// Relative error of volumes and areas: corners that lie within the resolution of one another are joined, 1e-7 of the building each.
const ROUNDING: f64 = 1e-6;
/// Rays from the middle of each room, which meet the same places of the same materials as among shells.
const RAYS: usize = 100;
/// Distance of their planes [m]: positions are rounded to 1e-6 m in buildings of 20 m.
const OFF_PLANE: f64 = 1e-5;
/// Distance of such places [m]: hits keep off the rim of their triangle, by millimetres where faces meet at an acute angle.
const APART: f64 = 1e-2;

/// How solids are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Style {
    /// Boxes that touch.
    Butted,
    /// Boxes that reach into one another.
    Overlapping,
    /// One shell around all rooms and one around each, and boxes for columns and panes.
    Shells,
    /// The surface of everything solid, its front towards the air.
    Single,
}

impl Style {
    /// All styles.
    const ALL: [Self; 4] = [Self::Butted, Self::Overlapping, Self::Shells, Self::Single];
}

/// Materials of slabs, walls, columns and panes.
const SLAB: u32 = 0;
const WALL: u32 = 1;
const COLUMN: u32 = 2;
const PANE: u32 = 3;
/// Shares of a room at which openings and columns begin and end.
const CUTS: [f64; 4] = [0.25, 0.45, 0.6, 0.7];
/// Pieces of a room and of a wall along an axis.
const OF_ROOM: usize = CUTS.len() + 1;
const OF_WALL: usize = 3;
/// One building in so many is turned and moved.
const TURNED: usize = 3;

/// A place on the grid.
type Voxel = [usize; 3];

/// What is between the planes of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Filling {
    Air,
    /// A part with its number and material.
    Solid(usize, u32),
}

/// A room, or several that open doors join.
#[derive(Debug, Clone)]
struct Air {
    /// Volume [m³].
    volume: f64,
    /// Area by material [m²].
    areas: BTreeMap<u32, f64>,
    /// Places in it, one in the middle of each of its rooms [m].
    places: Vec<DVec3>,
}

/// A random building.
struct SolidBuilding {
    /// Coordinates of the planes of each axis [m].
    planes: [Vec<f64>; 3],
    filling: BTreeMap<Voxel, Filling>,
    /// Middles of the rooms.
    rooms: Vec<Voxel>,
    frame: (DMat3, DVec3),
    random: Numbers,
}

impl SolidBuilding {
    /// The building of a seed.
    fn new(seed: u64) -> Self {
        let mut random = Numbers(seed);
        let count = loop {
            let count = [1 + random.below(3), 1 + random.below(3), 1 + random.below(2)];
            if (2..=12).contains(&count.iter().product::<usize>()) {
                break count;
            }
        };
        let mut planes = [0, 1, 2].map(|axis| axis_planes(&mut random, count[axis], axis == 2));
        planes.iter_mut().flatten().for_each(|plane| *plane = (*plane * 1000.0).round() / 1000.0);
        let frame = if random.below(TURNED) == 0 {
            let mut unit = || random.unit();
            let along = dvec3(unit() - 0.5, unit() - 0.5, unit() + 0.1).normalize();
            (DMat3::from_axis_angle(along, 6.0 * unit()), dvec3(100.0 * unit(), -50.0 * unit(), unit()))
        } else {
            (DMat3::IDENTITY, DVec3::ZERO)
        };
        let mut building = Self { planes, filling: BTreeMap::new(), rooms: Vec::new(), frame, random };
        building.fill(count);
        building
    }

    /// Fills walls, rooms, openings and columns.
    fn fill(&mut self, count: Voxel) {
        let size = [0, 1, 2].map(|axis| self.planes[axis].len() - 1);
        let is_wall = |at: usize| at % (OF_WALL + OF_ROOM) < OF_WALL;
        let part = |at: usize| at / (OF_WALL + OF_ROOM);
        for voxel in voxels([0; 3], size) {
            let in_wall = voxel.map(is_wall);
            let [i, j, k] = voxel.map(part);
            let filling = match in_wall {
                [_, _, true] => Filling::Solid(k, SLAB),
                [true, _, _] => Filling::Solid(100 + 10 * i + k, WALL),
                [_, true, _] => Filling::Solid(1000 + 100 * i + 10 * j + k, WALL),
                [false, false, false] => Filling::Air,
            };
            self.filling.insert(voxel, filling);
        }
        let first = |at: usize| at * (OF_WALL + OF_ROOM) + OF_WALL;
        for room in voxels([0; 3], count) {
            let from = room.map(first);
            self.rooms.push(from.map(|at| at + 2));
            for axis in 0..2 {
                let is_last = room[axis] + 1 == count[axis];
                let wall = from[axis] + OF_ROOM;
                let (mut low, mut high) = (from, from);
                (low[axis], high[axis]) = (wall, wall + OF_WALL);
                (low[1 - axis], high[1 - axis]) = (from[1 - axis] + 1, from[1 - axis] + 3);
                match (is_last, self.random.below(3)) {
                    // A door.
                    (false, 0) => {
                        high[2] = low[2] + 4;
                        self.put(low, high, Filling::Air);
                    }
                    // A window, its pane in the middle of the wall.
                    (true, 0) => {
                        (low[2], high[2]) = (from[2] + 2, from[2] + 4);
                        self.put(low, high, Filling::Air);
                        (low[axis], high[axis]) = (wall + 1, wall + 2);
                        let number = 10_000
                            + self.filling.len()
                            + wall * 31
                            + from[1 - axis]
                            + 7 * axis
                            + 1000 * from[2];
                        self.put(low, high, Filling::Solid(number, PANE));
                    }
                    _ => {}
                }
            }
            if self.random.below(4) == 0 {
                let [x, y, z] = from;
                let number = 100_000 + 10_000 * x + 100 * y + z;
                self.put([x + 3, y + 3, z], [x + 4, y + 4, z + OF_ROOM], Filling::Solid(number, COLUMN));
            }
        }
    }

    fn put(&mut self, low: Voxel, high: Voxel, filling: Filling) {
        for voxel in voxels(low, high) {
            self.filling.insert(voxel, filling);
        }
    }

    /// The material at a voxel; none in air and outside.
    fn material(&self, voxel: Option<Voxel>) -> Option<u32> {
        match self.filling.get(&voxel?)? {
            Filling::Solid(_, material) => Some(*material),
            Filling::Air => None,
        }
    }

    fn corner(&self, at: Voxel) -> DVec3 {
        dvec3(self.planes[0][at[0]], self.planes[1][at[1]], self.planes[2][at[2]])
    }

    fn placed(&self, place: DVec3) -> DVec3 {
        self.frame.0 * place + self.frame.1
    }

    /// The air of each room, in the order of their first places. Outside of panes is none.
    fn airs(&self) -> Vec<Air> {
        let mut seen: BTreeSet<Voxel> = BTreeSet::new();
        let mut airs = Vec::new();
        for &room in &self.rooms {
            if !seen.insert(room) {
                continue;
            }
            let mut open = vec![room];
            let mut air = Air { volume: 0.0, areas: BTreeMap::new(), places: Vec::new() };
            while let Some(voxel) = open.pop() {
                let size = self.corner(voxel.map(|at| at + 1)) - self.corner(voxel);
                air.volume += size.element_product();
                if self.rooms.contains(&voxel) {
                    air.places.push(self.placed(self.corner(voxel) + 0.5 * size));
                }
                for (axis, far) in faces() {
                    let next = neighbour(voxel, axis, far);
                    match self.material(next) {
                        Some(material) => {
                            *air.areas.entry(material).or_default() +=
                                size[(axis + 1) % 3] * size[(axis + 2) % 3];
                        }
                        None => open.extend(next.filter(|next| seen.insert(*next))),
                    }
                }
            }
            airs.push(air);
        }
        airs
    }

    /// The air in rooms as thin shells.
    fn shells(&self) -> Mesh {
        let mut mesh = Mesh::default();
        let inner = self.inner();
        for &voxel in &inner {
            for (axis, far) in faces() {
                let next = neighbour(voxel, axis, far);
                if let Some(material) = self.material(next) {
                    self.add_face(&mut mesh, voxel, (axis, far), material, true);
                }
            }
        }
        mesh
    }

    /// The air that is in rooms.
    fn inner(&self) -> BTreeSet<Voxel> {
        let mut inner: BTreeSet<Voxel> = self.rooms.iter().copied().collect();
        let mut open: Vec<Voxel> = self.rooms.clone();
        while let Some(voxel) = open.pop() {
            let beside = faces().filter_map(|(axis, far)| neighbour(voxel, axis, far));
            for next in beside.filter(|next| self.material(Some(*next)).is_none()) {
                if inner.insert(next) {
                    open.push(next);
                }
            }
        }
        inner
    }

    /// The solids in a style.
    fn solids(&mut self, style: Style) -> Mesh {
        let mut mesh = Mesh::default();
        match style {
            Style::Butted | Style::Overlapping => {
                for (low, high, material) in self.boxes(|_| true) {
                    let [mut from, mut to] = [low, high].map(|at| self.corner(at));
                    if style == Style::Overlapping && material != PANE {
                        self.extend(&mut from, &mut to);
                    }
                    self.add_box(&mut mesh, from, to, material);
                }
            }
            Style::Shells => {
                self.add_surface(&mut mesh, |material| material < COLUMN);
                for (low, high, material) in self.boxes(|material| material >= COLUMN) {
                    let [from, to] = [low, high].map(|at| self.corner(at));
                    self.add_box(&mut mesh, from, to, material);
                }
            }
            Style::Single => self.add_surface(&mut mesh, |_| true),
        }
        mesh
    }

    /// The solids of some materials as boxes.
    fn boxes(&self, is_asked: impl Fn(u32) -> bool) -> Vec<(Voxel, Voxel, u32)> {
        let mut boxes = Vec::new();
        let mut taken: BTreeSet<Voxel> = BTreeSet::new();
        for (&low, &filling) in &self.filling {
            let Filling::Solid(_, material) = filling else { continue };
            if taken.contains(&low) || !is_asked(material) {
                continue;
            }
            let mut high = low.map(|at| at + 1);
            for axis in [1, 2, 0] {
                loop {
                    let (mut from, mut to) = (low, high);
                    (from[axis], to[axis]) = (high[axis], high[axis] + 1);
                    let is_same =
                        |voxel: Voxel| self.filling.get(&voxel) == Some(&filling) && !taken.contains(&voxel);
                    if !voxels(from, to).all(is_same) {
                        break;
                    }
                    high[axis] += 1;
                }
            }
            taken.extend(voxels(low, high));
            boxes.push((low, high, material));
        }
        boxes
    }

    /// Makes a box reach into the solids beside it, but not into panes.
    fn extend(&mut self, from: &mut DVec3, to: &mut DVec3) {
        let step = 1e-6;
        for (axis, far) in faces() {
            let share = [0.0, 0.5, 1.0][self.random.below(3)];
            let end = if far { to[axis] } else { from[axis] };
            let beyond = self.planes[axis]
                .iter()
                .copied()
                .filter(|plane| if far { *plane > end + step } else { *plane < end - step });
            let next = if far { beyond.reduce(f64::min) } else { beyond.reduce(f64::max) };
            let Some(next) = next else { continue };
            let (mut low, mut high) = (*from, *to);
            (low[axis], high[axis]) = if far { (end, next) } else { (next, end) };
            let is_filled = |voxel: &Voxel| {
                let [a, b] = [self.corner(*voxel), self.corner(voxel.map(|at| at + 1))];
                let is_met = a.cmplt(high - step).all() && b.cmpgt(low + step).all();
                !is_met || self.material(Some(*voxel)).is_some_and(|material| material < COLUMN)
            };
            if self.filling.keys().all(is_filled) {
                let reached = end + share * (next - end);
                if far { to[axis] = reached } else { from[axis] = reached }
            }
        }
    }

    /// Adds the surface of the solids of some materials, in squares of the grid.
    fn add_surface(&self, mesh: &mut Mesh, is_asked: impl Fn(u32) -> bool) {
        let material = |voxel: Option<Voxel>| self.material(voxel).filter(|material| is_asked(*material));
        for &voxel in self.filling.keys() {
            let Some(of_solid) = material(Some(voxel)) else { continue };
            for (axis, far) in faces() {
                if material(neighbour(voxel, axis, far)).is_none() {
                    self.add_face(mesh, voxel, (axis, far), of_solid, false);
                }
            }
        }
    }

    /// Adds a face of a voxel, its front outward or inward.
    fn add_face(
        &self,
        mesh: &mut Mesh,
        voxel: Voxel,
        (axis, far): (usize, bool),
        material: u32,
        is_inward: bool,
    ) {
        let [low, high] = [self.corner(voxel), self.corner(voxel.map(|at| at + 1))];
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let corner = |[a, b]: [bool; 2]| {
            let mut corner = low;
            corner[axis] = if far { high[axis] } else { low[axis] };
            (corner[u], corner[v]) = (if a { high[u] } else { low[u] }, if b { high[v] } else { low[v] });
            self.placed(corner)
        };
        let mut corners = [[false, false], [true, false], [true, true], [false, true]].map(corner);
        if far == is_inward {
            corners.reverse();
        }
        add_quad(mesh, corners, material);
    }

    fn add_box(&mut self, mesh: &mut Mesh, from: DVec3, to: DVec3, material: u32) {
        let first = mesh.vertices.len() as u32;
        let shell = Mesh::shoebox((to - from).to_array(), [material; 6]);
        mesh.vertices.extend(shell.vertices.iter().map(|vertex| self.placed(*vertex + from)));
        for triangle in shell.triangles {
            let mut corners = triangle.corners.map(|corner| corner + first);
            if self.random.below(2) == 0 {
                corners.swap(1, 2);
            }
            mesh.triangles.push(MeshTriangle { corners, material });
        }
    }
}

impl SolidBuilding {
    /// What is wrong with the air in a drawing of the building.
    fn faults(&self, mesh: Mesh) -> Vec<String> {
        let geometry = Geometry::build(mesh).unwrap();
        if !geometry.is_watertight() {
            return vec!["not watertight".to_owned()];
        }
        let airs = self.airs();
        let places: Vec<DVec3> = airs.iter().flat_map(|air| air.places.iter().copied()).collect();
        let shells = Geometry::with_kinds(self.shells(), |_| FaceKind::Wall, &places).unwrap();
        let mut faults = Vec::new();
        for geometry in [&geometry, &shells] {
            if geometry.air_cells().len() != airs.len() {
                faults.push(format!("{} rooms of {}", geometry.air_cells().len(), airs.len()));
            }
            for air in &airs {
                faults.extend(air.places.iter().filter_map(|&place| air.fault(geometry, place)));
            }
        }
        let mut numbers = Numbers(1);
        for &place in &places {
            for direction in (0..RAYS).map(|_| numbers.direction()) {
                let [(found, material, normal), (right, of, _)] =
                    [&geometry, &shells].map(|geometry| seen(geometry, place, direction));
                let is_off_plane = (found - right).dot(normal).abs() > OFF_PLANE;
                if is_off_plane || found.distance(right) > APART || material != of {
                    faults.push(format!("{found} of {material:?}, not {right} of {of:?}, from {place}"));
                }
            }
        }
        faults
    }
}

/// Place and material that a ray meets, and the normal there.
fn seen(geometry: &Geometry, place: DVec3, direction: DVec3) -> (DVec3, Option<u32>, DVec3) {
    let hit = geometry.closest_hit(Departure::free(geometry.to_local(place)), direction.as_vec3());
    let position = hit.map_or(DVec3::ZERO, |hit| geometry.to_world(hit.position));
    let surface = hit.map(|hit| geometry.surface(hit.surface));
    (position, surface.map(|it| it.material), surface.map_or(DVec3::ZERO, |it| it.normal))
}

impl Air {
    /// Whether the cell at one of its places is another one.
    fn fault(&self, geometry: &Geometry, place: DVec3) -> Option<String> {
        let number = geometry.cell_at(place);
        let volume =
            geometry.air_cells().iter().find(|cell| cell.number == number).map_or(0.0, |cell| cell.volume);
        let areas = geometry.coverings().remove(&number).unwrap_or_default();
        let is_off = |found: f64, right: f64| (found / right - 1.0).abs() > ROUNDING;
        let materials = areas.len() == self.areas.len()
            && areas
                .iter()
                .zip(&self.areas)
                .all(|(found, right)| found.0 == right.0 && !is_off(*found.1, *right.1));
        (is_off(volume, self.volume) || !materials).then(|| {
            format!("{volume} of {} m³, {areas:?} of {:?} m² about {place}", self.volume, self.areas)
        })
    }
}

#[test]
fn rooms_between_solids_are_those_of_thin_shells() {
    let mut faults = Vec::new();
    for (seed, style) in (0..BUILDINGS).flat_map(|seed| Style::ALL.map(|style| (seed, style))) {
        let mut building = SolidBuilding::new(seed);
        let mesh = building.solids(style);
        faults.extend(building.faults(mesh).into_iter().map(|fault| format!("{seed} {style:?}: {fault}")));
    }
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults[..faults.len().min(40)].join("\n"));
}

/// The sibling: the last box, a part of the outer walls or slabs, is missing.
#[test]
fn a_building_without_one_of_its_parts_is_another() {
    for seed in 0..BUILDINGS.min(20) {
        let mut building = SolidBuilding::new(seed);
        let mut mesh = building.solids(Style::Butted);
        mesh.triangles.truncate(mesh.triangles.len() - 12);
        assert!(!building.faults(mesh).is_empty(), "{seed}");
    }
}

/// A room whose door is open to the outside: its walls are solid, and what is in it is outside air.
#[test]
fn walls_around_an_open_room_are_solid() {
    let mut mesh = Mesh::default();
    let mut add = |low: [f64; 3], high: [f64; 3]| {
        let (low, high) = (DVec3::from(low), DVec3::from(high));
        let shell = Mesh::shoebox((high - low).to_array(), [0; 6]);
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(shell.vertices.iter().map(|vertex| *vertex + low));
        mesh.triangles.extend(
            shell
                .triangles
                .iter()
                .map(|it| MeshTriangle { corners: it.corners.map(|corner| corner + first), ..*it }),
        );
    };
    add([-0.3, -0.3, -0.3], [6.3, 5.3, 0.0]);
    add([-0.3, -0.3, 3.0], [6.3, 5.3, 3.3]);
    add([-0.3, -0.3, 0.0], [0.0, 5.3, 3.0]);
    add([6.0, -0.3, 0.0], [6.3, 5.3, 3.0]);
    add([0.0, 5.0, 0.0], [6.0, 5.3, 3.0]);
    add([0.0, -0.3, 0.0], [2.0, 0.0, 3.0]);
    add([3.0, -0.3, 0.0], [6.0, 0.0, 3.0]);
    let geometry = Geometry::build(mesh.clone()).unwrap();
    assert!(!geometry.is_closed_room());
    let is_free = |x: f64| geometry.check_place(dvec3(x, 1.0, 1.5), &[]).is_ok();
    assert!(is_free(3.0) && is_free(-2.0) && !is_free(-0.1));
    // One line decides otherwise.
    let cavity = Geometry::with_kinds(mesh, |_| FaceKind::Wall, &[dvec3(-0.1, 1.0, 1.5)]).unwrap();
    assert!(cavity.is_closed_room() && cavity.check_place(dvec3(-0.1, 1.0, 1.5), &[]).is_ok());
    assert!(cavity.check_place(dvec3(3.0, 1.0, 1.5), &[]).is_err());
}

/// Planes of an axis: walls of three pieces and rooms of five, beginning and ending with a wall.
fn axis_planes(random: &mut Numbers, rooms: usize, is_upward: bool) -> Vec<f64> {
    let mut between = |low: f64, high: f64| low + (high - low) * random.unit();
    let mut planes = vec![0.0];
    let mut add = |length: f64, shares: &[f64]| {
        let from = planes[planes.len() - 1];
        planes.extend(shares.iter().map(|share| from + share * length));
        planes.push(from + length);
    };
    for at in 0..=rooms {
        let is_outer = at == 0 || at == rooms;
        let thickness = match (is_upward, is_outer) {
            (true, _) => between(0.18, 0.35),
            (false, true) => between(0.2, 0.4),
            (false, false) => between(0.1, 0.25),
        };
        add(thickness, &[0.4, 0.6]);
        if at < rooms {
            let length = if is_upward { between(2.3, 3.5) } else { between(2.5, 6.0) };
            add(length, &CUTS);
        }
    }
    planes
}

fn voxels(low: Voxel, high: Voxel) -> impl Iterator<Item = Voxel> {
    let [x, y, z] = [0, 1, 2].map(|axis| low[axis]..high[axis]);
    x.flat_map(move |x| {
        let z = z.clone();
        y.clone().flat_map(move |y| z.clone().map(move |z| [x, y, z]))
    })
}

/// The faces of a voxel: the axis, and whether it is the far one.
fn faces() -> impl Iterator<Item = (usize, bool)> {
    (0..3).flat_map(|axis| [false, true].map(|far| (axis, far)))
}

fn neighbour(voxel: Voxel, axis: usize, far: bool) -> Option<Voxel> {
    let mut next = voxel;
    next[axis] = if far { voxel[axis] + 1 } else { voxel[axis].checked_sub(1)? };
    Some(next)
}

fn add_quad(mesh: &mut Mesh, corners: [DVec3; 4], material: u32) {
    let first = mesh.vertices.len() as u32;
    mesh.vertices.extend(corners);
    for corners in [[0, 1, 2], [0, 2, 3]] {
        mesh.triangles.push(MeshTriangle { corners: corners.map(|corner| first + corner), material });
    }
}
