//! `[bands]`

use sonel_acoustics::{BandError, BandWidth, Bands};

use crate::document::{Entry, Number, Numbers, Table};
use crate::report::Report;
use crate::suggest::suggest;

/// The bands of a scene. When they could not be read they are the default ones, and lists are not held against them.
pub(crate) struct BandChoice {
    pub(crate) bands: Bands,
    is_certain: bool,
}

impl BandChoice {
    /// Bands known from elsewhere.
    pub(crate) fn certain(bands: Bands) -> Self {
        Self { bands, is_certain: true }
    }
}

/// Reads the section, or takes the default when there is none.
pub(crate) fn read(document: &Table<'_>) -> BandChoice {
    let Some(section) = document.get("bands") else {
        document.report.default("bands: octaves 63 … 8000 Hz (default)");
        return BandChoice { bands: Bands::octaves(), is_certain: true };
    };
    let bands = section.table().and_then(|table| read_table(&table));
    let is_certain = bands.is_some();
    BandChoice { bands: bands.unwrap_or_else(Bands::octaves), is_certain }
}

fn read_table(table: &Table<'_>) -> Option<Bands> {
    table.allow_only(&["center_frequencies_hz", "width"]);
    let width = match table.get("width") {
        Some(entry) => read_width(&entry),
        None => Some(BandWidth::Octave),
    };
    let Some(entry) = table.get("center_frequencies_hz") else {
        return default_of(width?, table.report);
    };
    let centers = entry.numbers()?;
    let nominal: Vec<f64> = centers.readable.iter().map(|center| center.value).collect();
    let width = width?;
    let problems = Bands::problems(&nominal, width);
    let are_thirds =
        || table.get("width").is_none() && Bands::problems(&nominal, BandWidth::Third).is_empty();
    if !problems.is_empty() && are_thirds() {
        return entry.refused("these are third octaves; add width = \"third\"");
    }
    for problem in &problems {
        table.report.problem(place(problem, &entry, &centers.readable), format!("{}: {problem}", entry.path));
    }
    note_uses(&nominal, table.report);
    Bands::new(nominal, width).ok().filter(|_| centers.is_complete)
}

/// What needs octaves of which scenes often lack one [Hz]: the speech transmission index [IEC60268-16], reverberation times of rooms for speech
/// [DIN18041] and the single number of lateral energy [ISO3382-1].
const USES: [(&str, &[f64]); 3] = [
    ("the speech transmission index", &[125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0]),
    ("DIN 18041", &[125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0]),
    ("the single number of LF", &[125.0, 250.0, 500.0, 1000.0]),
];

/// Says before anything is computed what keeps `nominal` bands of all octaves but one from the values of [`USES`]. Third octaves are counted by
/// the middle one.
fn note_uses(nominal: &[f64], report: &Report) {
    for (what, octaves) in USES {
        let missing: Vec<f64> = octaves.iter().copied().filter(|octave| !nominal.contains(octave)).collect();
        if let [one] = missing[..] {
            report.note(format!("bands: {what} needs {one} Hz, too"));
        }
    }
}

fn read_width(entry: &Entry<'_>) -> Option<BandWidth> {
    match entry.text()? {
        "octave" => Some(BandWidth::Octave),
        "third" => Some(BandWidth::Third),
        unknown => {
            let advice = suggest(unknown, ["octave", "third"]);
            entry.refused(&format!("unknown width `{unknown}`; {advice}"))
        }
    }
}

/// The octaves 63 … 8000 Hz, or the third octaves they consist of.
fn default_of(width: BandWidth, report: &Report) -> Option<Bands> {
    report.default(match width {
        BandWidth::Octave => "bands.center_frequencies_hz: octaves 63 … 8000 Hz (default)",
        BandWidth::Third => "bands.center_frequencies_hz: third octaves 50 … 10000 Hz (default)",
    });
    match width {
        BandWidth::Octave => Some(Bands::octaves()),
        BandWidth::Third => {
            let thirds = width.nominal_series().filter(|center| (50.0..=10_000.0).contains(center));
            Bands::new(thirds.collect(), width).ok()
        }
    }
}

fn place(problem: &BandError, entry: &Entry<'_>, centers: &[Number]) -> usize {
    match problem {
        BandError::Empty => entry.at,
        BandError::NotNominal { index, .. } | BandError::NotAscending { index, .. } => centers[*index].at,
    }
}

impl BandChoice {
    /// One number for each band from one number for all or a list of them; always as many as there are bands.
    pub(crate) fn per_band(&self, entry: &Entry<'_>, numbers: &Numbers) -> Vec<f64> {
        let count = self.bands.count();
        let found = numbers.readable.len();
        if entry.is_list() && numbers.is_complete && self.is_certain && found != count {
            entry.problem(&format!("{found} numbers for {count} bands: give one, or one per band"));
        }
        let mut values: Vec<f64> = numbers.readable.iter().map(|number| number.value).collect();
        values.resize(count, values.last().copied().unwrap_or(0.0));
        values
    }
}
