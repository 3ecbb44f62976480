//! STL files, binary and text: triangles.
//!
//! A text file may hold several solids, whose names name the materials. A binary one may colour facets by its attribute: 5 bits
//! each of blue, green and red from the lowest on where the highest bit is set (VisCAM); with `COLOR=` in the header red, green
//! and blue where it is not set (Materialise). Normals are not read: surfaces are two-sided.
//!
//! The crate `stl_io` 0.11 drops the names of solids and all but the first, states no lines and reads text as `f32`.

use glam::{DVec3, dvec3};

use super::collector::Collector;
use super::{color_name, float};
use crate::notation::text_of;
use crate::obj::{FileTerms, NAMELESS, Polygons};
use crate::problem::LineProblem;

/// Header and count of a binary file.
const BEGIN: usize = 84;
const FACET: usize = 50;

pub(super) fn read(bytes: &[u8]) -> Result<Polygons, Vec<LineProblem>> {
    let count =
        bytes.get(80..BEGIN).map(|count| u32::from_le_bytes([count[0], count[1], count[2], count[3]]));
    let size = |count: u32| BEGIN as u64 + FACET as u64 * u64::from(count);
    if count.is_some_and(|count| size(count) == bytes.len() as u64) {
        return read_binary(bytes);
    }
    let begins_as_text =
        bytes.trim_ascii_start().get(..5).is_some_and(|begin| begin.eq_ignore_ascii_case(b"solid"));
    // Some programs begin binary files with the same word; numbers hold zero bytes.
    if begins_as_text && !bytes.iter().take(1024).any(|&byte| byte == 0) {
        return read_text(&text_of(bytes));
    }
    let message = match count {
        Some(count) => {
            format!(
                "the file has {} bytes, {} for its {count} triangles: export it again",
                bytes.len(),
                size(count)
            )
        }
        None => {
            "the file is not STL: it begins neither with `solid` nor with a header of 84 bytes".to_owned()
        }
    };
    Err(vec![LineProblem::new(0, message)])
}

fn read_binary(bytes: &[u8]) -> Result<Polygons, Vec<LineProblem>> {
    let (header, facets) = bytes.split_at(BEGIN);
    let is_materialise = header.windows(6).any(|word| word == b"COLOR=");
    let mut collector =
        Collector::new(FileTerms { counts_lines: false, word: "colour", ..FileTerms::default() });
    for (i, facet) in facets.chunks_exact(FACET).enumerate() {
        let corners =
            [12, 24, 36].map(|at| dvec3(float(facet, at), float(facet, at + 4), float(facet, at + 8)));
        let color = color(u16::from_le_bytes([facet[48], facet[49]]), is_materialise);
        collector.face(&corners, &color.map_or(NAMELESS.to_owned(), color_name), i + 1);
    }
    collector.finish()
}

/// The colour of a facet, if its attribute is one.
fn color(attribute: u16, is_materialise: bool) -> Option<[u8; 3]> {
    let has_own = (attribute >> 15 == 1) != is_materialise;
    let part = |shift: u16| ((attribute >> shift & 31) * 255 / 31) as u8;
    let low_first = [part(0), part(5), part(10)];
    let [a, b, c] = low_first;
    has_own.then_some(if is_materialise { low_first } else { [c, b, a] })
}

fn read_text(text: &str) -> Result<Polygons, Vec<LineProblem>> {
    let mut collector = Collector::new(FileTerms { word: "solid", ..FileTerms::default() });
    let mut solid = String::new();
    let mut corners: Vec<DVec3> = Vec::new();
    let mut open_facet = None;
    for (number, line) in text.lines().enumerate().map(|(i, line)| (i + 1, line.trim())) {
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        match word.to_ascii_lowercase().as_str() {
            "" | "outer" | "endloop" | "endsolid" => {}
            "solid" => solid = rest.trim().to_owned(),
            "facet" => {
                corners.clear();
                open_facet = Some(number);
            }
            "vertex" => match vertex(rest) {
                Some(corner) => corners.push(corner),
                None => collector.problem(number, format!("vertex `{rest}`: a vertex has three numbers")),
            },
            "endfacet" => match open_facet.take() {
                Some(begun) if corners.len() == 3 => collector.face(&corners, &solid, begun),
                _ => collector.problem(number, format!("a facet has 3 vertices, not {}", corners.len())),
            },
            _ => collector.problem(
                number,
                format!("`{}` is not an STL statement", word.chars().take(20).collect::<String>()),
            ),
        }
    }
    if let Some(begun) = open_facet {
        collector.problem(begun, "the facet has no end: the file is cut off");
    }
    collector.finish()
}

fn vertex(text: &str) -> Option<DVec3> {
    let numbers: Vec<f64> = text.split_whitespace().map(str::parse).collect::<Result<_, _>>().ok()?;
    let [x, y, z] = numbers[..] else { return None };
    Some(dvec3(x, y, z))
}
