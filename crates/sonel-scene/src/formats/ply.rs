//! PLY files: polygons over vertices, text or binary, read by `ply-rs-bw`.
//!
//! The material is named by the layer of a face (I-Simpa: `layer_id`, and an element `layer` of names), else by its colour, else by that of its vertices where all have the same (`#rrggbb`), else by
//! the face's `material_index`; a file without any names `walls`.

use glam::{DVec3, dvec3};
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};

use super::collector::Collector;
use super::color_name;
use crate::notation::text_of;
use crate::obj::{FileTerms, NAMELESS, Polygons};
use crate::problem::LineProblem;

/// Elements read of a vertex or a face.
#[derive(Default)]
struct ElementValues {
    position: [Option<f64>; 3],
    color: [Option<u8>; 3],
    material: Option<i64>,
    layer: Option<i64>,
    layer_name: Option<String>,
    corners: Option<Vec<i64>>,
    has_strips: bool,
}

impl PropertyAccess for ElementValues {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match name {
            "x" => self.position[0] = number(&property),
            "y" => self.position[1] = number(&property),
            "z" => self.position[2] = number(&property),
            "red" | "diffuse_red" => self.color[0] = property.to_u8_color_lossy(),
            "green" | "diffuse_green" => self.color[1] = property.to_u8_color_lossy(),
            "blue" | "diffuse_blue" => self.color[2] = property.to_u8_color_lossy(),
            "material_index" => self.material = number(&property).map(|index| index as i64),
            "layer_id" => self.layer = number(&property).map(|index| index as i64),
            "layer_name" => self.layer_name = list(property).map(|bytes| text(&bytes)),
            "vertex_indices" | "vertex_index" => self.corners = list(property),
            "tristrips" | "vertex_strips" => self.has_strips = true,
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

fn number(property: &Property) -> Option<f64> {
    Some(match property {
        Property::Char(value) => f64::from(*value),
        Property::UChar(value) => f64::from(*value),
        Property::Short(value) => f64::from(*value),
        Property::UShort(value) => f64::from(*value),
        Property::Int(value) => f64::from(*value),
        Property::UInt(value) => f64::from(*value),
        Property::Float(value) => f64::from(*value),
        Property::Double(value) => *value,
        _ => return None,
    })
}

fn list(property: Property) -> Option<Vec<i64>> {
    Some(match property {
        Property::ListChar(values) => values.into_iter().map(i64::from).collect(),
        Property::ListUChar(values) => values.into_iter().map(i64::from).collect(),
        Property::ListShort(values) => values.into_iter().map(i64::from).collect(),
        Property::ListUShort(values) => values.into_iter().map(i64::from).collect(),
        Property::ListInt(values) => values.into_iter().map(i64::from).collect(),
        Property::ListUInt(values) => values.into_iter().map(i64::from).collect(),
        _ => return None,
    })
}

/// Bytes of a text, up to a zero.
fn text(bytes: &[i64]) -> String {
    let bytes: Vec<u8> = bytes.iter().map(|byte| *byte as u8).take_while(|byte| *byte != 0).collect();
    text_of(&bytes).into_owned()
}

fn in_one_line(message: &str) -> String {
    message.lines().map(|line| line.trim().trim_start_matches("Error: ")).collect::<Vec<_>>().join(" ")
}

/// Excess of the header over the file: every row takes a byte at least, and the reader makes room for as many as are announced.
fn excess(bytes: &[u8]) -> Option<String> {
    let header = Parser::<ElementValues>::new().read_ply_header(&mut { bytes }).ok()?;
    let (name, element) = header.elements.iter().find(|(_, element)| element.count > bytes.len())?;
    Some(format!(
        "{} rows of \"{name}\" are announced, more than the file of {} bytes can hold",
        element.count,
        bytes.len()
    ))
}

pub(super) fn read(mut bytes: &[u8]) -> Result<Polygons, Vec<LineProblem>> {
    let refused = |line: usize, message: &str| vec![LineProblem::new(line, message)];
    if let Some(excess) = excess(bytes) {
        return Err(refused(0, &excess));
    }
    let mut file = Parser::<ElementValues>::new().read_ply(&mut bytes).map_err(|error| {
        let message = format!("the PLY reader refuses the file: {}", in_one_line(&error.to_string()));
        refused(error.line().unwrap_or(0), &message)
    })?;
    let rows = |file: &mut ply_rs_bw::ply::Ply<ElementValues>, name: &str| {
        file.payload.get_mut(name).map(std::mem::take).unwrap_or_default()
    };
    let (vertices, faces) = (rows(&mut file, "vertex"), rows(&mut file, "face"));
    let layers: Vec<Option<String>> =
        rows(&mut file, "layer").into_iter().map(|layer| layer.layer_name).collect();
    let mut collector =
        Collector::new(FileTerms { counts_lines: false, word: "colour", ..FileTerms::default() });
    let mut positions: Vec<DVec3> = Vec::new();
    for vertex in &vertices {
        let [Some(x), Some(y), Some(z)] = vertex.position else {
            return Err(refused(0, "a vertex has no x, y or z"));
        };
        positions.push(dvec3(x, y, z));
    }
    if faces.is_empty() && file.payload.iter().any(|(_, rows)| rows.iter().any(|row| row.has_strips)) {
        return Err(refused(0, "triangle strips are not read: export faces"));
    }
    for (i, face) in faces.iter().enumerate() {
        let indices = face.corners.as_deref().unwrap_or(&[]);
        let layer = face.layer.and_then(|layer| layer_of(&layers, layer));
        if let (Some(number), None, false) = (face.layer, layer, layers.is_empty()) {
            let count = layers.len();
            collector.problem(i + 1, format!("no layer {number}: the file names {count}, counted from 0"));
            continue;
        }
        let name = layer.map_or_else(|| name(face, indices, &vertices), str::to_owned);
        collector.indexed(&positions, indices, &name, i + 1);
    }
    collector.finish()
}

/// The name of a layer.
fn layer_of(layers: &[Option<String>], layer: i64) -> Option<&str> {
    layers.get(usize::try_from(layer).ok()?)?.as_deref()
}

fn name(face: &ElementValues, corners: &[i64], vertices: &[ElementValues]) -> String {
    let color = |row: &ElementValues| Some([row.color[0]?, row.color[1]?, row.color[2]?]);
    let of_corner = |corner: &i64| color(vertices.get(usize::try_from(*corner).ok()?)?);
    let of_corners = || {
        let first = of_corner(corners.first()?)?;
        corners.iter().all(|corner| of_corner(corner) == Some(first)).then_some(first)
    };
    match (color(face).or_else(of_corners), face.material) {
        (Some(color), _) => color_name(color),
        (None, Some(material)) => format!("material {material}"),
        (None, None) => NAMELESS.to_owned(),
    }
}
