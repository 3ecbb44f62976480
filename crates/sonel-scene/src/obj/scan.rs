//! Reads an OBJ file line by line: polygons, and problems with their place.

use std::collections::HashMap;
use std::ops::Range;

use glam::DVec3;

use crate::notation::text_of;
use crate::problem::LineProblem;

/// The name of surfaces in a file that names nothing.
pub(crate) const NAMELESS: &str = "walls";

/// A name used by `usemtl` and the line where it occurs first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct MaterialName {
    pub(crate) name: String,
    pub(crate) line: usize,
}

/// One polygon.
#[derive(Debug)]
pub(crate) struct Face {
    /// Range of corners.
    pub(crate) corners: Range<usize>,
    /// Index of the name.
    pub(crate) name: usize,
    /// Line in the file, or number of the face, from 1.
    pub(crate) line: usize,
}

/// Result of the scan of a file.
#[derive(Default)]
pub(crate) struct Scan {
    pub(crate) vertices: Vec<DVec3>,
    /// Indices of vertices from 1, face after face.
    pub(crate) corners: Vec<usize>,
    /// Ranges in `corners`, in the order of the file.
    pub(crate) faces: Vec<Face>,
    pub(crate) names: Vec<MaterialName>,
    pub(crate) problems: Vec<LineProblem>,
    /// Lines and what was done about them.
    pub(crate) notes: Vec<(usize, String)>,
}

/// Statements without meaning for walls.
const IGNORED: [&str; 9] = ["vt", "vn", "s", "mtllib", "usemap", "maplib", "lod", "shadow_obj", "trace_obj"];
/// Statements of curves and curved surfaces.
const FREE_FORM: [&str; 9] = ["vp", "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm"];
/// The rest of them, and display attributes of curves.
const FREE_FORM_BODY: [&str; 9] = ["trim", "hole", "scrv", "sp", "end", "con", "mg", "bevel", "stech"];

/// Scans a whole file.
pub(crate) fn scan(bytes: &[u8]) -> Scan {
    let text = text_of(bytes);
    let mut scanner = Scanner::default();
    let mut lines = text.lines().enumerate();
    while let Some((index, line)) = lines.next() {
        let mut statement = without_comment(line).to_owned();
        // A backslash at the end continues the statement in the next line. What was read is not copied again.
        while statement.trim_end().ends_with('\\') {
            statement.truncate(statement.trim_end().len() - 1);
            statement.push(' ');
            statement.push_str(lines.next().map_or("", |(_, next)| without_comment(next)));
        }
        scanner.statement(index + 1, &statement);
    }
    scanner.finish()
}

fn without_comment(line: &str) -> &str {
    line.split('#').next().unwrap_or("")
}

#[derive(Default)]
struct Scanner {
    scan: Scan,
    /// Index of the name of the faces that follow.
    name: usize,
    indices_of_names: HashMap<String, usize>,
    has_material: bool,
    has_group: bool,
    /// First line and count of faces before any `usemtl`.
    bare_faces: Option<(usize, usize)>,
    /// First line and count of points and lines.
    wires: Option<(usize, usize)>,
    /// Lines and indices that lie beyond the vertices read so far; the vertices may follow.
    forward: Vec<(usize, usize)>,
}

/// Counts one more, remembering the first line.
fn count(seen: &mut Option<(usize, usize)>, line: usize) {
    let (first, before) = seen.unwrap_or((line, 0));
    *seen = Some((first, before + 1));
}

impl Scanner {
    fn problem(&mut self, line: usize, message: impl Into<String>) {
        self.scan.problems.push(LineProblem { line, message: message.into() });
    }

    fn statement(&mut self, line: usize, statement: &str) {
        let mut words = statement.split_whitespace();
        let Some(keyword) = words.next() else { return };
        match keyword {
            "v" => self.vertex(line, words),
            "f" => self.face(line, words),
            "usemtl" => self.material(line, statement),
            // Without materials the groups or objects name the surfaces.
            "g" | "o" => self.group(line, statement),
            "l" | "p" => count(&mut self.wires, line),
            _ if IGNORED.contains(&keyword) => {}
            _ if FREE_FORM.contains(&keyword) || FREE_FORM_BODY.contains(&keyword) => {
                self.problem(line, format!("{keyword}: curved surfaces are not read; export polygons"));
            }
            _ => self.problem(line, format!("`{}` is not an OBJ statement", shortened(keyword))),
        }
    }

    fn vertex<'w>(&mut self, line: usize, words: impl Iterator<Item = &'w str>) {
        let last = self.scan.vertices.len();
        self.scan.vertices.push(DVec3::ZERO);
        // What may follow are a weight of free-form curves or a colour.
        let coordinates: Vec<&str> = words.take(3).collect();
        if coordinates.len() < 3 {
            self.problem(line, format!("v: {} coordinates; a vertex has three", coordinates.len()));
            return;
        }
        for (axis, word) in coordinates.iter().enumerate() {
            match word.parse::<f64>() {
                Ok(number) if number.is_finite() => self.scan.vertices[last][axis] = number,
                Ok(_) => self.problem(line, format!("v: {} is not a finite number", shortened(word))),
                Err(_) => self.problem(line, format!("v: `{}` is not a number", shortened(word))),
            }
        }
    }

    fn group(&mut self, line: usize, statement: &str) {
        let name = statement.trim()[1..].trim();
        if !self.has_material && !name.is_empty() {
            self.has_group = true;
            self.begin(line, name);
        }
    }

    fn material(&mut self, line: usize, statement: &str) {
        let name = statement.trim().trim_start_matches("usemtl").trim();
        if name.is_empty() {
            self.problem(line, "usemtl: no name; write the name of a material");
            return;
        }
        self.has_material = true;
        self.begin(line, name);
    }

    /// Faces from here on have this name.
    fn begin(&mut self, line: usize, name: &str) {
        let next = self.scan.names.len();
        let index = *self.indices_of_names.entry(name.to_owned()).or_insert(next);
        if index == next {
            self.scan.names.push(MaterialName { name: name.to_owned(), line });
        }
        self.name = index;
    }

    fn face<'w>(&mut self, line: usize, words: impl Iterator<Item = &'w str>) {
        if !self.has_material && !self.has_group {
            count(&mut self.bare_faces, line);
        }
        let words: Vec<&str> = words.collect();
        let corners: Vec<usize> = words.iter().filter_map(|word| self.corner(line, word)).collect();
        if words.len() < 3 {
            self.problem(line, format!("f: {} corners; a face has at least three", words.len()));
        }
        if let Some(twice) = repeated(&corners) {
            self.problem(line, format!("f: vertex {twice} occurs twice; split the face"));
        }
        let start = self.scan.corners.len();
        self.scan.corners.extend(corners);
        self.scan.faces.push(Face { corners: start..self.scan.corners.len(), name: self.name, line });
    }

    /// The absolute index, from 1, of the vertex of a word such as `7`, `7/1/2`, `7//2` or `-1`.
    fn corner(&mut self, line: usize, word: &str) -> Option<usize> {
        let (index, count) = (word.split('/').next().unwrap_or(""), self.scan.vertices.len());
        let Ok(number) = index.parse::<i64>() else {
            self.problem(line, format!("f: `{}` is not a vertex index", shortened(word)));
            return None;
        };
        let absolute = match number {
            1.. => usize::try_from(number).ok(),
            0 => None,
            _ => (count + 1).checked_sub(number.unsigned_abs() as usize).filter(|index| *index > 0),
        };
        let Some(absolute) = absolute else {
            self.problem(line, format!("f: no vertex {number}: {count} are defined so far, counted from 1"));
            return None;
        };
        if absolute > count {
            self.forward.push((line, absolute));
        }
        Some(absolute)
    }

    fn finish(mut self) -> Scan {
        for (line, index) in std::mem::take(&mut self.forward) {
            let count = self.scan.vertices.len();
            if index > count {
                self.problem(line, format!("f: no vertex {index}: the file has {count}"));
            }
        }
        if let (Some((line, _)), true) = (self.bare_faces, self.scan.names.is_empty()) {
            // A file that names nothing has one material.
            self.scan.names.push(MaterialName { name: NAMELESS.to_owned(), line });
        } else if let Some((line, count)) = self.bare_faces {
            self.problem(line, format!("f: no usemtl names the material of this face{}", and_more(count)));
        }
        if self.scan.faces.is_empty() {
            self.problem(1, "the mesh has no face; export polygons");
        }
        if let Some((line, count)) = self.wires {
            self.scan.notes.push((line, format!("the point or line was ignored{}", and_more(count))));
        }
        self.scan
    }
}

/// Ends a message about the first of `count` faces.
pub(crate) fn and_more(count: usize) -> String {
    if count > 1 { format!(" (and {} more)", count - 1) } else { String::new() }
}

/// A word of a damaged file, short enough for a message.
fn shortened(word: &str) -> String {
    const LONGEST: usize = 20;
    if word.chars().count() <= LONGEST {
        return word.to_owned();
    }
    word.chars().take(LONGEST).chain(['…']).collect()
}

/// A vertex that occurs twice in an outline but not at an end of a bridge to a hole, which is walked there and back: `a b … b a`.
pub(crate) fn repeated<Index: Copy + Ord>(corners: &[Index]) -> Option<Index> {
    let count = corners.len();
    let mut sorted: Vec<(Index, usize)> = corners.iter().copied().zip(0..).collect();
    sorted.sort_unstable();
    let is_bridge = |i: usize, j: usize| {
        let [after, before] =
            [|at: usize, count: usize| (at + 1) % count, |at, count| (at + count - 1) % count];
        let is_apart = j - i > 2 && i + count - j > 2;
        is_apart
            && (corners[after(i, count)] == corners[before(j, count)]
                || corners[before(i, count)] == corners[after(j, count)])
    };
    let pairs = sorted.windows(2).filter(|pair| pair[0].0 == pair[1].0);
    pairs.map(|pair| (pair[0], pair[1])).find(|(a, b)| !is_bridge(a.1, b.1)).map(|(a, _)| a.0)
}
