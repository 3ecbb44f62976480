//! Tables and values of a scene document with their full key and, where it was a file, their position.
//!
//! Every reader reports what is wrong with a value and returns `None` for it, so that reading goes on to the next.

use glam::DVec3;

use crate::formats::Open;
use crate::report::Report;
use crate::suggest::suggest;
use crate::value::{Entries, Kind, Value};

pub(crate) use crate::value::{quoted, quoted_key};

/// A table with its full key; the document itself has an empty one.
pub(crate) struct Table<'t> {
    path: String,
    pub(crate) at: usize,
    entries: &'t Entries,
    pub(crate) report: &'t Report,
}

/// A value with its full key.
pub(crate) struct Entry<'t> {
    pub(crate) path: String,
    pub(crate) at: usize,
    value: &'t Value,
    pub(crate) report: &'t Report,
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
    pub(crate) fn document(entries: &'t Entries, report: &'t Report) -> Self {
        Self { path: String::new(), at: 0, entries, report }
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
        Some(self.entry(key, value))
    }

    fn entry(&self, key: &str, value: &'t Value) -> Entry<'t> {
        Entry { path: self.path_of(key), at: value.span.start, value, report: self.report }
    }

    /// The table of a key, if it is there and one.
    pub(crate) fn table(&self, key: &str) -> Option<Table<'t>> {
        self.get(key)?.table()
    }

    /// Keys and values in the order of the file.
    pub(crate) fn in_file_order(&self) -> impl Iterator<Item = (&'t str, Entry<'t>)> {
        self.entries.0.iter().map(|(key, _, value)| (key.as_str(), self.entry(key, value)))
    }

    /// Reports that a key is missing, and what to do.
    pub(crate) fn missing(&self, key: &str, advice: &str) {
        self.report.problem(self.at, format!("{}: missing; {advice}", self.path_of(key)));
    }

    /// Reports every key that is not `known`.
    pub(crate) fn allow_only(&self, known: &[&str]) {
        for (name, at, _) in self.entries.0.iter().take_while(|_| !self.report.is_full()) {
            if !known.contains(&name.as_str()) {
                let advice = suggest(name, known.iter().copied());
                self.report.problem(*at, format!("{}: unknown key; {advice}", self.path_of(name)));
            }
        }
    }
}

impl<'t> Entry<'t> {
    /// Reports `message` about this value.
    pub(crate) fn problem(&self, message: &str) {
        self.report.problem(self.at, format!("{}: {message}", self.path));
    }

    /// Reports `message` about this value, which is of no use then.
    pub(crate) fn refused<T>(&self, message: &str) -> Option<T> {
        self.problem(message);
        None
    }

    fn expected<T>(&self, what: &str) -> Option<T> {
        self.refused(&format!("expected {what}, found {}", self.kind()))
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
            report: self.report,
        }))
    }

    /// A text.
    pub(crate) fn text(&self) -> Option<&'t str> {
        match &self.value.kind {
            Kind::Text(text) => Some(text),
            _ => self.expected("a text in quotes"),
        }
    }

    /// A text with something in it.
    pub(crate) fn filled_text(&self) -> Option<&'t str> {
        let text = self.text()?;
        if text.trim().is_empty() {
            return self.refused("is empty: write a text or leave the key out");
        }
        Some(text)
    }

    /// One text or a list of them, each with its own place.
    pub(crate) fn texts(&self) -> Vec<(&'t str, Entry<'t>)> {
        let entries: Vec<Entry<'t>> = match self.items() {
            Some(items) => items.collect(),
            None => vec![Entry { path: self.path.clone(), ..*self }],
        };
        entries.into_iter().filter_map(|entry: Entry<'t>| Some((entry.filled_text()?, entry))).collect()
    }

    /// The bytes of the file `path` that this value names.
    pub(crate) fn file(&self, path: &str, open: Open<'_>) -> Option<Vec<u8>> {
        let failed = |error| format!("cannot read `{path}`: {error}; the path is relative to the scene file");
        open(path).map_err(|error| self.problem(&failed(error))).ok()
    }

    /// True or false.
    pub(crate) fn flag(&self) -> Option<bool> {
        match self.value.kind {
            Kind::Flag(flag) => Some(flag),
            _ => self.expected("true or false"),
        }
    }

    /// A finite number.
    pub(crate) fn number(&self) -> Option<Number> {
        let Kind::Number(value) = self.value.kind else {
            return self.expected("a number");
        };
        if !value.is_finite() {
            return self.refused(&format!("{value} is not a finite number"));
        }
        Some(Number { value, at: self.at })
    }

    /// A finite number above zero.
    pub(crate) fn positive(&self) -> Option<f64> {
        let number = self.number()?;
        if number.value <= 0.0 {
            return self.refused(&format!("{} is not positive", number.value));
        }
        Some(number.value)
    }

    /// A list of finite numbers.
    pub(crate) fn numbers(&self) -> Option<Numbers> {
        let Some(items) = self.items() else {
            return self.expected("a list of numbers such as [1.0, 2.0]");
        };
        let numbers: Vec<Option<Number>> = items.map(|item| item.number()).collect();
        let is_complete = numbers.iter().all(Option::is_some);
        Some(Numbers { readable: numbers.into_iter().flatten().collect(), is_complete })
    }

    /// One finite number, or a list of them.
    pub(crate) fn number_or_list(&self) -> Option<Numbers> {
        if self.is_list() {
            return self.numbers();
        }
        self.number().map(|number| Numbers { readable: vec![number], is_complete: true })
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
    pub(crate) fn vector(&self) -> Option<DVec3> {
        let Numbers { readable, is_complete: true } = self.numbers()? else { return None };
        let [x, y, z] = readable[..] else {
            return self.refused(&format!("expected three numbers [x, y, z], found {}", readable.len()));
        };
        Some(DVec3::new(x.value, y.value, z.value))
    }

    /// A list of places, each of three finite numbers.
    pub(crate) fn vectors(&self) -> Option<Vec<DVec3>> {
        let Some(items) = self.items() else {
            return self.expected("a list of places such as [[1.0, 2.0, 1.5]]");
        };
        let places: Vec<Option<DVec3>> = items.map(|item| item.vector()).collect();
        places.into_iter().collect()
    }

    /// A table.
    pub(crate) fn table(&self) -> Option<Table<'t>> {
        match &self.value.kind {
            Kind::Table(entries) => {
                Some(Table { path: self.path.clone(), at: self.at, entries, report: self.report })
            }
            _ => self.expected("a table"),
        }
    }

    /// The tables of a list of tables; `header` is how the file writes one.
    pub(crate) fn tables(&self, header: &str) -> Vec<Table<'t>> {
        let Some(items) = self.items() else {
            return self.expected(&format!("tables, each begun by {header}")).unwrap_or_default();
        };
        items.filter_map(|item| item.table()).collect()
    }
}
