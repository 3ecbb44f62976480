//! The known name nearest to an unknown one.

/// Ends a message about an unknown name: the nearest known one, or all of them when none is near.
pub(crate) fn suggest<'a>(unknown: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let near = known
        .iter()
        .map(|name| (distance(&unknown.to_lowercase(), &name.to_lowercase()), *name))
        .filter(|(distance, name)| *distance <= allowed(name))
        .min();
    match near {
        Some((_, name)) => format!("did you mean `{name}`?"),
        None if known.is_empty() => "none is known here".to_owned(),
        None => format!("known: {}", known.join(", ")),
    }
}

/// A third of a name may be mistyped.
fn allowed(name: &str) -> usize {
    (name.chars().count() / 3).max(1)
}

/// Edit distance of two words: insertions, deletions and replacements [Levenshtein1966].
fn distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = std::mem::replace(&mut row[0], i + 1);
        for (j, to) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(from != *to);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_counts_of_edits() {
        assert_eq!(distance("kitten", "sitting"), 3);
        assert_eq!(distance("", "abc"), 3);
        assert_eq!(distance("abc", ""), 3);
        assert_eq!(distance("same", "same"), 0);
    }

    #[test]
    fn near_names_are_suggested_and_far_ones_listed() {
        let known = ["absorption", "scattering"];
        assert_eq!(suggest("Absorbtion", known), "did you mean `absorption`?");
        assert_eq!(suggest("colour", known), "known: absorption, scattering");
        assert_eq!(suggest("colour", []), "none is known here");
    }
}
