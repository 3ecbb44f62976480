//! Unit and upward axis of a mesh whose file does not state them, from its sizes and the names of its materials.

use glam::DVec3;

use super::DraftOptions;
use crate::notation::number;
use crate::obj::Polygons;
use crate::sections::walls::UNITS;
use crate::words::words;

/// Words of materials that are below, and above.
const BELOW: [&str; 4] = ["floor", "carpet", "parquet", "linoleum"];
const ABOVE: [&str; 2] = ["ceiling", "roof"];
/// Heights of rooms [m], from a low attic to a cathedral; their longest side [m]; and their volumes [m³].
const HEIGHTS: [f64; 2] = [2.0, 45.0];
const LONGEST: f64 = 200.0;
const VOLUMES: [f64; 2] = [5.0, 250_000.0];
/// Volume [m³] beyond which a room in metres may as well be one in decimetres: larger than nearly all halls.
const LARGE: f64 = 60_000.0;
/// Widths of corridors [m] that are lower than any room.
const NARROW: [f64; 2] = [1.0, 2.0];
/// Share of the extent within which corners are at an end of it [1]; furniture stands on a floor, so that more are at the lower end.
const AT_END: f64 = 0.01;
/// Corners, and share of all corners, by which the lower end has more than the upper one if it is a floor as surely as one extent is e times
/// another one. Chosen, not measured.
const SURE_CORNERS: f64 = 8.0;
const SURE_SHARE: f64 = 0.125;
/// Logarithm of odds from which on y is up [1]: of random bedrooms with y up 8 % are taken for z then, of those with z up 1 %.
const LEAST_ODDS: f64 = 0.5;

/// What was found.
#[derive(Debug, Default)]
pub(super) struct Axes {
    /// Keys of the scene file, a line each.
    pub(super) keys: String,
    /// One sentence each.
    pub(super) notes: Vec<String>,
    /// Likely mistakes, one sentence each.
    pub(super) warnings: Vec<String>,
}

/// Unit and upward axis of `polygons`.
///
/// # Errors
/// When the sizes fit several units.
pub(super) fn find(polygons: &Polygons, options: &DraftOptions<'_>) -> Result<Axes, String> {
    let mut axes = Axes::default();
    let up = upward(polygons, options, &mut axes);
    let Some(sizes) = extents(polygons) else { return Ok(axes) };
    unit(polygons, options, sizes, sizes.dot(up), &mut axes)?;
    Ok(axes)
}

fn extents(polygons: &Polygons) -> Option<DVec3> {
    let corners = || polygons.vertices.iter().copied();
    Some(corners().reduce(DVec3::max)? - corners().reduce(DVec3::min)?)
}

/// The upward axis in the axes of the file.
fn upward(polygons: &Polygons, options: &DraftOptions<'_>, axes: &mut Axes) -> DVec3 {
    if let Some(stated) = options.up {
        axes.keys += &format!("mesh_up = \"{stated}\"\n");
        return if stated == "y" { DVec3::Y } else { DVec3::Z };
    }
    if polygons.terms.is_y_up {
        axes.notes.push("up: y, as the file says; it is turned to z".to_owned());
        return DVec3::Y;
    }
    let lying = Lying::of(polygons);
    let [along_y, along_z] = [DVec3::Y, DVec3::Z].map(|axis| lying.area_across(axis));
    let (is_y, reason) = match lying.name {
        Some(name) if along_y.max(along_z) > 0.0 => (along_y > along_z, format!("as \"{name}\" lies")),
        _ if is_y_likely(polygons) => (
            true,
            "by its sizes and what stands in it (a guess: no material is called floor or ceiling)".to_owned(),
        ),
        _ => (false, "nothing in the file says otherwise".to_owned()),
    };
    let (axis, name) = if is_y { (DVec3::Y, "y") } else { (DVec3::Z, "z") };
    axes.notes.push(format!("up: {name}, {reason}"));
    if is_y {
        axes.keys += "mesh_up = \"y\"\n";
    }
    if lying.is_upside_down(axis) {
        axes.warnings.push(format!(
            "the floor is above the ceiling along {name}: turn the model over in the program that made it"
        ));
    }
    axis
}

/// Whether y is up rather than z, where no name tells: rooms are low, and what is in them stands on the floor.
fn is_y_likely(polygons: &Polygons) -> bool {
    let Some(DVec3 { y, z, .. }) = extents(polygons) else { return false };
    let is_narrow = |extent: f64| (NARROW[0]..NARROW[1]).contains(&extent);
    if is_narrow(y) != is_narrow(z) {
        return is_narrow(z);
    }
    let flatness = libm::log(z.max(f64::MIN_POSITIVE)) - libm::log(y.max(f64::MIN_POSITIVE));
    stood_on(polygons, DVec3::Y) - stood_on(polygons, DVec3::Z) + flatness > LEAST_ODDS
}

/// How surely the lower end along an axis is a floor, by the corners there less those at the upper end, as a logarithm of odds.
fn stood_on(polygons: &Polygons, axis: DVec3) -> f64 {
    let heights = || polygons.vertices.iter().map(|vertex| vertex.dot(axis));
    let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
    let margin = AT_END * (high - low);
    let at = |end: f64| heights().filter(|height| (height - end).abs() <= margin).count() as f64;
    (at(low) - at(high)) / SURE_CORNERS.max(SURE_SHARE * polygons.vertices.len() as f64)
}

/// Faces of materials that lie: floors and ceilings.
struct Lying<'p> {
    /// The first of their names.
    name: Option<&'p str>,
    /// Area as a vector along the normal, middle, and whether the face is above.
    faces: Vec<(DVec3, DVec3, bool)>,
}

impl<'p> Lying<'p> {
    fn of(polygons: &'p Polygons) -> Self {
        let has = |words: &[String], list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
        let kinds: Vec<Option<bool>> = polygons
            .names
            .iter()
            .map(|name| {
                let words = words(&name.name);
                if has(&words, &ABOVE) { Some(true) } else { has(&words, &BELOW).then_some(false) }
            })
            .collect();
        let of_kind = polygons.faces.iter().filter_map(|face| Some((face, kinds[face.name]?)));
        let faces = of_kind.clone().map(|(face, is_above)| {
            let corners: Vec<DVec3> = polygons.corners[face.corners.clone()]
                .iter()
                .map(|corner| polygons.vertices[*corner as usize])
                .collect();
            let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
            let sides = corners.iter().zip(corners.iter().cycle().skip(1));
            let area = sides.map(|(a, b)| 0.5 * (*a - middle).cross(*b - middle)).sum();
            (area, middle, is_above)
        });
        let faces = faces.collect();
        let name = of_kind.clone().next().map(|(face, _)| polygons.names[face.name].name.as_str());
        Self { name, faces }
    }

    /// Area projected along an axis, in units of the file squared.
    fn area_across(&self, axis: DVec3) -> f64 {
        self.faces.iter().map(|(area, ..)| area.dot(axis).abs()).sum()
    }

    /// Whether floors are higher than ceilings; false where one of both is missing.
    fn is_upside_down(&self, up: DVec3) -> bool {
        let height = |wanted: bool| {
            let of_kind = || self.faces.iter().filter(move |(.., is_above)| *is_above == wanted);
            let area: f64 = of_kind().map(|(area, ..)| area.length()).sum();
            let moment: f64 = of_kind().map(|(area, middle, _)| area.length() * middle.dot(up)).sum();
            (area > 0.0).then_some(moment / area)
        };
        matches!((height(false), height(true)), (Some(floor), Some(ceiling)) if floor > ceiling)
    }
}

/// Adds the unit: as stated, as the file says, metres where they make a room, else the only one that does.
fn unit(
    polygons: &Polygons,
    options: &DraftOptions<'_>,
    sizes: DVec3,
    height: f64,
    axes: &mut Axes,
) -> Result<(), String> {
    let in_unit = |length: f64| [sizes.x, sizes.y, sizes.z].map(|size| number(size * length)).join(" × ");
    if let Some(stated) = options.unit {
        axes.keys += &format!("mesh_unit = \"{stated}\"\n");
        return Ok(());
    }
    if let Some((length, name)) = polygons.terms.unit {
        axes.notes.push(format!("unit: {name}, as the file says: {} m", in_unit(length)));
        return Ok(());
    }
    let is_room = |length: f64| {
        let (volume, longest) =
            (sizes.element_product() * libm::pow(length, 3.0), sizes.max_element() * length);
        let within = |value: f64, [least, most]: [f64; 2]| (least..=most).contains(&value);
        within(height * length, HEIGHTS) && within(volume, VOLUMES) && longest <= LONGEST
    };
    let is_large = sizes.element_product() > LARGE;
    let rooms: Vec<(&str, f64)> =
        UNITS.into_iter().filter(|(name, length)| is_room(*length) && (is_large || *name == "m")).collect();
    let rooms = match rooms.is_empty() {
        true => UNITS.into_iter().filter(|(_, length)| is_room(*length)).collect(),
        false => rooms,
    };
    match rooms[..] {
        [] => axes.notes.push(format!("unit: m, as no unit makes a usual room of {}", in_unit(1.0))),
        [("m", _)] => axes.notes.push(format!("unit: m, which makes a room of {} m", in_unit(1.0))),
        [(name, length)] => {
            axes.keys += &format!("mesh_unit = \"{name}\"\n");
            axes.notes.push(format!(
                "unit: {name}, the only one that makes a usual room of {}: {} m",
                in_unit(1.0),
                in_unit(length)
            ));
        }
        _ => {
            let each: Vec<String> =
                rooms.iter().map(|(name, length)| format!("{name} ({} m)", in_unit(*length))).collect();
            return Err(format!(
                "the file states no unit, and {} may be {}: give the unit, such as `unit` {}",
                in_unit(1.0),
                each.join(" or "),
                rooms[0].0
            ));
        }
    }
    Ok(())
}
