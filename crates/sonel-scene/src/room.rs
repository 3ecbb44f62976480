//! Log of a room: size, plausibility, open edges and cracks of the mesh.

use glam::DVec3;
use sonel_acoustics::mean_free_path;
use sonel_geometry::{Crack, Crossing, Geometry};

use crate::Scene;
use crate::notation::{count, listed, number, place};
use crate::report::Report;
use crate::sections::walls::UNITS;
use crate::words::words;

/// Volumes of rooms that are not warned of [m³]: from a small booth to a large stadium.
const PLAUSIBLE_VOLUMES: [f64; 2] = [1.0, 3e6];
/// Longest room without a warning [m]: beyond it a unit is wrong.
const LONGEST_ROOM: f64 = 1e3;
/// Extents of open scenes without a warning [m]: from a model to a valley.
const PLAUSIBLE_LENGTHS: [f64; 2] = [1.0, 1e4];

/// Notes extents, volume, surface, mean free path and Sabine time, and warns of an implausible size. `unit` is the length of
/// the unit of a mesh file [m].
pub(crate) fn describe(scene: &Scene, geometry: &Geometry, unit: Option<f64>, report: &Report) {
    let (low, high) = geometry.bounds();
    let extents = high - low;
    let DVec3 { x, y, z } = extents;
    let mut note = format!("geometry: extents {} m", [x, y, z].map(number).join(" × "));
    if let Some(volume) = geometry.volume() {
        let free_path = mean_free_path(volume, geometry.area());
        note += &format!(", volume {} m³, mean free path {} m", number(volume), number(free_path));
    }
    note += &format!(", surface {} m²", number(geometry.area()));
    if geometry.is_closed_room() && report.is_clean() {
        let times = scene.sabine_times(geometry);
        let [shortest, longest] = [f64::min, f64::max].map(|pick| times.iter().copied().reduce(pick));
        if let (Some(shortest), Some(longest)) = (shortest, longest) {
            let range = [shortest, longest].map(number);
            let range = if range[0] == range[1] { range[0].clone() } else { range.join(" … ") };
            note += &format!(", Sabine time {range} s");
        }
    }
    report.note(note);
    let longest = extents.max_element();
    let (size, [least, most], of) = match geometry.volume() {
        Some(volume) if volume <= PLAUSIBLE_VOLUMES[1] && longest > LONGEST_ROOM => {
            (longest, [PLAUSIBLE_LENGTHS[0], LONGEST_ROOM], "m")
        }
        Some(volume) => (volume, PLAUSIBLE_VOLUMES, "m³"),
        None => (longest, PLAUSIBLE_LENGTHS, "m"),
    };
    if size < least || size > most {
        let judgement = if size > most { "large" } else { "small" };
        let remedy = match unit {
            Some(unit) => format!("check mesh_unit{}", other_units(geometry, unit)),
            None => "shoebox is in metres".to_owned(),
        };
        report.warn(format!(
            "the room is implausibly {judgement}: {}, {} {of} (usual: {least} … {most} {of}); {remedy}",
            lengths(extents),
            number(size)
        ));
    }
}

/// Words of materials that lie or hang.
const LEVEL: [&str; 4] = ["floor", "carpet", "ceiling", "roof"];
/// Least cosine between the normal of a face and up of one that lies: up to 60° from the horizontal.
const VERTICAL: f64 = 0.5;

/// Warns of a mesh on its side: most of a material that should lie is vertical.
pub(crate) fn warn_of_its_side(scene: &Scene, geometry: &Geometry, report: &Report) {
    for (index, material) in (0_u32..).zip(&scene.materials) {
        if !words(&material.name).iter().any(|word| LEVEL.contains(&word.as_str())) {
            continue;
        }
        let of_material = || geometry.surfaces().iter().filter(|surface| surface.material == index);
        let area = |across: DVec3| -> f64 {
            let faces = of_material().filter(|surface| surface.normal.dot(across).abs() > VERTICAL);
            faces.map(|surface| surface.area).sum()
        };
        let whole: f64 = of_material().map(|surface| surface.area).sum();
        let vertical = whole - area(scene.up);
        if vertical <= 0.5 * whole {
            continue;
        }
        let (other, name) = if scene.up == DVec3::Z { (DVec3::Y, "y") } else { (DVec3::Z, "z") };
        let remedy = if area(other) > 0.5 * whole {
            format!("set mesh_up = \"{name}\"")
        } else {
            "turn it in the program that made it".to_owned()
        };
        report.warn(format!(
            "materials.{}: {:.0} % of its area is vertical, so the model seems to lie on its side; {remedy}",
            material.name,
            100.0 * vertical / whole
        ));
    }
}

fn lengths(extents: DVec3) -> String {
    format!("{} m", extents.to_array().map(number).join(" × "))
}

/// Sizes of a mesh in units that make a plausible room of it, after the unit that it was read in [m].
fn other_units(geometry: &Geometry, unit: f64) -> String {
    let (low, high) = geometry.bounds();
    let plausible = UNITS.iter().filter_map(|(name, length)| {
        let extents = length / unit * (high - low);
        let [least, most] = PLAUSIBLE_VOLUMES;
        let is_room =
            (least..=most).contains(&extents.element_product()) && extents.max_element() <= LONGEST_ROOM;
        is_room.then(|| format!("\"{name}\" makes it {}", lengths(extents)))
    });
    let sizes: Vec<String> = plausible.collect();
    if sizes.is_empty() { String::new() } else { format!(": {}", sizes.join(", ")) }
}

/// Cracks of the mesh with places and widths, and what they mean, in a sentence.
pub(crate) fn cracks(geometry: &Geometry) -> String {
    let cracks = geometry.cracks();
    let area: f64 = cracks.iter().map(|crack| crack.area).sum();
    let surface: f64 = geometry.surfaces().iter().map(|surface| surface.area).sum();
    let named = |crack: &Crack| {
        let [from, to] = crack.ends.map(place);
        let length = crack.ends[0].distance(crack.ends[1]);
        let triangle = triangle_at(geometry, crack.ends);
        let [length, width] = [length, 1e3 * crack.width].map(number);
        format!("({from}) to ({to}) m, {length} m long, {width} mm wide, at triangle {triangle}")
    };
    let escape = match geometry.is_closed_room() {
        true if geometry.is_watertight() => "",
        true => "; sound that leaves through them counts as escaped",
        false => "; a room may have at most 0.1 %",
    };
    format!(
        "{}, {} m² or {} % of the surface: {}; their rims do not diffract{escape}; raise mesh_weld above their width \
         or mend the mesh",
        count(cracks.len(), "crack"),
        number(area),
        number(100.0 * area / surface),
        listed(cracks.iter().map(named))
    )
}

/// Triangles that cross, with places.
pub(crate) fn crossings(geometry: &Geometry) -> String {
    let line =
        |Crossing { ends: [from, to] }: &Crossing| format!("from ({}) to ({}) m", place(*from), place(*to));
    let all = geometry.crossings();
    format!("{} of triangles cross: {}", count(all.len(), "pair"), listed(all.iter().map(line)))
}

/// The openings of the mesh, in a sentence.
pub(crate) fn leak(geometry: &Geometry) -> String {
    let edges = geometry.open_edges();
    let longest = edges.iter().max_by(|a, b| length(a).total_cmp(&length(b)));
    let Some(longest) = longest else {
        return "the mesh is not watertight: no closed part of it contains all others; energy can escape"
            .to_owned();
    };
    let [from, to] = longest.map(place);
    format!(
        "the mesh is not watertight: {}, the longest from ({from}) to ({to}) m, {} m long, of triangle {}; \
         energy can escape",
        count(edges.len(), "open edge"),
        number(length(longest)),
        triangle_at(geometry, *longest)
    )
}

/// Number of the triangle with the side nearest to the middle of a line, from 1.
fn triangle_at(geometry: &Geometry, [from, to]: [DVec3; 2]) -> u32 {
    geometry.nearest_side([from.midpoint(to); 2]).triangle + 1
}

fn length([from, to]: &[DVec3; 2]) -> f64 {
    from.distance(*to)
}
