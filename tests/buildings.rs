//! Random buildings on a grid, drawn as people draw them, and what is known of sound in them.
//!
//! A box is divided into rooms by walls on grid planes. Every wall is drawn in one of several ways: whole, in squares, in two
//! pieces that share no corners with their neighbours, in pieces that overlap, twice, as triangles about a point, or as a
//! solid; some have an opening. Some rooms are divided by a sheet aslant through grid points; some hold solids and screens. Sources
//! and receivers stand on the grid and halfway between its points, so that nothing is in general position.

use glam::{DMat3, DVec3};
use sonel_acoustics::{Bands, Material};
use sonel_geometry::{Mesh, MeshTriangle};
use sonel_scene::Scene;
use sonel_testkit::uniform::Uniform;

/// Absorption of the materials of a building.
pub const ABSORPTION: [f64; 3] = [0.1, 0.2, 0.35];
/// Scattering of all of them.
pub const SCATTERING: f64 = 0.2;
/// Of so many buildings one is turned and moved away from the origin.
const TURNED: u64 = 4;
/// Walls that divide rooms, at most.
const MOST_WALLS: usize = 5;

/// A room of a building.
#[derive(Debug, Clone)]
pub struct Room {
    /// Lower and upper corner [m].
    pub bounds: [DVec3; 2],
    /// Materials of the walls at x = low, x = high, y = low, …
    pub walls: [u32; 6],
    /// The plane of a sheet that divides it: normal and offset.
    pub sheet: Option<(DVec3, f64)>,
    /// Solids in it, by lower and upper corner [m].
    pub solids: Vec<[DVec3; 2]>,
    /// Whether there is a screen in it.
    pub has_screen: bool,
    /// The rooms with the same number are one air through an opening; none where it has no opening.
    pub opening: Option<usize>,
}

impl Room {
    /// Whether the image sources of a box are all its reflections.
    #[must_use]
    pub fn is_empty_box(&self) -> bool {
        self.solids.is_empty() && self.sheet.is_none() && self.opening.is_none()
    }
}

/// A random building.
#[derive(Debug, Clone)]
pub struct Building {
    /// Its walls as drawn.
    pub mesh: Mesh,
    /// Its rooms.
    pub rooms: Vec<Room>,
    /// Distance of the grid's planes [m].
    pub step: f64,
    /// Its upper corner before it is turned; the lower one is the origin.
    high: DVec3,
    /// How it is turned, and where its lower corner is then [m].
    frame: (DMat3, DVec3),
    random: Uniform,
}

/// A place in a building.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Position [m].
    pub position: DVec3,
    /// The same before the building is turned [m].
    pub on_grid: DVec3,
    /// The room.
    pub room: usize,
    /// On which side of the room's sheet, if it has one.
    pub is_above: bool,
    /// Of the room.
    pub opening: Option<usize>,
}

impl Place {
    /// Whether the same air is at another place, whatever else stands there.
    #[must_use]
    pub fn is_connected(&self, other: &Self) -> bool {
        let is_in_one_room = (self.room, self.is_above) == (other.room, other.is_above);
        is_in_one_room || self.opening.is_some() && self.opening == other.opening
    }
}

impl Building {
    /// The building of a seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        let mut random = Uniform::new(seed);
        let step = [1.0, 0.5][random.below(2)];
        let high = DVec3::from([0; 3].map(|_| step * (3 + random.below(6)) as f64));
        let walls = [0; 6].map(|_| random.below(3) as u32);
        let hull = Room {
            bounds: [DVec3::ZERO, high],
            walls,
            sheet: None,
            solids: Vec::new(),
            has_screen: false,
            opening: None,
        };
        let mut building = Self {
            mesh: Mesh::default(),
            rooms: vec![hull],
            step,
            high,
            frame: (DMat3::IDENTITY, DVec3::ZERO),
            random,
        };
        building.draw_hull();
        for _ in 0..1 + building.random.below(MOST_WALLS) {
            building.divide();
        }
        for room in 0..building.rooms.len() {
            match building.random.below(4) {
                _ if building.rooms[room].opening.is_some() => {}
                0 => building.put_sheet(room),
                1 => building.furnish(room),
                _ => {}
            }
        }
        if seed % TURNED == TURNED - 1 {
            building.turn();
        }
        building
    }

    /// The building of a seed with sheets on grid planes that begin at a wall or behind it and end in a room: free ends that go on where a wall ends,
    /// niches, sheets through walls. They hide, and seal nothing that was open.
    #[must_use]
    pub fn with_free_ends(seed: u64) -> Self {
        let mut building = Self::new(seed);
        // What is turned has no grid planes.
        let rooms = if seed % TURNED == TURNED - 1 { 0 } else { building.rooms.len() };
        for room in 0..rooms {
            let [low, high] = building.rooms[room].bounds;
            let cells = ((high - low) / building.step).round();
            let across = building.random.below(3);
            let [along, up] = [(across + 1) % 3, (across + 2) % 3];
            if cells[across] < 2.0 || cells[along] < 2.0 {
                continue;
            }
            let mut from = low;
            let mut to = high;
            from[across] += building.step * (1 + building.random.below(cells[across] as usize - 1)) as f64;
            to[across] = from[across];
            to[along] =
                low[along] + building.step * (1 + building.random.below(cells[along] as usize - 1)) as f64;
            if building.random.below(2) == 0 && low[along] > 0.0 {
                from[along] -= building.step;
            }
            let corner = |b: f64, c: f64| {
                let mut corner = from;
                (corner[along], corner[up]) = (b, c);
                corner
            };
            let (b, c) = ([from[along], to[along]], [from[up], to[up]]);
            let corners = [corner(b[0], c[0]), corner(b[1], c[0]), corner(b[1], c[1]), corner(b[0], c[1])];
            crate::meshes::add_quad(&mut building.mesh, 0, corners);
        }
        building
    }

    /// Turns it to where no plane is that of two axes, and moves it away from the origin.
    fn turn(&mut self) {
        let mut unit = || self.random.below(1000) as f64 / 1000.0;
        let along = DVec3::new(unit() - 0.5, unit() - 0.5, unit() + 0.1).normalize();
        let by = DVec3::new(100.0 * unit(), -300.0 * unit(), 20.0 * unit());
        self.frame = (DMat3::from_axis_angle(along, 6.0 * unit()), by);
        let (turn, by) = self.frame;
        self.mesh.vertices.iter_mut().for_each(|vertex| *vertex = turn * *vertex + by);
    }

    /// The scene with a source and receivers.
    #[must_use]
    pub fn scene(&self, source: DVec3, receivers: &[Place], duration: f64) -> Scene {
        let materials = ABSORPTION.map(|absorption| Material::uniform("wall", absorption, SCATTERING, 1));
        let bands = Bands::new(vec![500.0], sonel_acoustics::BandWidth::Octave).expect("an octave");
        let mut scene = Scene::from_parts(self.mesh.clone(), materials.to_vec(), bands, duration)
            .with_source("source", source.to_array())
            .without_air_attenuation();
        for (index, place) in receivers.iter().enumerate() {
            scene = scene.with_receiver(&format!("receiver {index}"), place.position.to_array());
        }
        scene.speed_of_sound = 343.0;
        scene
    }

    /// A random place on the half grid of a room, off everything that stands in it; none where none was found.
    pub fn place(&mut self, room: usize) -> Option<Place> {
        (0..50).find_map(|_| {
            let [low, high] = self.rooms[room].bounds;
            let mut position = DVec3::ZERO;
            for axis in 0..3 {
                let count = (2.0 * (high[axis] - low[axis]) / self.step).round() as usize;
                position[axis] = low[axis] + 0.5 * self.step * (1 + self.random.below(count - 1)) as f64;
            }
            let Room { sheet, solids, opening, .. } = &self.rooms[room];
            let (turn, by) = self.frame;
            let height = sheet.map_or(1.0, |(normal, offset)| normal.dot(position) - offset);
            let is_in = |[low, high]: &[DVec3; 2]| {
                position.cmpge(*low - 1e-3).all() && position.cmple(*high + 1e-3).all()
            };
            let is_free = height.abs() > 1e-3 && !solids.iter().any(is_in);
            let (on_grid, position) = (position, turn * position + by);
            let is_above = height > 0.0;
            is_free.then_some(Place { position, on_grid, room, is_above, opening: *opening })
        })
    }

    /// Whether the air at a place touches the hull. Air that does not is taken for the inside of a solid.
    #[must_use]
    pub fn is_at_hull(&self, place: &Place) -> bool {
        let Room { bounds: [low, high], sheet, .. } = self.rooms[place.room];
        let corner = |i: usize| DVec3::from([0, 1, 2].map(|axis| [low, high][i >> axis & 1][axis]));
        let is_beside = |corner: DVec3| {
            let height = sheet.map_or(1.0, |(normal, offset)| normal.dot(corner) - offset);
            if place.is_above { height > 1e-3 } else { height < -1e-3 }
        };
        (0..8).map(corner).any(|corner| {
            let is_on_hull = (corner.cmple(DVec3::splat(1e-3)) | corner.cmpge(self.high - 1e-3)).any();
            is_on_hull && is_beside(corner)
        })
    }

    /// Volume of the air in all rooms [m³].
    #[must_use]
    pub fn volume(&self) -> f64 {
        let of = |[low, high]: &[DVec3; 2]| (*high - *low).element_product();
        let of_room = |room: &Room| of(&room.bounds) - room.solids.iter().map(of).sum::<f64>();
        self.rooms.iter().map(of_room).sum()
    }

    /// A random room.
    pub fn any_room(&mut self) -> usize {
        self.random.below(self.rooms.len())
    }

    fn draw_hull(&mut self) {
        let Room { bounds, walls, .. } = self.rooms[0].clone();
        for axis in 0..3 {
            for (far, at) in bounds.into_iter().enumerate() {
                self.draw_wall((axis, at[axis]), bounds, walls[2 * axis + far], false);
            }
        }
    }

    /// Divides a random room by a wall, if there is space.
    fn divide(&mut self) {
        let (room, axis) = (self.any_room(), self.random.below(3));
        let [low, high] = self.rooms[room].bounds;
        let count = ((high[axis] - low[axis]) / self.step).round() as usize;
        let is_solid = self.random.below(5) == 0;
        // A wall across an opening would leave two.
        if count < 3 + usize::from(is_solid) || self.rooms[room].opening.is_some() {
            return;
        }
        let thickness = if is_solid { self.step } else { 0.0 };
        let at = low[axis] + self.step * (1 + self.random.below(count - 2 - usize::from(is_solid))) as f64;
        let material = self.random.below(3) as u32;
        if is_solid {
            let (mut from, mut to) = (low, high);
            (from[axis], to[axis]) = (at, at + thickness);
            self.draw_solid([from, to], material);
        } else if self.random.below(4) == 0 && self.draw_wall_with_opening((axis, at), [low, high], material)
        {
            self.rooms[room].opening = Some(room);
        } else {
            self.draw_wall((axis, at), [low, high], material, true);
        }
        let mut other = self.rooms[room].clone();
        self.rooms[room].bounds[1][axis] = at;
        self.rooms[room].walls[2 * axis + 1] = material;
        other.bounds[0][axis] = at + thickness;
        other.walls[2 * axis] = material;
        self.rooms.push(other);
    }

    /// Divides a room by a sheet aslant that reaches four of its walls.
    fn put_sheet(&mut self, room: usize) {
        let [low, high] = self.rooms[room].bounds;
        let along = self.random.below(3);
        let (across, up) = ((along + 1) % 3, (along + 2) % 3);
        let count = ((high[up] - low[up]) / self.step).round() as usize;
        let heights = [0; 2].map(|_| low[up] + self.step * self.random.below(count + 1) as f64);
        let is_on_wall = |wall: f64| heights.iter().all(|&height| (height - wall).abs() < 1e-9);
        if is_on_wall(low[up]) || is_on_wall(high[up]) {
            return;
        }
        let corner = |far: usize, at: f64| {
            let mut corner = DVec3::ZERO;
            (corner[along], corner[across], corner[up]) = (at, [low, high][far][across], heights[far]);
            corner
        };
        let corners =
            [corner(0, low[along]), corner(1, low[along]), corner(1, high[along]), corner(0, high[along])];
        let normal = (corners[1] - corners[0]).cross(corners[3] - corners[0]).normalize();
        self.rooms[room].sheet = Some((normal, normal.dot(corners[0])));
        self.draw_quad(corners, 0);
    }

    /// Puts a solid, often flush against something, or a screen into a room.
    fn furnish(&mut self, room: usize) {
        let [low, high] = self.rooms[room].bounds;
        let (mut from, mut to) = (low, high);
        for axis in 0..3 {
            let count = ((high[axis] - low[axis]) / self.step).round() as usize;
            if count < 2 {
                return;
            }
            let first = self.random.below(count - 1);
            from[axis] = low[axis] + self.step * first as f64;
            to[axis] = from[axis] + self.step * (1 + self.random.below((count - 1 - first).max(1))) as f64;
        }
        if self.random.below(2) == 0 {
            self.rooms[room].solids.push([from, to]);
            self.draw_solid([from, to], 1);
        } else {
            // Off the walls: what is drawn over a wall of another material may show through it.
            let axis = self.random.below(3);
            self.rooms[room].has_screen = true;
            self.rooms[room].solids.push([from.with_axis(axis, to[axis]), to]);
            self.draw_wall((axis, to[axis]), [from, to], 2, true);
        }
    }

    fn draw_solid(&mut self, bounds: [DVec3; 2], material: u32) {
        for axis in 0..3 {
            for at in bounds {
                self.draw_wall((axis, at[axis]), bounds, material, false);
            }
        }
    }

    /// Draws the rectangle at one coordinate of a box but for a part of it, if it is large enough; returns whether it is.
    fn draw_wall_with_opening(
        &mut self,
        (axis, at): (usize, f64),
        [low, high]: [DVec3; 2],
        material: u32,
    ) -> bool {
        let sides = [(axis + 1) % 3, (axis + 2) % 3];
        let count = sides.map(|side| ((high[side] - low[side]) / self.step).round() as usize);
        if count.iter().any(|&count| count < 2) {
            return false;
        }
        let from = count.map(|count| self.random.below(count - 1));
        let to = [0, 1].map(|i| from[i] + 1 + self.random.below(count[i] - 1 - from[i]));
        let step = self.step;
        let place = |i: usize, at: usize| low[sides[i]] + step * at as f64;
        let pieces = [
            [[0, 0], [from[0], count[1]]],
            [[to[0], 0], count],
            [[from[0], 0], [to[0], from[1]]],
            [[from[0], to[1]], [to[0], count[1]]],
        ];
        for [from, to] in pieces.into_iter().filter(|[from, to]| from[0] < to[0] && from[1] < to[1]) {
            let (mut lower, mut upper) = (low, high);
            for i in 0..2 {
                (lower[sides[i]], upper[sides[i]]) = (place(i, from[i]), place(i, to[i]));
            }
            self.draw_wall((axis, at), [lower, upper], material, true);
        }
        true
    }

    /// Draws the rectangle at one coordinate of a box in a random way.
    fn draw_wall(&mut self, (axis, at): (usize, f64), [low, high]: [DVec3; 2], material: u32, is_thin: bool) {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let count = [u, v].map(|axis| ((high[axis] - low[axis]) / self.step).round() as usize);
        // Solids and the hull are not drawn twice: which of the faces is the second drawing would be a guess.
        let style = self.random.below(if is_thin { 8 } else { 7 });
        let whole = [[0, 0], count];
        let pieces: Vec<[[usize; 2]; 2]> = match style {
            1 => (0..count[0]).flat_map(|i| (0..count[1]).map(move |j| [[i, j], [i + 1, j + 1]])).collect(),
            2 if count[0] > 1 => {
                let cut = 1 + self.random.below(count[0] - 1);
                vec![[[0, 0], [cut, count[1]]], [[cut, 0], count]]
            }
            3 if count[0] > 2 => {
                let from = 1 + self.random.below(count[0] - 2);
                let to = from + 1 + self.random.below(count[0] - from - 1);
                vec![[[0, 0], [to, count[1]]], [[from, 0], count]]
            }
            7 => vec![whole, whole],
            _ => vec![whole],
        };
        for [from, to] in pieces {
            let corner = |i: usize, j: usize| {
                let mut corner = DVec3::ZERO;
                corner[axis] = at;
                corner[u] = low[u] + self.step * i as f64;
                corner[v] = low[v] + self.step * j as f64;
                corner
            };
            let corners = [
                corner(from[0], from[1]),
                corner(to[0], from[1]),
                corner(to[0], to[1]),
                corner(from[0], to[1]),
            ];
            if style == 4 && count[0] > 1 && count[1] > 1 {
                let middle = corner(1 + self.random.below(count[0] - 1), 1 + self.random.below(count[1] - 1));
                (0..4).for_each(|i| self.draw([corners[i], corners[(i + 1) % 4], middle], material));
            } else {
                self.draw_quad(corners, material);
            }
        }
    }

    fn draw_quad(&mut self, [a, b, c, d]: [DVec3; 4], material: u32) {
        if self.random.below(2) == 0 {
            self.draw([a, b, c], material);
            self.draw([a, c, d], material);
        } else {
            self.draw([a, b, d], material);
            self.draw([b, c, d], material);
        }
    }

    /// Draws a triangle, either way round, with corners of its own.
    fn draw(&mut self, mut corners: [DVec3; 3], material: u32) {
        if self.random.below(2) == 0 {
            corners.swap(1, 2);
        }
        let first = self.mesh.vertices.len() as u32;
        self.mesh.vertices.extend(corners);
        self.mesh.triangles.push(MeshTriangle { corners: [first, first + 1, first + 2], material });
    }
}

/// A vector with one coordinate replaced.
trait WithAxis {
    fn with_axis(self, axis: usize, at: f64) -> Self;
}

impl WithAxis for DVec3 {
    fn with_axis(mut self, axis: usize, at: f64) -> Self {
        self[axis] = at;
        self
    }
}
