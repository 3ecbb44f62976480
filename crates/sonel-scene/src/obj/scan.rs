//! Reads an OBJ file line by line: problems with their place, and the polygons.

use glam::DVec3;

use super::collector::Collector;
use super::polygons::Polygons;
use crate::{Place, Problem};

/// The name of surfaces in a file that names nothing.
pub(crate) const NAMELESS: &str = "walls";

/// Something wrong in a line of a file, counted from 1; 0 is the file as a whole.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct LineProblem {
    pub(crate) line: usize,
    pub(crate) message: String,
}

impl LineProblem {
    pub(crate) fn new(line: usize, message: impl Into<String>) -> Self {
        Self { line, message: message.into() }
    }

    /// The problem as one of the file that messages call `file`.
    pub(crate) fn of(self, file: &str) -> Problem {
        let place = Place { file: file.to_owned(), line: self.line, column: 1 };
        Problem { place, message: self.message }
    }
}

/// A name used by `usemtl` and the line where it occurs first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct MaterialName {
    pub(crate) name: String,
    pub(crate) line: usize,
}

/// Statements without meaning for walls.
const IGNORED: [&str; 9] = ["vt", "vn", "s", "mtllib", "usemap", "maplib", "lod", "shadow_obj", "trace_obj"];
/// Statements of curves and curved surfaces.
const FREE_FORM: [&str; 9] = ["vp", "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm"];
/// The rest of them, and display attributes of curves.
const FREE_FORM_BODY: [&str; 9] = ["trim", "hole", "scrv", "sp", "end", "con", "mg", "bevel", "stech"];

/// Reads a whole file; bytes that are no UTF-8 are replaced, they can only stand in names and comments.
///
/// # Errors
/// Every problem of the file, in any order.
pub(crate) fn read(bytes: &[u8]) -> Result<Polygons, Vec<LineProblem>> {
    let text = String::from_utf8_lossy(bytes);
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
    line.trim_start_matches('\u{feff}').split('#').next().unwrap_or("")
}

#[derive(Default)]
struct Scanner {
    collector: Collector,
    /// Vertices in the order of the file.
    vertices: Vec<DVec3>,
    /// Numbers of the corners' vertices, from 1, face after face; they may follow the face.
    corners: Vec<u64>,
    /// Where the corners of each face end, the index of its name, and its line.
    faces: Vec<(usize, usize, usize)>,
    /// Index of the name of the next face; 0 before any.
    name: usize,
    has_material: bool,
    has_group: bool,
    /// First line and count of faces before any `usemtl`.
    bare_faces: Option<(usize, usize)>,
    /// First line and count of points and lines.
    wires: Option<(usize, usize)>,
}

/// Counts one more, remembering the first line.
pub(super) fn count(seen: &mut Option<(usize, usize)>, line: usize) {
    let (first, before) = seen.unwrap_or((line, 0));
    *seen = Some((first, before + 1));
}

impl Scanner {
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
                self.collector
                    .problem(line, format!("{keyword}: curved surfaces are not read; export polygons"));
            }
            _ => self.collector.problem(line, format!("`{}` is not an OBJ statement", shortened(keyword))),
        }
    }

    fn vertex<'w>(&mut self, line: usize, words: impl Iterator<Item = &'w str>) {
        // What may follow are a weight of free-form curves or a colour.
        let words: Vec<&str> = words.take(3).collect();
        let mut position = DVec3::ZERO;
        if words.len() < 3 {
            self.collector.problem(line, format!("v: {} coordinates; a vertex has three", words.len()));
        } else {
            for (axis, word) in words.into_iter().enumerate() {
                match word.parse::<f64>() {
                    Ok(number) if number.is_finite() => position[axis] = number,
                    Ok(_) => {
                        self.collector.problem(line, format!("v: {} is not a finite number", shortened(word)))
                    }
                    Err(_) => {
                        self.collector.problem(line, format!("v: `{}` is not a number", shortened(word)))
                    }
                }
            }
        }
        self.vertices.push(position);
    }

    fn group(&mut self, line: usize, statement: &str) {
        let name = statement.trim()[1..].trim();
        if !self.has_material && !name.is_empty() {
            self.has_group = true;
            self.name = self.collector.name(name, line);
        }
    }

    fn material(&mut self, line: usize, statement: &str) {
        let name = statement.trim().trim_start_matches("usemtl").trim();
        if name.is_empty() {
            self.collector.problem(line, "usemtl: no name; write the name of a material");
            return;
        }
        self.has_material = true;
        self.name = self.collector.name(name, line);
    }

    fn face<'w>(&mut self, line: usize, words: impl Iterator<Item = &'w str>) {
        if !self.has_material && !self.has_group {
            count(&mut self.bare_faces, line);
        }
        let words: Vec<&str> = words.collect();
        let corners: Vec<u64> = words.iter().filter_map(|word| self.corner(line, word)).collect();
        if words.len() < 3 {
            self.collector.problem(line, format!("f: {} corners; a face has at least three", words.len()));
        }
        if let Some(twice) = repeated(&corners) {
            self.collector.problem(line, format!("f: vertex {twice} occurs twice; split the face"));
        }
        self.corners.extend(corners);
        self.faces.push((self.corners.len(), self.name, line));
    }

    /// The absolute index, from 1, of the vertex of a word such as `7`, `7/1/2`, `7//2` or `-1`.
    fn corner(&mut self, line: usize, word: &str) -> Option<u64> {
        let index = word.split('/').next().unwrap_or("");
        let Ok(number) = index.parse::<i64>() else {
            self.collector.problem(line, format!("f: `{}` is not a vertex index", shortened(word)));
            return None;
        };
        let count = self.vertices.len() as u64;
        let absolute = match number {
            1.. => Some(number.unsigned_abs()),
            0 => None,
            _ => (count + 1).checked_sub(number.unsigned_abs()).filter(|index| *index > 0),
        };
        if absolute.is_none() {
            self.collector
                .problem(line, format!("f: no vertex {number}: {count} are defined so far, counted from 1"));
        }
        absolute
    }

    fn finish(mut self) -> Result<Polygons, Vec<LineProblem>> {
        let mut begin = 0;
        for &(end, name, line) in &self.faces {
            let count = self.vertices.len();
            let vertex = |&index: &u64| self.vertices.get(index as usize - 1);
            let corners = &self.corners[begin..end];
            for index in corners.iter().filter(|index| vertex(index).is_none()) {
                self.collector.problem(line, format!("f: no vertex {index}: the file has {count}"));
            }
            self.collector.outline(corners.iter().filter_map(vertex).copied(), name, line);
            begin = end;
        }
        if let Some((line, count)) = self.bare_faces {
            // A file that names nothing has one material.
            let is_named = self.has_material || self.has_group;
            if is_named {
                self.collector.problem(
                    line,
                    format!("f: no usemtl names the material of this face{}", and_more(count)),
                );
            } else {
                self.collector.name(NAMELESS, line);
            }
        }
        if self.faces.is_empty() {
            self.collector.problem(1, "the mesh has no face; export polygons");
        }
        if let Some((line, count)) = self.wires {
            self.collector.notes.push((line, format!("the point or line was ignored{}", and_more(count))));
        }
        self.collector.finish()
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
