//! Problems of a scene, each with its place and remedy.

use std::fmt;

use thiserror::Error;

/// A place in a file, lines and columns counted from 1; the column counts characters. Line 0 is the file as a whole.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// Label of the file, as given by the caller.
    pub file: String,
    /// Line, from 1; 0 where the file has no lines.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
}

/// One problem.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Place.
    pub place: Place,
    /// The fault and its remedy, with the key's full name first.
    pub message: String,
}

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

/// Everything wrong with a scene, in the order of the files' lines; never empty.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub struct SceneErrors {
    /// The problems.
    pub problems: Vec<Problem>,
}

impl SceneErrors {
    /// The problems of one file.
    pub(crate) fn of_file(file: &str, problems: Vec<LineProblem>) -> Self {
        Self { problems: problems.into_iter().map(|problem| problem.of(file)).collect() }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.line {
            0 => write!(f, "{}", self.file),
            line => write!(f, "{}:{line}:{}", self.file, self.column),
        }
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.message)
    }
}

impl fmt::Display for SceneErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, problem) in self.problems.iter().enumerate() {
            let separator = if i == 0 { "" } else { "\n" };
            write!(f, "{separator}{problem}")?;
        }
        Ok(())
    }
}
