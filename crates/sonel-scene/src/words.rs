//! Words of the names of materials in meshes.

/// Letters of the shortest word with a meaning: `rug`; shorter ones are abbreviations.
const SHORTEST_WORD: usize = 3;
/// Words that mean another.
const SYNONYMS: [(&str, &str); 36] = [
    ("wooden", "wood"),
    ("timber", "wood"),
    ("hardwood", "wood"),
    ("oak", "wood"),
    ("gypsum", "plasterboard"),
    ("drywall", "plasterboard"),
    ("brickwork", "brick"),
    ("masonry", "brick"),
    ("seat", "chair"),
    ("seating", "chair"),
    ("glazing", "glass"),
    ("mirror", "glass"),
    ("steel", "metal"),
    ("lino", "linoleum"),
    ("gras", "grass"),
    ("lawn", "grass"),
    // Purposes are those of DIN 18041, and so are many models.
    ("decke", "ceiling"),
    ("boden", "floor"),
    ("fußboden", "floor"),
    ("fussboden", "floor"),
    ("wand", "wall"),
    ("wände", "wall"),
    ("waende", "wall"),
    ("fenster", "window"),
    ("tür", "door"),
    ("türen", "door"),
    ("teppich", "carpet"),
    ("vorhang", "curtain"),
    ("parkett", "parquet"),
    ("beton", "concrete"),
    ("putz", "plaster"),
    ("gla", "glass"),
    ("ziegel", "brick"),
    ("stuhl", "chair"),
    ("stühle", "chair"),
    ("publikum", "people"),
];
/// Words of letters in lower case and the singular, synonyms as one; a capital after a small letter begins a word.
pub(crate) fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_small = false;
    for letter in name.chars() {
        if !letter.is_alphabetic() || (letter.is_uppercase() && was_small) {
            words.push(String::new());
        }
        was_small = letter.is_lowercase();
        if let Some(word) = words.last_mut().filter(|_| letter.is_alphabetic()) {
            word.extend(letter.to_lowercase());
        }
    }
    words.retain(|word| word.chars().count() >= SHORTEST_WORD);
    words.iter().map(|word| plain(word).to_owned()).collect()
}

/// The singular of a word, or what it means.
fn plain(word: &str) -> &str {
    let singular = word.strip_suffix('s').filter(|stem| !stem.ends_with('s')).unwrap_or(word);
    let meant = SYNONYMS.iter().find(|(synonym, _)| *synonym == word || *synonym == singular);
    meant.map_or(singular, |(_, meant)| meant)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_split_and_singular() {
        assert_eq!(words("MyWalls_02 glassDoors"), ["wall", "glass", "door"]);
        assert_eq!(words("Fußboden Parkett, Glas"), ["floor", "parquet", "glass"]);
    }
}
