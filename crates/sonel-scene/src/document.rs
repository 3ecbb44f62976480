//! Tables and values of a scene document with their full key and, where it was a file, their position.
//!
//! Every reader reports what is wrong with a value and returns `None` for it, so that reading goes on to the next.

use std::ops::Range;

use glam::DVec3;

use crate::report::Report;
use crate::suggest::suggest;
use crate::value::{Entries, Kind, Value};

pub(crate) use crate::value::{quoted, quoted_key};

/// A table with its full key; the document itself has an empty one.
pub(crate) struct Table<'t> {
    path: String,
    pub(crate) at: usize,
    entries: &'t Entries,
}

/// A value with its full key.
pub(crate) struct Entry<'t> {
    pub(crate) path: String,
    pub(crate) at: usize,
    value: &'t Value,
}

/// A finite number and where it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Number {
    pub(crate) value: f64,
    pub(crate) at: usize,
}

/// The items of a list that are finite numbers; the others are in the report.
pub(crate) struct Numbers {
    pub(crate) readable: Vec<Number>,
    /// Whether every item was readable, so that their count and order mean something.
    pub(crate) is_complete: bool,
}

impl<'t> Table<'t> {
    /// The whole document.
    pub(crate) fn document(entries: &'t Entries) -> Self {
        Self { path: String::new(), at: 0, entries }
    }

    /// Full key of this table.
    pub(crate) fn path(&self) -> &str {
        &self.path
    }

    /// Full key of an entry of this table.
    pub(crate) fn path_of(&self, key: &str) -> String {
        let key = quoted_key(key);
        if self.path.is_empty() { key } else { format!("{}.{key}", self.path) }
    }

    /// The value of a key, if it is there.
    pub(crate) fn get(&self, key: &str) -> Option<Entry<'t>> {
        let value = self.entries.get(key)?;
        Some(Entry { path: self.path_of(key), at: value.span.start, value })
    }

    /// Position of the value of a key [bytes].
    pub(crate) fn span_of(&self, key: &str) -> Option<Range<usize>> {
        self.entries.get(key).map(|value| value.span.clone())
    }

    /// Keys and values in the order of the file.
    pub(crate) fn in_file_order(&self) -> Vec<(&'t str, Entry<'t>)> {
        let entry = |(key, _, value): &'t (String, usize, Value)| {
            (key.as_str(), Entry { path: self.path_of(key), at: value.span.start, value })
        };
        self.entries.0.iter().map(entry).collect()
    }

    /// Reports every key that is not `known`.
    pub(crate) fn allow_only(&self, known: &[&str], report: &mut Report<'_>) {
        for (name, at, _) in &self.entries.0 {
            if !known.contains(&name.as_str()) {
                let advice = suggest(name, known.iter().copied());
                report.problem(*at, format!("{}: unknown key; {advice}", self.path_of(name)));
            }
        }
    }
}

impl<'t> Entry<'t> {
    /// Reports `message` about this value.
    pub(crate) fn problem(&self, report: &mut Report<'_>, message: &str) {
        report.problem(self.at, format!("{}: {message}", self.path));
    }

    fn expected(&self, what: &str, report: &mut Report<'_>) {
        self.problem(report, &format!("expected {what}, found {}", self.kind()));
    }

    fn kind(&self) -> &'static str {
        match self.value.kind {
            Kind::Text(_) => "a text in quotes",
            Kind::Number(_) => "a number",
            Kind::Flag(_) => "true or false",
            Kind::Date(_) => "a date",
            Kind::List(_) => "a list",
            Kind::Table(_) => "a table",
        }
    }

    /// The items of a list, each with its own place.
    fn items(&self) -> Option<impl Iterator<Item = Entry<'t>> + use<'t, '_>> {
        let Kind::List(items) = &self.value.kind else { return None };
        Some(items.iter().enumerate().map(|(i, value)| Entry {
            path: format!("{}[{}]", self.path, i + 1),
            at: value.span.start,
            value,
        }))
    }

    /// A text.
    pub(crate) fn text(&self, report: &mut Report<'_>) -> Option<&'t str> {
        match &self.value.kind {
            Kind::Text(text) => Some(text),
            _ => {
                self.expected("a text in quotes", report);
                None
            }
        }
    }

    /// A text with something in it.
    pub(crate) fn filled_text(&self, report: &mut Report<'_>) -> Option<&'t str> {
        let text = self.text(report)?;
        if text.trim().is_empty() {
            self.problem(report, "is empty: write a text or leave the key out");
            return None;
        }
        Some(text)
    }

    /// One text or a list of them, each with its own place.
    pub(crate) fn texts(&self, report: &mut Report<'_>) -> Vec<(&'t str, Entry<'t>)> {
        let entries: Vec<Entry<'t>> = match self.items() {
            Some(items) => items.collect(),
            None => vec![Entry { path: self.path.clone(), at: self.at, value: self.value }],
        };
        entries.into_iter().filter_map(|entry: Entry<'t>| Some((entry.filled_text(report)?, entry))).collect()
    }

    /// True or false.
    pub(crate) fn flag(&self, report: &mut Report<'_>) -> Option<bool> {
        match self.value.kind {
            Kind::Flag(flag) => Some(flag),
            _ => {
                self.expected("true or false", report);
                None
            }
        }
    }

    /// A finite number.
    pub(crate) fn number(&self, report: &mut Report<'_>) -> Option<Number> {
        let Kind::Number(value) = self.value.kind else {
            self.expected("a number", report);
            return None;
        };
        if !value.is_finite() {
            self.problem(report, &format!("{value} is not a finite number"));
            return None;
        }
        Some(Number { value, at: self.at })
    }

    /// A finite number above zero.
    pub(crate) fn positive(&self, report: &mut Report<'_>) -> Option<f64> {
        let number = self.number(report)?;
        if number.value <= 0.0 {
            self.problem(report, &format!("{} is not positive", number.value));
            return None;
        }
        Some(number.value)
    }

    /// A list of finite numbers.
    pub(crate) fn numbers(&self, report: &mut Report<'_>) -> Option<Numbers> {
        let Some(items) = self.items() else {
            self.expected("a list of numbers such as [1.0, 2.0]", report);
            return None;
        };
        let numbers: Vec<Option<Number>> = items.map(|item| item.number(report)).collect();
        let is_complete = numbers.iter().all(Option::is_some);
        Some(Numbers { readable: numbers.into_iter().flatten().collect(), is_complete })
    }

    /// One finite number, or a list of them.
    pub(crate) fn number_or_list(&self, report: &mut Report<'_>) -> Option<Numbers> {
        if self.is_list() {
            return self.numbers(report);
        }
        self.number(report).map(|number| Numbers { readable: vec![number], is_complete: true })
    }

    /// Whether this is a list.
    pub(crate) fn is_list(&self) -> bool {
        matches!(self.value.kind, Kind::List(_))
    }

    /// Whether this is a list with nothing in it.
    pub(crate) fn is_empty_list(&self) -> bool {
        matches!(&self.value.kind, Kind::List(items) if items.is_empty())
    }

    /// Three finite numbers.
    pub(crate) fn vector(&self, report: &mut Report<'_>) -> Option<DVec3> {
        let Numbers { readable, is_complete: true } = self.numbers(report)? else { return None };
        let [x, y, z] = readable[..] else {
            self.problem(report, &format!("expected three numbers [x, y, z], found {}", readable.len()));
            return None;
        };
        Some(DVec3::new(x.value, y.value, z.value))
    }

    /// A table.
    pub(crate) fn table(&self, report: &mut Report<'_>) -> Option<Table<'t>> {
        match &self.value.kind {
            Kind::Table(entries) => Some(Table { path: self.path.clone(), at: self.at, entries }),
            _ => {
                self.expected("a table", report);
                None
            }
        }
    }

    /// The tables of a list of tables; `header` is how the file writes one.
    pub(crate) fn tables(&self, header: &str, report: &mut Report<'_>) -> Vec<Table<'t>> {
        let Some(items) = self.items() else {
            self.expected(&format!("tables, each begun by {header}"), report);
            return Vec::new();
        };
        items.filter_map(|item| item.table(report)).collect()
    }
}
