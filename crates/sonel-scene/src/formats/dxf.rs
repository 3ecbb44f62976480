//! DXF files (text): 3DFACE, MESH, polyface and polygon meshes, in blocks too; the layer names the material.
//!
//! A file is pairs of lines, a group code and a value. What is inserted from a block is moved, scaled and turned as INSERT says;
//! entities on layer 0 of a block take the layer of the INSERT, and on layer 0 elsewhere a colour of their own names them
//! (`color 3`). The unit is `$INSUNITS`. Other entities, such as ACIS solids, are counted in the log.
//!
//! The crate `dxf` 0.6 brings 33 packages and knows no MESH, its errors name no entity, and blocks would still be inserted here.
//!
//! Reference: [Autodesk2012] (docs/references.md).

use std::collections::{BTreeMap, HashMap};

use glam::{DMat3, DMat4, DVec3, dvec3};

use super::collector::Collector;
use super::right_angled;
use crate::notation::text_of;
use crate::obj::{FileTerms, Polygons};
use crate::problem::LineProblem;

/// Deepest nesting of blocks. Chosen: drawings nest a few deep, damaged ones without end.
const DEEPEST: usize = 16;
/// Most copies of faces that a file may insert by blocks. It bounds memory; a million triangles load in 6 to 12 CPU seconds.
const MOST_COPIES: usize = 1_000_000;
/// Bits of the flags of POLYLINE and VERTEX.
const CLOSED_M: i64 = 1;
const POLYGON_MESH: i64 = 16;
const CLOSED_N: i64 = 32;
const POLYFACE: i64 = 64;
const IS_POSITION: i64 = 64;
const IS_FACE: i64 = 128;

/// Codes of `$INSUNITS` and lengths [m].
const UNITS: [(i64, f64, &str); 9] = [
    (1, 0.0254, "in"),
    (2, 0.3048, "ft"),
    (3, 1609.344, "mi"),
    (4, 0.001, "mm"),
    (5, 0.01, "cm"),
    (6, 1.0, "m"),
    (7, 1000.0, "km"),
    (10, 0.9144, "yd"),
    (14, 0.1, "dm"),
];

/// An entity, its line, and its group codes and values.
struct Entity {
    kind: String,
    line: usize,
    groups: Vec<(i64, String)>,
}

impl Entity {
    fn text(&self, code: i64) -> Option<&str> {
        self.groups.iter().find(|(found, _)| *found == code).map(|(_, value)| value.as_str())
    }

    fn number(&self, code: i64) -> Option<f64> {
        self.text(code)?.parse().ok()
    }

    /// All numbers of a code; what is none is not a number.
    fn numbers(&self, code: i64) -> Vec<f64> {
        let of_code = self.groups.iter().filter(|(found, _)| *found == code);
        of_code.map(|(_, value)| value.parse().unwrap_or(f64::NAN)).collect()
    }

    fn integer(&self, code: i64) -> i64 {
        self.text(code).and_then(|text| text.parse().ok()).unwrap_or(0)
    }

    /// The point whose x has this code; what is missing is 0, what is no number is no number.
    fn point(&self, code: i64) -> DVec3 {
        let at = |code: i64| self.text(code).map_or(0.0, |text| text.parse().unwrap_or(f64::NAN));
        dvec3(at(code), at(code + 10), at(code + 20))
    }

    fn layer(&self) -> &str {
        self.text(8).unwrap_or("0")
    }
}

pub(super) fn read(bytes: &[u8]) -> Result<Polygons, Vec<LineProblem>> {
    if bytes.starts_with(b"AutoCAD Binary DXF") {
        let message = "binary DXF is not read: save as text (ASCII) DXF";
        return Err(vec![LineProblem::new(0, message)]);
    }
    let text = text_of(bytes);
    let drawing = DxfDrawing::parse(&text).map_err(|problem| vec![problem])?;
    let terms = FileTerms { word: "layer", unit: drawing.unit, ..FileTerms::default() };
    let mut writer =
        Writer { drawing: &drawing, collector: Collector::new(terms), ignored: BTreeMap::new(), copies: 0 };
    writer.entities(&drawing.entities, DMat4::IDENTITY, None, 0);
    for (kind, (line, count)) in writer.ignored {
        let ignored = format!("{count} {kind} ignored: read are 3DFACE, MESH, polyface and polygon meshes");
        if writer.collector.has_faces() {
            writer.collector.notes.push((line, ignored));
        } else {
            writer.collector.problem(line, ignored);
        }
    }
    writer.collector.finish()
}

/// The parts of a file that matter.
#[derive(Default)]
struct DxfDrawing {
    unit: Option<(f64, &'static str)>,
    entities: Vec<Entity>,
    /// Base point and entities by name.
    blocks: HashMap<String, (DVec3, Vec<Entity>)>,
}

impl DxfDrawing {
    fn parse(text: &str) -> Result<Self, LineProblem> {
        let mut drawing = Self::default();
        let mut section = String::new();
        let mut block: Option<(String, DVec3, Vec<Entity>)> = None;
        let mut ended = false;
        for entity in records(text)? {
            match entity.kind.as_str() {
                "SECTION" => section = entity.text(2).unwrap_or("").to_owned(),
                "ENDSEC" => section.clear(),
                "EOF" => ended = true,
                "HEADER" => drawing.unit = unit(&entity),
                "BLOCK" if section == "BLOCKS" => {
                    block = Some((entity.text(2).unwrap_or("").to_owned(), entity.point(10), Vec::new()));
                }
                "ENDBLK" => {
                    if let Some((name, base, entities)) = block.take() {
                        drawing.blocks.insert(name, (base, entities));
                    }
                }
                _ if section == "BLOCKS" => {
                    if let Some((_, _, entities)) = &mut block {
                        entities.push(entity);
                    }
                }
                _ if section == "ENTITIES" => drawing.entities.push(entity),
                _ => {}
            }
        }
        if ended {
            Ok(drawing)
        } else {
            Err(LineProblem {
                line: text.lines().count().max(1),
                message: "no EOF: the file is cut off or not DXF".to_owned(),
            })
        }
    }
}

/// Splits a file at the group code 0. The variables of the header, which have code 9, become a record of kind `HEADER`.
fn records(text: &str) -> Result<Vec<Entity>, LineProblem> {
    let mut records: Vec<Entity> = Vec::new();
    let mut lines = text.lines().enumerate();
    while let Some((index, line)) = lines.next() {
        let Ok(code) = line.trim().parse::<i64>() else {
            let word: String = line.trim().chars().take(20).collect();
            return Err(LineProblem {
                line: index + 1,
                message: format!("`{word}` is not a group code: the file is not DXF"),
            });
        };
        let Some((_, value)) = lines.next() else { break };
        let value = value.trim().to_owned();
        match (code, records.last_mut()) {
            (0, _) => records.push(Entity { kind: value, line: index + 2, groups: Vec::new() }),
            (9, Some(last)) if last.kind == "SECTION" => {
                records.push(Entity { kind: "HEADER".to_owned(), line: index + 2, groups: vec![(9, value)] });
            }
            (_, Some(last)) => last.groups.push((code, value)),
            (_, None) => {}
        }
    }
    Ok(records)
}

fn unit(header: &Entity) -> Option<(f64, &'static str)> {
    let at = header.groups.iter().position(|(code, value)| *code == 9 && value == "$INSUNITS")?;
    let code: i64 = header.groups.get(at + 1)?.1.parse().ok()?;
    UNITS.iter().find(|(known, _, _)| *known == code).map(|(_, length, name)| (*length, *name))
}

struct Writer<'d> {
    drawing: &'d DxfDrawing,
    collector: Collector,
    /// First line and count of entities that are not read, by kind.
    ignored: BTreeMap<String, (usize, usize)>,
    copies: usize,
}

impl<'d> Writer<'d> {
    fn entities(&mut self, entities: &'d [Entity], transform: DMat4, layer: Option<&str>, depth: usize) {
        let mut rest = entities.iter();
        while let Some(entity) = rest.next() {
            let name = name(entity, layer);
            match entity.kind.as_str() {
                "3DFACE" => {
                    let corners = [10, 11, 12, 13].map(|code| entity.point(code));
                    self.face(&corners, transform, &name, entity.line);
                }
                "POLYLINE" if entity.integer(70) & (POLYFACE | POLYGON_MESH) != 0 => {
                    let vertices: Vec<&Entity> =
                        rest.by_ref().take_while(|part| part.kind == "VERTEX").collect();
                    if entity.integer(70) & POLYFACE != 0 {
                        self.polyface(&vertices, transform, layer);
                    } else {
                        self.polygon_mesh(entity, &vertices, transform, &name);
                    }
                }
                "MESH" => self.mesh(entity, transform, &name),
                "INSERT" => self.insert(entity, transform, &name, depth),
                "VERTEX" | "SEQEND" | "ATTRIB" => {}
                kind => {
                    let (_, count) = self.ignored.entry(kind.to_owned()).or_insert((entity.line, 0));
                    *count += 1;
                }
            }
        }
    }

    fn face(&mut self, corners: &[DVec3], transform: DMat4, name: &str, line: usize) {
        let corners: Vec<DVec3> = corners.iter().map(|corner| transform.transform_point3(*corner)).collect();
        self.collector.face(&corners, name, line);
    }

    fn polyface(&mut self, vertices: &[&Entity], transform: DMat4, layer: Option<&str>) {
        let is_position = |part: &&&Entity| part.integer(70) & IS_POSITION != 0;
        let positions: Vec<DVec3> = vertices.iter().filter(is_position).map(|part| part.point(10)).collect();
        for part in vertices.iter().filter(|part| part.integer(70) & (IS_FACE | IS_POSITION) == IS_FACE) {
            // A negative index marks an edge that is not drawn.
            let indices = [71, 72, 73, 74].map(|code| part.integer(code).unsigned_abs());
            let found: Option<Vec<DVec3>> = indices
                .iter()
                .filter(|index| **index > 0)
                .map(|index| positions.get(*index as usize - 1).copied())
                .collect();
            match found {
                Some(corners) => self.face(&corners, transform, &name(part, layer), part.line),
                None => self.collector.problem(
                    part.line,
                    format!("no such vertex: the mesh has {}, counted from 1", positions.len()),
                ),
            }
        }
    }

    /// A MESH without its subdivision: vertices, then for each face the number of its corners and their indices from 0.
    fn mesh(&mut self, mesh: &Entity, transform: DMat4, name: &str) {
        let [x, y, z] = [10, 20, 30].map(|code| mesh.numbers(code));
        let vertex = |index: usize| Some(dvec3(*x.get(index)?, *y.get(index)?, *z.get(index)?));
        let after_size = mesh.groups.iter().skip_while(|(code, _)| *code != 93).skip(1);
        let mut list =
            after_size.map_while(|(code, value)| (*code == 90).then_some(value)?.parse::<usize>().ok());
        while let Some(count) = list.next() {
            let corners: Option<Vec<DVec3>> = list.by_ref().take(count).map(vertex).collect();
            let Some(corners) = corners.filter(|corners| corners.len() == count) else {
                let message =
                    format!("MESH: a face has no such vertex: there are {}, counted from 0", x.len());
                return self.collector.problem(mesh.line, message);
            };
            self.face(&corners, transform, name, mesh.line);
        }
        if mesh.integer(91) > 0 {
            let note = "MESH: read is the mesh without subdivision; convert smooth ones to faces";
            self.collector.notes.push((mesh.line, note.to_owned()));
        }
    }

    fn polygon_mesh(&mut self, mesh: &Entity, vertices: &[&Entity], transform: DMat4, name: &str) {
        let [m, n] = [71, 72].map(|code| mesh.integer(code).max(0) as usize);
        if m.checked_mul(n) != Some(vertices.len()) {
            self.collector.problem(
                mesh.line,
                format!(
                    "a mesh of {m} × {n} vertices has {}: explode curved meshes to faces",
                    vertices.len()
                ),
            );
            return;
        }
        let flags = mesh.integer(70);
        let rows = if flags & CLOSED_M != 0 { m } else { m.saturating_sub(1) };
        let columns = if flags & CLOSED_N != 0 { n } else { n.saturating_sub(1) };
        let at = |row: usize, column: usize| vertices[row % m * n + column % n].point(10);
        for row in 0..rows {
            for column in 0..columns {
                let corners =
                    [at(row, column), at(row + 1, column), at(row + 1, column + 1), at(row, column + 1)];
                self.face(&corners, transform, name, mesh.line);
            }
        }
    }

    fn insert(&mut self, insert: &Entity, transform: DMat4, layer: &str, depth: usize) {
        let name = insert.text(2).unwrap_or("");
        let Some((base, entities)) = self.drawing.blocks.get(name) else {
            self.collector.problem(insert.line, format!("INSERT: no block `{name}` in the file"));
            return;
        };
        let counts = [70, 71].map(|code| insert.integer(code).max(1) as usize);
        self.copies = self.copies.saturating_add(counts[0].saturating_mul(counts[1]));
        if depth >= DEEPEST || self.copies > MOST_COPIES {
            if self.copies < usize::MAX {
                self.collector.problem(
                    insert.line,
                    "INSERT: blocks in blocks without end, or more than a million copies",
                );
            }
            self.copies = usize::MAX;
            return;
        }
        let angle = insert.number(50).unwrap_or(0.0).to_radians();
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let turn = DMat3::from_cols(dvec3(cos, sin, 0.0), dvec3(-sin, cos, 0.0), DVec3::Z);
        let turn = DMat4::from_mat3(right_angled(turn));
        let scale = DVec3::from([41, 42, 43].map(|code| insert.number(code).unwrap_or(1.0)));
        let at = insert.point(10);
        let outer = transform * DMat4::from_mat3(axes(insert));
        for column in 0..counts[0] {
            for row in 0..counts[1] {
                let step = dvec3(
                    column as f64 * insert.number(44).unwrap_or(0.0),
                    row as f64 * insert.number(45).unwrap_or(0.0),
                    0.0,
                );
                let place = outer * DMat4::from_translation(at) * turn * DMat4::from_translation(step);
                let inner = place * DMat4::from_scale(scale) * DMat4::from_translation(-*base);
                self.entities(entities, inner, Some(layer), depth + 1);
            }
        }
    }
}

/// What names the material of an entity; `layer` is that of the INSERT it comes by.
fn name(entity: &Entity, layer: Option<&str>) -> String {
    match (entity.layer(), layer) {
        ("0", Some(layer)) => layer.to_owned(),
        ("0", None) => match entity.integer(62) {
            color @ 1..=255 => format!("color {color}"),
            _ => "0".to_owned(),
        },
        (own, _) => own.to_owned(),
    }
}

/// The axes of an entity's own coordinates, by the arbitrary axis algorithm of the format.
fn axes(entity: &Entity) -> DMat3 {
    const NEARLY_Z: f64 = 1.0 / 64.0;
    let [x, y, z] =
        [(210, 0.0), (220, 0.0), (230, 1.0)].map(|(code, default)| entity.number(code).unwrap_or(default));
    let normal = dvec3(x, y, z).normalize_or(DVec3::Z);
    if normal == DVec3::Z {
        return DMat3::IDENTITY;
    }
    let is_nearly_z = normal.x.abs() < NEARLY_Z && normal.y.abs() < NEARLY_Z;
    let across = if is_nearly_z { DVec3::Y } else { DVec3::Z }.cross(normal).normalize_or(DVec3::X);
    DMat3::from_cols(across, normal.cross(across), normal)
}
