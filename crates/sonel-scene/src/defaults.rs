//! Defaults that a scene takes, in one line.

/// Values of one key.
struct Taken<'n> {
    key: &'n str,
    values: Vec<&'n str>,
}

/// The notes about defaults and entries of libraries in one line: values that are equal once, with their number. None where there is no note.
#[must_use]
pub fn folded<'n>(notes: impl IntoIterator<Item = &'n str>) -> Option<String> {
    let mut taken: Vec<Taken<'n>> = Vec::new();
    for note in notes {
        let (path, value) = note.split_once(": ").unwrap_or((note, ""));
        // `sources[1].name` is `name`, `materials.a.library[2]` is `library`; names of materials may have dots and brackets.
        let key = path.rsplit('.').next().unwrap_or(path);
        let key = key.split('[').next().unwrap_or(key);
        let value = value.split(" (default").next().unwrap_or(value);
        match taken.iter_mut().find(|taken| taken.key == key) {
            Some(taken) => taken.values.push(value),
            None => taken.push(Taken { key, values: vec![value] }),
        }
    }
    let parts: Vec<String> = taken.iter().map(Taken::text).collect();
    (!parts.is_empty()).then(|| format!("defaults: {}", parts.join("; ")))
}

impl Taken<'_> {
    fn text(&self) -> String {
        let Self { key, values } = self;
        let count = values.len();
        if *key == "library" {
            let held = values.iter().filter(|value| value.contains("held constant")).count();
            let held = if held > 0 { ", bands that they lack as the nearest" } else { "" };
            return format!("{count} × library{held}");
        }
        match &values[..] {
            [value] => format!("{key} {value}"),
            [first, rest @ ..] if rest.iter().all(|value| value == first) => {
                format!("{key} {first} ({count} ×)")
            }
            _ => format!("{count} × {key}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_values_are_said_once() {
        let notes = [
            "air: 20 °C, 50 %, 101.325 kPa (default)",
            "materials.a.scattering: 0.1 (default)",
            "materials.\"b.c\".scattering: 0.1 (default)",
            "sources[1].name: \"source 1\" (default)",
            "receivers[1].name: \"receiver 1\" (default)",
            "materials.a.library[2]: library `x`, held constant at 63 Hz",
            "duration_s: at least 1.34 (default: 1.2 times the largest Sabine time)",
        ];
        assert_eq!(
            folded(notes).unwrap(),
            "defaults: air 20 °C, 50 %, 101.325 kPa; scattering 0.1 (2 ×); 2 × name; \
             1 × library, bands that they lack as the nearest; duration_s at least 1.34"
        );
        assert_eq!(folded([]), None);
    }
}
