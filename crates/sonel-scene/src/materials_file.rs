//! Materials as the text that [`crate::load_materials`] reads.

use std::fmt::Write;

use sonel_acoustics::{AbsorptionLaw, Material};

use crate::document::{quoted, quoted_key};

/// A table for each of `materials`, after `head`, lines of a comment.
#[must_use]
pub fn materials_toml(materials: &[Material], head: &str) -> String {
    let mut text: String = head.lines().map(|line| format!("# {line}\n")).collect();
    for material in materials {
        let Material { name, absorption, scattering, transmission, law, source } = material;
        let _ = write!(
            text,
            "\n[materials.{}]\nabsorption = {absorption:?}\nscattering = {scattering:?}\n",
            quoted_key(name)
        );
        if material.transmits() {
            let _ = writeln!(text, "transmission = {transmission:?}");
        }
        if *law != AbsorptionLaw::Uniform {
            let _ = writeln!(text, "absorption_law = \"{law}\"");
        }
        if let Some(source) = source {
            let _ = writeln!(text, "source = {}", quoted(source));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_acoustics::Bands;

    #[test]
    fn what_is_written_is_read_again() {
        let mut wall = Material::uniform("wall \"north\" no. 1", 0.1, 1.0, 8);
        wall.absorption[3] = 0.123_456_789;
        wall.transmission[2] = 1e-5;
        wall.source = Some("a \\ table".to_owned());
        let mut floor = Material::uniform("floor", 0.0, 0.05, 8);
        floor.law = AbsorptionLaw::LocallyReacting;
        let text = materials_toml(&[wall.clone(), floor.clone()], "two\nlines");
        let read = crate::load_materials(&text, "materials.toml", &Bands::octaves()).unwrap();
        assert_eq!(read, [wall, floor]);
    }
}
