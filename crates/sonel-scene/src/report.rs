//! Collects problems and notes while a scene is read.

use crate::{Place, Problem, SceneErrors};

/// Problems of one scene and the notes for its log, with the text that turns offsets into lines.
pub(crate) struct Report<'t> {
    file: &'t str,
    /// None of a scene made in code, which has no lines.
    text: Option<&'t str>,
    problems: Vec<Problem>,
    remarks: Remarks,
}

/// Remarks on a valid scene.
#[derive(Default)]
pub(crate) struct Remarks {
    /// Defaults taken, repairs made.
    pub(crate) notes: Vec<String>,
    /// Indices of the notes about defaults and entries of libraries.
    pub(crate) defaults: Vec<usize>,
    /// Indices of the notes about faults of the mesh.
    pub(crate) faults: Vec<usize>,
    /// Indices of the notes about repairs of the mesh.
    pub(crate) repairs: Vec<usize>,
    /// Likely mistakes.
    pub(crate) warnings: Vec<String>,
}

impl<'t> Report<'t> {
    /// Nothing found yet in `text`, the scene file that messages call `file`.
    pub(crate) fn new(file: &'t str, text: Option<&'t str>) -> Self {
        Self { file, text, problems: Vec::new(), remarks: Remarks::default() }
    }

    /// A problem of the scene file at a byte offset.
    pub(crate) fn problem(&mut self, offset: usize, message: impl Into<String>) {
        let of_code = || Place { file: self.file.to_owned(), line: 0, column: 1 };
        let place = self.text.map_or_else(of_code, |text| place(self.file, text, offset));
        self.problems.push(Problem { place, message: message.into() });
    }

    /// A problem at the beginning of a line of another file.
    pub(crate) fn problem_in_mesh(&mut self, file: &str, line: usize, message: impl Into<String>) {
        let place = Place { file: file.to_owned(), line, column: 1 };
        self.problems.push(Problem { place, message: message.into() });
    }

    /// Something to say in the log.
    pub(crate) fn note(&mut self, note: impl Into<String>) {
        self.remarks.notes.push(note.into());
    }

    /// A default or an entry of a library that was taken: `PATH: VALUE`, perhaps `… (default)`.
    pub(crate) fn default(&mut self, note: impl Into<String>) {
        self.remarks.defaults.push(self.remarks.notes.len());
        self.note(note);
    }

    /// A repair of the mesh.
    pub(crate) fn repair(&mut self, note: impl Into<String>) {
        self.remarks.repairs.push(self.remarks.notes.len());
        self.note(note);
    }

    /// A fault of the mesh that was repaired.
    pub(crate) fn repaired_fault(&mut self, note: impl Into<String>) {
        self.remarks.repairs.push(self.remarks.notes.len());
        self.fault(note);
    }

    /// A fault of the mesh, with which it can be traced.
    pub(crate) fn fault(&mut self, note: impl Into<String>) {
        self.remarks.faults.push(self.remarks.notes.len());
        self.note(note);
    }

    /// Something that is likely a mistake.
    pub(crate) fn warn(&mut self, warning: impl Into<String>) {
        self.remarks.warnings.push(warning.into());
    }

    /// Problems so far.
    pub(crate) fn problem_count(&self) -> usize {
        self.problems.len()
    }

    /// Whether the scene is valid so far.
    pub(crate) fn is_clean(&self) -> bool {
        self.problems.is_empty()
    }

    /// The remarks on a valid scene, or everything wrong with it.
    pub(crate) fn finish(self) -> Result<Remarks, SceneErrors> {
        let (remarks, problems) = self.finish_anyway();
        if problems.is_empty() { Ok(remarks) } else { Err(SceneErrors { problems }) }
    }

    /// The remarks and everything wrong: the scene file's problems first, each file's by line.
    pub(crate) fn finish_anyway(mut self) -> (Remarks, Vec<Problem>) {
        let scene_file = self.file;
        self.problems.sort_by_key(|problem| {
            (problem.place.file != scene_file, problem.place.line, problem.place.column)
        });
        self.problems.dedup();
        (self.remarks, self.problems)
    }
}

/// Line and column of a byte offset.
fn place(file: &str, text: &str, offset: usize) -> Place {
    let bytes = text.as_bytes();
    let before = &bytes[..offset.min(bytes.len())];
    let line_start = before.iter().rposition(|byte| *byte == b'\n').map_or(0, |newline| newline + 1);
    let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
    // Continuation bytes of UTF-8 begin with the bits 10 and are no characters of their own.
    let characters = before[line_start..].iter().filter(|byte| **byte & 0xC0 != 0x80).count();
    Place { file: file.to_owned(), line, column: 1 + characters }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_count_lines_and_characters_from_one() {
        let text = "a = 1\nα = 2\n";
        let at = |offset| {
            let place = place("s", text, offset);
            (place.line, place.column)
        };
        assert_eq!(at(0), (1, 1));
        assert_eq!(at(4), (1, 5));
        assert_eq!(at(text.find('2').unwrap()), (2, 5));
        assert_eq!(at(1000), (3, 1));
    }
}
