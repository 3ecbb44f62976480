//! Cells: the regions into which the faces of a conforming mesh divide space, and which of them hold air.
//!
//! A face has two sides. In the order of their angles about an edge, each wedge between two neighbouring faces joins the two
//! sides that face it; a free rim joins both sides of its face. Sides that are joined bound one region: from outside, as those
//! of a hull, where the volume that they enclose is negative, else as those of an object or a sheet in it.
//!
//! Which cells are solid is read off the drawing. The way into a solid crosses one face from the air, and two where it stands
//! flush against a wall or another solid; so each contact with a cell already known speaks for air or for solid, by its area.
//! The first cell known is the outside, and there are two readings of it:
//!
//! - **Shells.** The outermost faces are those of a room: a cell that touches the outside with single faces is air, and the
//!   outside is none.
//! - **Solids.** The outermost faces are those of walls with thickness: the outside counts as air, what it touches is solid,
//!   and the cells within are rooms. In the open, with a ground for example, this is the only reading.
//!
//! A drawing is one of solids where [the air of the first reading is masonry](Cells::is_masonry). Where the scene states places
//! of air, their cells are air and nothing else is.

use crate::Mesh;
use crate::bodies::Bodies;
use crate::cracks::Facing;
use crate::enclosure::{distance_along, signed_volume, winding_number};
use crate::rooms::{FaceKind, THICKEST_PARTITION, are_rooms};
use crate::topology::{Connected, SharedEdge};
use foldhash::HashMap;
use glam::DVec3;
use smallvec::SmallVec;
use std::collections::{BTreeMap, BinaryHeap};

/// Largest share of a closed cell's area that its cracks have [1]. Chosen, not measured: they absorb as α = 0.001 would everywhere; doubled,
/// a room with such gaps is closed too.
const LARGEST_CRACKED_SHARE: f64 = 1e-3;
/// Largest share of a room's hull area in fins that poke out of it [1]; more is a ground or another building. Chosen, not measured; doubled,
/// a small ground outside leaves the scene a room.
const LARGEST_FIN_SHARE: f64 = 0.02;
/// Largest part of a flush solid's contact with the hull that is drawn once, relative to the part drawn twice [1]. Chosen, not measured; of
/// 3000 random buildings three have a box on the wrong side of it (docs/decisions.md).
const LARGEST_SHARED: f64 = 0.01;
/// Least ratio of the mean free path in a room to that in the walls around it, where they were drawn as nothing but a shell in another one
/// [1]. Chosen, not measured: rooms of 3 × 3 × 2.5 m have walls of up to 0.37 m; doubled, up to 0.19 m.
const LEAST_ROOMINESS: f64 = 2.5;
/// Largest mean thickness of walls around a room that opens to the outside, 2 V/S [m]. Chosen, not measured; doubled, bent ducts 1 m wide are walls.
const THICKEST_WALLS: f64 = 0.5;
/// Least share of the area of such walls from which others are seen opposite [1]. Chosen, not measured; doubled, it is that of a room without a roof.
const LEAST_OPPOSITE_SHARE: f64 = 0.25;
/// Number of the largest faces whose view counts. Speed alone depends on it.
const LOOKING_FACES: usize = 64;
/// Height over a face of a point beside it [tolerances]. Face and neighbours may each be off by one; the rest is a margin, chosen. Doubled,
/// gaps of up to 16 tolerances are stepped over.
const STEP: f64 = 8.0;

/// The number of the region that has no bounds.
pub(crate) const OUTSIDE: u32 = 0;

/// Cells of a mesh.
pub(crate) struct Cells {
    /// The cell on each side of every triangle: 2 t in front of triangle t, 2 t + 1 behind it; of interfaces none is known.
    of_side: Vec<u32>,
    /// Whether each side is one of an object in a cell, not of the cell's hull.
    is_object: Vec<bool>,
    cells: Vec<Cell>,
    /// Whether the scene is a closed room: one hull reaches as far as anything.
    pub is_room: bool,
    /// Whether it is drawn as solids, with air within and walls between that and the outside.
    pub has_masonry: bool,
}

/// Areas in which two cells touch [m²]: with one face between, and with two.
type Contacts = BTreeMap<(u32, u32), [f64; 2]>;

/// A region of space.
#[derive(Debug, Clone)]
pub(crate) struct Cell {
    /// The sides of its outer boundary, in ascending order; none of what is outside.
    pub hull: Vec<u32>,
    pub bounds: (DVec3, DVec3),
    /// Volume within its outer boundary [m³].
    whole: f64,
    /// The same less that of the objects in it [m³].
    pub volume: f64,
    pub is_air: bool,
    pub is_cracked: bool,
}

/// Where a cell is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CellPlace {
    /// Its number, [`Geometry::cell_at`](crate::Geometry::cell_at).
    pub number: u32,
    /// Volume [m³].
    pub volume: f64,
    /// A place in it, in world coordinates [m].
    pub place: DVec3,
    /// Lower and upper corner of the box around it [m].
    pub bounds: (DVec3, DVec3),
}

/// Input of the search for cells.
#[derive(Default)]
pub(crate) struct Drawing<'a> {
    pub edges: &'a [SharedEdge],
    pub cracks: &'a [Facing],
    /// Faces that bound nothing, as interfaces between airs.
    pub is_left_out: &'a [bool],
    /// Kinds of the faces; empty where that does not matter.
    pub kinds: &'a [FaceKind],
    /// Pairs of faces that coincide.
    pub twins: &'a [[u32; 2]],
    /// Whether two bodies touch in each face; empty where none do.
    pub is_doubled: &'a [bool],
    pub known: Known<'a>,
    /// Largest error of positions [m].
    pub tolerance: f64,
}

/// What is known of air and solid beside the faces.
#[derive(Clone, Copy, Default)]
pub(crate) struct Known<'a> {
    /// The closed bodies that were drawn; without them all is read as shells.
    pub bodies: Option<&'a Bodies>,
    /// Places that alone are air [m]; without them the drawing tells.
    pub air_at: &'a [DVec3],
    /// Whether the faces are those of air alone, with masonry outside.
    pub is_cut_out: bool,
}

/// Sides that are joined.
struct Boundary {
    sides: Vec<u32>,
    /// Signed volume of those of its sides whose other side is not among them [m³], positive where they face outward.
    volume: f64,
    area: f64,
    /// Bounds of those sides [m].
    bounds: (DVec3, DVec3),
    /// Bounds of all its sides [m].
    whole_bounds: (DVec3, DVec3),
    /// Area of the sides whose other side is among them too [m²].
    fins: f64,
    /// Area of the cracks in it [m²].
    cracked: f64,
}

impl Cells {
    /// Finds the cells of a mesh.
    pub(crate) fn find(mesh: &Mesh, drawing: &Drawing<'_>) -> Self {
        let first_of: HashMap<u32, u32> =
            drawing.twins.iter().map(|&[first, second]| (second, first)).collect();
        let is_taken: Vec<bool> = (0..)
            .zip(drawing.is_left_out)
            .map(|(face, is_left_out)| !is_left_out && !first_of.contains_key(&face))
            .collect();
        let mut sides = Sides { mesh, connected: Connected::new(2 * is_taken.len()) };
        drawing.edges.iter().for_each(|edge| sides.join_around(edge, &is_taken));
        drawing.cracks.iter().for_each(|facing| sides.join_across(facing, drawing.edges));
        let boundaries = sides.closed_boundaries(&is_taken, drawing);
        let mut cells = Self::bounded(mesh, boundaries, drawing);
        cells.add_twins(mesh, drawing.twins);
        if drawing.known.air_at.is_empty() {
            cells.decide(mesh, drawing, &is_taken);
        } else {
            cells.take_as_air(mesh, drawing.known.air_at);
        }
        cells
    }

    /// Takes the cells of some places as air, and nothing else.
    fn take_as_air(&mut self, mesh: &Mesh, places: &[DVec3]) {
        let stated: Vec<u32> = places.iter().map(|&place| self.at(mesh, place)).collect();
        (0..).zip(&mut self.cells).for_each(|(number, cell)| cell.is_air = stated.contains(&number));
        self.is_room = !stated.contains(&OUTSIDE);
        self.has_masonry = self.is_room;
    }

    /// Decides of all cells whether they hold air.
    fn decide(&mut self, mesh: &Mesh, drawing: &Drawing<'_>, is_taken: &[bool]) {
        let contacts = self.contacts(mesh, drawing, is_taken);
        self.tell_air_from_solid(&contacts);
        if !drawing.known.is_cut_out && self.is_room && self.is_masonry(mesh, drawing, &contacts) {
            self.read_as_solids(mesh, drawing, &contacts);
        }
    }

    /// Whether the air of a closed room is the masonry of walls with thickness. One of these says so:
    ///
    /// - The way into the largest solid leaves a closed body that was drawn, instead of entering one; where bodies are told by the
    ///   orientation of their faces alone, it leads to a wider place too, since rooms are drawn with either side outward.
    /// - That solid is a shell in another one, with [`LEAST_ROOMINESS`] and within the thickness of a partition.
    /// - There is none, and the air is [thin](THICKEST_WALLS) and has [its outer faces opposite one another](LEAST_OPPOSITE_SHARE).
    fn is_masonry(&self, mesh: &Mesh, drawing: &Drawing<'_>, contacts: &Contacts) -> bool {
        let Some(bodies) = drawing.known.bodies else { return false };
        let neighbours =
            |cell: u32| contacts.range((cell, 0)..=(cell, u32::MAX)).map(|(pair, areas)| (pair.1, areas));
        let area = |cell: u32| neighbours(cell).map(|(_, [single, double])| single + double).sum::<f64>();
        let solids = self.inside().filter(|(_, cell)| !cell.is_air);
        let Some((largest, solid)) = solids.max_by(|a, b| a.1.volume.total_cmp(&b.1.volume)) else {
            return self.is_thin_and_around(mesh, area);
        };
        let air = neighbours(largest).filter(|(other, _)| self.cells[*other as usize].is_air);
        let Some((around, _)) = air.max_by(|a, b| a.1[0].total_cmp(&b.1[0])) else { return false };
        let beside = |cell: u32| self.place_beside(mesh, cell, drawing.tolerance);
        let [within, beyond] = [largest, around].map(|cell| bodies.depths(beside(cell)));
        let mean_free_path = |cell: u32, volume: f64| 4.0 * volume / area(cell);
        let [wide, narrow] = [
            mean_free_path(largest, solid.volume),
            mean_free_path(around, self.cells[around as usize].volume),
        ];
        let is_apart = !contacts.contains_key(&(largest, OUTSIDE));
        let is_shell = is_apart && wide >= LEAST_ROOMINESS * narrow && narrow <= 2.0 * THICKEST_PARTITION;
        let leaves = |kind: usize| beyond[kind] > 0 && within[kind] < beyond[kind];
        leaves(0) || leaves(1) && wide > narrow || is_shell
    }

    /// Whether all air is no thicker than walls are and stands around something.
    fn is_thin_and_around(&self, mesh: &Mesh, area: impl Fn(u32) -> f64) -> bool {
        let volume: f64 = self.inside().map(|(_, cell)| cell.volume).sum();
        let area: f64 = self.inside().map(|(number, _)| area(number)).sum();
        if 2.0 * volume > THICKEST_WALLS * area {
            return false;
        }
        let size = |side: &u32| mesh.vector_area(side / 2).length();
        let mut outer: Vec<u32> = (0..self.of_side.len() as u32)
            .filter(|&side| {
                self.of_side[side as usize] == OUTSIDE && self.of_side[(side ^ 1) as usize] != OUTSIDE
            })
            .collect();
        outer.sort_by(|a, b| size(b).total_cmp(&size(a)).then(a.cmp(b)));
        outer.truncate(LOOKING_FACES);
        let faces = 0..mesh.triangles.len() as u32;
        let faces = faces.filter(|&face| self.sides(face) != [OUTSIDE; 2]);
        let is_opposite = |side: &&u32| opposite(mesh, **side, faces.clone()).is_some();
        let opposite: f64 = outer.iter().filter(is_opposite).map(size).sum();
        opposite >= LEAST_OPPOSITE_SHARE * outer.iter().map(size).sum::<f64>()
    }

    /// Decides again, where walls are drawn as solids. What solids have in common is none of their cavities.
    fn read_as_solids(&mut self, mesh: &Mesh, drawing: &Drawing<'_>, contacts: &Contacts) {
        self.is_room = false;
        self.tell_air_from_solid(contacts);
        let is_within = |place: DVec3| drawing.known.bodies.is_some_and(|bodies| bodies.depths(place)[0] > 0);
        let is_shared = |(number, cell): &(u32, &Cell)| {
            let is_of_cavity = |side: &u32| {
                self.is_object[(side ^ 1) as usize] && self.of_side[(side ^ 1) as usize] != OUTSIDE
            };
            let is_cavity = cell.hull.iter().any(is_of_cavity);
            cell.is_air && !is_cavity && is_within(self.place_beside(mesh, *number, drawing.tolerance))
        };
        let shared: Vec<u32> = self.inside().filter(is_shared).map(|(number, _)| number).collect();
        shared.into_iter().for_each(|cell| self.cells[cell as usize].is_air = false);
        let has_air = self.inside().any(|(_, cell)| cell.is_air);
        (self.is_room, self.has_masonry) = (has_air, true);
        self.cells[OUTSIDE as usize].is_air = !self.is_room;
    }

    /// A point in a cell, beside its largest triangle [m].
    fn place_beside(&self, mesh: &Mesh, cell: u32, tolerance: f64) -> DVec3 {
        beside(mesh, &self.cells[cell as usize].hull, STEP * tolerance)
    }

    /// The cells that boundaries enclose, each with the objects in it.
    fn bounded(mesh: &Mesh, boundaries: Vec<Boundary>, drawing: &Drawing<'_>) -> Self {
        let tolerance = drawing.tolerance;
        let unbounded = Cell {
            hull: Vec::new(),
            bounds: (DVec3::NEG_INFINITY, DVec3::INFINITY),
            whole: f64::INFINITY,
            volume: f64::INFINITY,
            is_air: false,
            is_cracked: false,
        };
        let mut cells = Self {
            of_side: vec![OUTSIDE; 2 * mesh.triangles.len()],
            is_object: vec![false; 2 * mesh.triangles.len()],
            cells: vec![unbounded],
            is_room: drawing.known.is_cut_out,
            has_masonry: drawing.known.is_cut_out,
        };
        let (hulls, objects): (Vec<Boundary>, Vec<Boundary>) =
            boundaries.into_iter().partition(|boundary| boundary.volume < -tolerance * boundary.area);
        for Boundary { sides, volume, bounds, cracked, .. } in hulls {
            sides.iter().for_each(|&side| cells.of_side[side as usize] = cells.cells.len() as u32);
            let is_cracked = cracked > 0.0;
            cells.cells.push(Cell {
                hull: sides,
                bounds,
                whole: -volume,
                volume: -volume,
                is_air: true,
                is_cracked,
            });
        }
        let (low, high) = mesh.bounds();
        let mut shells = Vec::new();
        for Boundary { sides, volume, area, bounds, whole_bounds, fins, .. } in objects {
            let cell = cells.at(mesh, beside(mesh, &sides, STEP * tolerance));
            let reaches_all =
                |(from, to): (DVec3, DVec3)| (from - low).max(high - to).max_element() <= tolerance;
            let has_few_fins = fins <= LARGEST_FIN_SHARE * area;
            cells.is_room |=
                cell == OUTSIDE && (reaches_all(bounds) || has_few_fins && reaches_all(whole_bounds));
            for &side in &sides {
                (cells.of_side[side as usize], cells.is_object[side as usize]) = (cell, true);
            }
            cells.cells[cell as usize].volume -= volume;
            if cell == OUTSIDE {
                shells.push(sides);
            }
        }
        cells.is_room |= are_rooms(mesh, &shells, drawing.kinds);
        cells
    }

    /// Gives faces that coincide with another one its cells.
    fn add_twins(&mut self, mesh: &Mesh, twins: &[[u32; 2]]) {
        for &[first, second] in twins {
            let turned = u32::from(mesh.vector_area(first).dot(mesh.vector_area(second)) < 0.0);
            for side in 0..2 {
                self.of_side[(2 * second + side) as usize] =
                    self.of_side[(2 * first + (side ^ turned)) as usize];
            }
        }
    }

    /// Decides of each cell whether it holds air, beginning with those that have most contact with cells already known.
    fn tell_air_from_solid(&mut self, contacts: &Contacts) {
        let mut evidence = vec![Evidence::default(); self.cells.len()];
        let mut is_known = vec![false; self.cells.len()];
        self.cells[OUTSIDE as usize].is_air = !self.is_room;
        // Areas are positive, so that their bits are in their order.
        let mut next = BinaryHeap::from([(0_u64, OUTSIDE)]);
        while let Some((_, cell)) = next.pop() {
            if std::mem::replace(&mut is_known[cell as usize], true) {
                continue;
            }
            if cell != OUTSIDE {
                self.cells[cell as usize].is_air = !evidence[cell as usize].is_solid();
            }
            for (&(_, other), areas) in contacts.range((cell, 0)..=(cell, u32::MAX)) {
                if !is_known[other as usize] {
                    let is_beyond = cell == OUTSIDE && self.is_room;
                    evidence[other as usize].add(self.cells[cell as usize].is_air, is_beyond, *areas);
                    next.push((evidence[other as usize].contact.to_bits(), other));
                }
            }
        }
    }

    fn contacts(&self, mesh: &Mesh, drawing: &Drawing<'_>, is_taken: &[bool]) -> Contacts {
        let mut contacts = Contacts::new();
        for face in (0..is_taken.len() as u32).filter(|&face| is_taken[face as usize]) {
            let [front, back] = self.sides(face);
            if front != back {
                let area = mesh.vector_area(face).length();
                let is_doubled = drawing.is_doubled.get(face as usize) == Some(&true);
                for pair in [(front, back), (back, front)] {
                    contacts.entry(pair).or_default()[usize::from(is_doubled)] += area;
                }
            }
        }
        contacts
    }

    /// The cells in front of a triangle and behind it.
    pub(crate) fn sides(&self, face: u32) -> [u32; 2] {
        [self.of_side[2 * face as usize], self.of_side[2 * face as usize + 1]]
    }

    /// Turns triangles over that have air behind them alone; not those of a panel on which a solid stands, which continue beside it.
    pub(crate) fn turn_to_air(&mut self, mesh: &mut Mesh, twins: &[[u32; 2]]) {
        let faces = 0..mesh.triangles.len() as u32;
        let mut is_turned: Vec<bool> = faces.map(|face| self.is_air(face) == [false, true]).collect();
        twins.iter().flatten().for_each(|&face| is_turned[face as usize] = false);
        for face in (0..is_turned.len()).filter(|&face| is_turned[face]) {
            mesh.triangles[face].corners.swap(1, 2);
            self.of_side.swap(2 * face, 2 * face + 1);
            self.is_object.swap(2 * face, 2 * face + 1);
        }
        let sides = self.cells.iter_mut().flat_map(|cell| &mut cell.hull);
        sides.for_each(|side| *side ^= u32::from(is_turned[*side as usize / 2]));
    }

    /// Whether air is in front of a triangle and behind it.
    pub(crate) fn is_air(&self, face: u32) -> [bool; 2] {
        self.sides(face).map(|cell| self.cells[cell as usize].is_air)
    }

    /// On how many sides of a triangle there is a solid.
    pub(crate) fn solids(&self, face: u32) -> usize {
        let is_solid = |cell: &u32| *cell != OUTSIDE && !self.cells[*cell as usize].is_air;
        self.sides(face).iter().filter(|cell| is_solid(cell)).count()
    }

    /// A cell.
    pub(crate) fn cell(&self, cell: u32) -> &Cell {
        &self.cells[cell as usize]
    }

    /// The cells that are bounded, with their numbers.
    pub(crate) fn inside(&self) -> impl Iterator<Item = (u32, &Cell)> {
        (0..).zip(&self.cells).skip(1)
    }

    /// The bounded cells that are `asked` for, the largest first.
    pub(crate) fn listed(&self, mesh: &Mesh, asked: impl Fn(&Cell) -> bool) -> Vec<CellPlace> {
        let mut faces: HashMap<u32, Vec<u32>> = HashMap::default();
        for (cell, side) in self.of_side.iter().zip(0..) {
            faces.entry(*cell).or_default().push(side / 2);
        }
        let place = |(number, cell): (u32, &Cell)| CellPlace {
            number,
            volume: cell.volume,
            place: self.middle(mesh, number, &faces[&number]),
            bounds: cell.bounds,
        };
        let mut places: Vec<CellPlace> = self.inside().filter(|(_, cell)| asked(cell)).map(place).collect();
        places.sort_by(|a, b| b.volume.total_cmp(&a.volume).then(a.number.cmp(&b.number)));
        places
    }

    /// A place in a bounded cell with some `faces`: half way from its largest one to the opposite one.
    fn middle(&self, mesh: &Mesh, cell: u32, faces: &[u32]) -> DVec3 {
        let side = largest(mesh, &self.cells[cell as usize].hull);
        let opposite = opposite(mesh, side, faces.iter().copied());
        center(mesh, side) + 0.5 * opposite.unwrap_or(0.0) * mesh.outward(side)
    }

    /// The cell that a point is in: of those whose hulls are around it, the one of the least volume.
    pub(crate) fn at(&self, mesh: &Mesh, point: DVec3) -> u32 {
        let is_around = |&(_, cell): &(u32, &Cell)| {
            let (low, high) = cell.bounds;
            point.cmpge(low).all()
                && point.cmple(high).all()
                && winding_number(mesh, &cell.hull, point).abs() > 0.5
        };
        let around = self.inside().filter(is_around);
        around.min_by(|a, b| a.1.whole.total_cmp(&b.1.whole)).map_or(OUTSIDE, |(index, _)| index)
    }
}

/// Evidence of the neighbours for an undecided cell.
#[derive(Debug, Clone, Copy, Default)]
struct Evidence {
    /// Contact with air through one face [m²]: it is not such air.
    unlike_air: f64,
    /// Contact that speaks for solid otherwise [m²].
    solid: f64,
    /// Contact that speaks for air [m²].
    air: f64,
    /// Contact with what is beyond the hull of a room [m²]: through one face, and through two.
    hull: [f64; 2],
    /// Contact [m²].
    contact: f64,
}

impl Evidence {
    /// Adds the areas of contact with a cell of air or solid, by one face and by two; `is_beyond` the hull of a room.
    fn add(&mut self, is_air: bool, is_beyond: bool, [single, double]: [f64; 2]) {
        self.contact += single + double;
        if is_beyond {
            self.hull[0] += single;
            self.hull[1] += double;
        }
        if is_air {
            self.unlike_air += single;
            self.air += double;
        } else {
            self.air += single;
            self.solid += double;
        }
    }

    fn is_solid(&self) -> bool {
        // All of a solid that stands flush against the hull is drawn over it; a room shares some of it.
        let [single, double] = self.hull;
        if single > LARGEST_SHARED * double {
            return false;
        }
        self.unlike_air > 0.0 && (double > 0.0 || self.unlike_air + self.solid > self.air)
    }
}

/// A point beside the largest triangle of some sides, in the region that they face [m].
fn beside(mesh: &Mesh, sides: &[u32], step: f64) -> DVec3 {
    let side = largest(mesh, sides);
    center(mesh, side) + step * mesh.outward(side)
}

/// The side of the largest triangle, of equal ones the first.
fn largest(mesh: &Mesh, sides: &[u32]) -> u32 {
    let area = |side: &&u32| mesh.vector_area(**side / 2).length_squared();
    let largest = sides.iter().max_by(|a, b| area(a).total_cmp(&area(b)).then(b.cmp(a)));
    *largest.expect("a boundary has sides")
}

/// Distance from the middle of a side along its normal to the first of some faces [m]; none where there is none.
fn opposite(mesh: &Mesh, side: u32, faces: impl Iterator<Item = u32>) -> Option<f64> {
    let (from, outward) = (center(mesh, side), mesh.outward(side));
    let others = faces.filter(|&face| face != side / 2);
    others.filter_map(|face| distance_along(mesh.corners(face), from, outward)).min_by(f64::total_cmp)
}

fn center(mesh: &Mesh, side: u32) -> DVec3 {
    let [a, b, c] = mesh.corners(side / 2);
    (a + b + c) / 3.0
}

/// The sides of triangles: 2 t is the front of triangle t, 2 t + 1 its back.
struct Sides<'a> {
    mesh: &'a Mesh,
    connected: Connected,
}

impl Sides<'_> {
    /// Joins the sides that face one another about an edge. Between the rims of a crack nothing is joined.
    fn join_around(&mut self, edge: &SharedEdge, is_taken: &[bool]) {
        let mut faces: SmallVec<[u32; 2]> =
            edge.faces.iter().copied().filter(|&face| is_taken[face as usize]).collect();
        if edge.is_crack {
            return;
        }
        if faces.len() > 2 {
            let first = faces[0];
            let turn = |face: &u32| edge.turn(self.mesh, first, *face);
            faces.sort_by(|a, b| turn(a).total_cmp(&turn(b)).then(a.cmp(b)));
        }
        for (at, &face) in faces.iter().enumerate() {
            let next = faces[(at + 1) % faces.len()];
            // The normal of a face that runs along the edge points to where angles grow.
            let ahead = 2 * face + u32::from(!edge.is_ahead(self.mesh, face));
            let behind = 2 * next + u32::from(edge.is_ahead(self.mesh, next));
            self.connected.join(ahead, behind);
        }
    }

    /// Joins the sides of two faces on either side of a crack.
    fn join_across(&mut self, facing: &Facing, edges: &[SharedEdge]) {
        let [a, b] = facing.faces;
        let turned = u32::from(!facing.agree(self.mesh, edges));
        self.connected.join(2 * a, 2 * b + turned);
        self.connected.join(2 * a + 1, 2 * b + 1 - turned);
    }

    /// The boundaries of all regions, in the order of their lowest side. What has too large cracks is open: faces are joined around them.
    fn closed_boundaries(&mut self, is_taken: &[bool], drawing: &Drawing<'_>) -> Vec<Boundary> {
        let boundaries = self.boundaries(is_taken, drawing.cracks);
        let is_open = |boundary: &Boundary| boundary.cracked > LARGEST_CRACKED_SHARE * boundary.area;
        let open: Vec<u32> = boundaries.iter().filter(|it| is_open(it)).map(|it| it.sides[0]).collect();
        if open.is_empty() {
            return boundaries;
        }
        let roots: Vec<u32> = open.into_iter().map(|side| self.connected.root(side)).collect();
        for face in drawing.cracks.iter().flat_map(|facing| facing.faces) {
            if [2 * face, 2 * face + 1].into_iter().any(|side| roots.contains(&self.connected.root(side))) {
                self.connected.join(2 * face, 2 * face + 1);
            }
        }
        self.boundaries(is_taken, drawing.cracks)
    }

    fn boundaries(&mut self, is_taken: &[bool], cracks: &[Facing]) -> Vec<Boundary> {
        let taken = (0..2 * is_taken.len() as u32).filter(|side| is_taken[*side as usize / 2]);
        let sides = self.connected.groups(taken);
        let known: HashMap<u32, usize> =
            sides.iter().map(|sides| self.connected.root(sides[0])).zip(0..).collect();
        let mut boundaries: Vec<Boundary> = sides.into_iter().map(|sides| self.boundary(sides)).collect();
        for Facing { faces: [face, _], crack, .. } in cracks {
            for side in [2 * face, 2 * face + 1] {
                if let Some(&index) = known.get(&self.connected.root(side)) {
                    boundaries[index].cracked += crack.area;
                }
            }
        }
        boundaries
    }

    fn boundary(&mut self, sides: Vec<u32>) -> Boundary {
        let mut is_bounding = |side: &u32| self.connected.root(*side) != self.connected.root(side ^ 1);
        let (bounding, fins): (Vec<u32>, Vec<u32>) =
            sides.iter().copied().partition(|side| is_bounding(side));
        let triangles = |sides: &[u32]| sides.iter().map(|side| side / 2).collect::<Vec<u32>>();
        let area = |sides: &[u32]| sides.iter().map(|side| self.mesh.vector_area(side / 2).length()).sum();
        Boundary {
            volume: signed_volume(self.mesh, &bounding),
            area: area(&bounding),
            bounds: self.mesh.bounds_of(&triangles(&bounding)),
            whole_bounds: self.mesh.bounds_of(&triangles(&sides)),
            fins: area(&fins),
            cracked: 0.0,
            sides,
        }
    }
}
