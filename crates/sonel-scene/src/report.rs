//! Collects problems and notes while a scene is read.

use std::cell::RefCell;

use crate::problem::LineProblem;
use crate::{Place, Problem, SceneErrors};

/// Problems of a scene file that are listed: to find the line of each takes time in proportion to the file.
const MOST_PROBLEMS: usize = 100;

/// Problems of one scene and the notes for its log, with the text that turns offsets into lines. Every table and value of the scene refers to it.
pub(crate) struct Report {
    file: String,
    /// None of a scene made in code, which has no lines.
    text: Option<String>,
    problems: RefCell<Vec<Problem>>,
    remarks: RefCell<Remarks>,
}

/// Remarks on a valid scene.
#[derive(Default)]
pub(crate) struct Remarks {
    pub(crate) notes: Vec<Note>,
    /// Likely mistakes.
    pub(crate) warnings: Vec<String>,
}

/// Something to say in the log.
pub(crate) struct Note {
    pub(crate) text: String,
    pub(crate) kind: NoteKind,
}

#[derive(Clone, Copy, PartialEq)]
pub(crate) enum NoteKind {
    Plain,
    /// A default or an entry of a library that was taken: `PATH: VALUE`, perhaps `… (default)`.
    Default,
    /// A repair of the mesh.
    Repair,
    /// A fault of the mesh, with which it can be traced.
    Fault,
    /// A fault of the mesh that was repaired.
    RepairedFault,
}

impl Report {
    /// Nothing found yet in `text`, the scene file that messages call `file`.
    pub(crate) fn new(file: &str, text: Option<&str>) -> Self {
        Self {
            file: file.to_owned(),
            text: text.map(str::to_owned),
            problems: RefCell::default(),
            remarks: RefCell::default(),
        }
    }

    /// Whether there are more problems than anybody reads.
    pub(crate) fn is_full(&self) -> bool {
        self.problem_count() > MOST_PROBLEMS
    }

    /// A problem of the scene file at a byte offset. Those beyond [`MOST_PROBLEMS`] are one.
    pub(crate) fn problem(&self, offset: usize, message: impl Into<String>) {
        let message = match self.problem_count() {
            count if count > MOST_PROBLEMS => return,
            MOST_PROBLEMS => "there are more problems: mend those above first".to_owned(),
            _ => message.into(),
        };
        let of_code = || Place { file: self.file.clone(), line: 0, column: 1 };
        let place = self.text.as_deref().map_or_else(of_code, |text| place(&self.file, text, offset));
        self.problems.borrow_mut().push(Problem { place, message });
    }

    /// Problems of another file.
    pub(crate) fn problems_of(&self, file: &str, problems: impl IntoIterator<Item = LineProblem>) {
        self.problems.borrow_mut().extend(problems.into_iter().map(|problem| problem.of(file)));
    }

    /// What another file holds; its problems are reported.
    pub(crate) fn sound<T>(&self, file: &str, found: Result<T, Vec<LineProblem>>) -> Option<T> {
        found.map_err(|problems| self.problems_of(file, problems)).ok()
    }

    /// Something to say in the log.
    pub(crate) fn note(&self, note: impl Into<String>) {
        self.note_of(NoteKind::Plain, note);
    }

    /// The same of a kind.
    pub(crate) fn note_of(&self, kind: NoteKind, note: impl Into<String>) {
        self.remarks.borrow_mut().notes.push(Note { text: note.into(), kind });
    }

    /// A default or an entry of a library that was taken.
    pub(crate) fn default(&self, note: impl Into<String>) {
        self.note_of(NoteKind::Default, note);
    }

    /// Something that is likely a mistake.
    pub(crate) fn warn(&self, warning: impl Into<String>) {
        self.remarks.borrow_mut().warnings.push(warning.into());
    }

    /// Problems so far.
    pub(crate) fn problem_count(&self) -> usize {
        self.problems.borrow().len()
    }

    /// Whether the scene is valid so far.
    pub(crate) fn is_clean(&self) -> bool {
        self.problem_count() == 0
    }

    /// Everything wrong with the scene, if anything is.
    pub(crate) fn finish(self) -> Result<(), SceneErrors> {
        let (_, problems) = self.finish_anyway();
        if problems.is_empty() { Ok(()) } else { Err(SceneErrors { problems }) }
    }

    /// The remarks and everything wrong: the scene file's problems first, each file's by line.
    pub(crate) fn finish_anyway(self) -> (Remarks, Vec<Problem>) {
        let mut problems = self.problems.into_inner();
        problems.sort_by_key(|Problem { place, .. }| (place.file != self.file, place.line, place.column));
        problems.dedup();
        (self.remarks.into_inner(), problems)
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
    fn of_many_problems_the_first_are_listed() {
        let report = Report::new("s", Some(&"x\n".repeat(1000)));
        for line in 0..1000 {
            report.problem(2 * line, format!("number {line}"));
        }
        let problems = report.finish().unwrap_err().problems;
        assert_eq!(problems.len(), MOST_PROBLEMS + 1);
        let last = &problems[MOST_PROBLEMS];
        assert!(last.place.line == MOST_PROBLEMS + 1 && last.message.contains("more problems"), "{last}");
    }

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
