//! Polygons of an AC3D file, the format in which BRAS rooms are published for simulation.
//!
//! A file lists materials and objects; an object has vertices and surfaces that name them by number. Textures, colours and
//! groups do not matter here. Objects that are moved or turned (`loc`, `rot`) and surfaces that are lines are refused.
//!
//! Format: AC3D file format, version "b" (<https://www.inivis.com/ac3d/man/ac3dfileformat.html>).

use std::iter::Enumerate;
use std::str::{FromStr, Lines};

use anyhow::{Context, Result, bail, ensure};
use glam::DVec3;

use super::room::Face;

/// The polygons of `text` with the names of their materials.
pub(super) fn faces(text: &str) -> Result<Vec<Face>> {
    let mut file = File { lines: text.lines().enumerate(), line: 0 };
    let head = file.next_line().unwrap_or_default();
    ensure!(head.starts_with("AC3D"), "line 1: an AC3D file begins with AC3D, this one with {head:?}");
    let (mut materials, mut vertices, mut material, mut faces) = (vec![], vec![], String::new(), vec![]);
    while let Some(line) = file.next_line() {
        let (key, value) = line.split_once(' ').unwrap_or((line, ""));
        match key {
            "MATERIAL" => {
                materials.push(value.split('"').nth(1).with_context(|| file.at("no name"))?.to_owned());
            }
            "loc" | "rot" => bail!(file.at("the object is moved or turned, which is not read")),
            "numvert" => vertices = file.vertices(value)?,
            "SURF" => {
                let is_polygon = value.trim().ends_with('0');
                ensure!(is_polygon, file.at("the surface is a line, not a polygon"));
            }
            "mat" => {
                let number: usize = file.number(value)?;
                material = materials.get(number).with_context(|| file.at("no such material"))?.clone();
            }
            "refs" => {
                faces.push(Face { material: material.clone(), corners: file.corners(value, &vertices)? });
            }
            _ => {}
        }
    }
    Ok(faces)
}

/// Lines that are left, and the number of the last one read.
struct File<'text> {
    lines: Enumerate<Lines<'text>>,
    line: usize,
}

impl<'text> File<'text> {
    fn next_line(&mut self) -> Option<&'text str> {
        let (index, line) = self.lines.next()?;
        self.line = index + 1;
        Some(line.trim())
    }

    fn at(&self, problem: &str) -> String {
        format!("line {}: {problem}", self.line)
    }

    fn number<T: FromStr>(&self, word: &str) -> Result<T> {
        word.trim()
            .parse()
            .ok()
            .with_context(|| self.at(&format!("{word:?} is not a number of the kind needed")))
    }

    /// The next `count` lines, the first words of each as numbers.
    fn rows<T: FromStr>(&mut self, count: &str, words: usize) -> Result<Vec<Vec<T>>> {
        let count: usize = self.number(count)?;
        let mut rows = Vec::new();
        for _ in 0..count {
            let line = self.next_line().context("the file ends within a list")?;
            let row: Vec<T> =
                line.split_whitespace().take(words).map(|word| self.number(word)).collect::<Result<_>>()?;
            ensure!(row.len() == words, self.at(&format!("{words} numbers are needed")));
            rows.push(row);
        }
        Ok(rows)
    }

    fn vertices(&mut self, count: &str) -> Result<Vec<DVec3>> {
        Ok(self.rows(count, 3)?.iter().map(|row| DVec3::from_slice(row)).collect())
    }

    fn corners(&mut self, count: &str, vertices: &[DVec3]) -> Result<Vec<DVec3>> {
        let indices: Vec<Vec<usize>> = self.rows(count, 1)?;
        let corner =
            |row: &Vec<usize>| vertices.get(row[0]).copied().with_context(|| self.at("no such vertex"));
        indices.iter().map(corner).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TENT: &str = r#"AC3Db
MATERIAL "canvas" rgb 1 1 1 amb 0 0 0 emis 0 0 0 spec 0 0 0 shi 32 trans 0
MATERIAL "wet grass" rgb 0 1 0 amb 0 0 0 emis 0 0 0 spec 0 0 0 shi 32 trans 0
OBJECT world
kids 2
OBJECT poly
name "roof"
texture "mat with a space.jpg"
numvert 3
0 0 0
1 0 0.5
0 2 0
numsurf 1
SURF 0x10
mat 0
refs 3
2 0 0
1 0.5 0.5
0 1 1
kids 0
OBJECT poly
numvert 4
0 0 0
1 0 0
1 0 1
0 0 1
numsurf 1
SURF 0x20
mat 1
refs 4
0 0 0
1 0 0
2 0 0
3 0 0
kids 0
"#;

    #[test]
    fn polygons_have_the_vertices_of_their_object_and_the_name_of_their_material() {
        let faces = faces(TENT).unwrap();
        assert_eq!(faces.len(), 2);
        assert_eq!(faces[0].material, "canvas");
        assert_eq!(faces[0].corners, [DVec3::new(0.0, 2.0, 0.0), DVec3::new(1.0, 0.0, 0.5), DVec3::ZERO]);
        assert_eq!((faces[1].material.as_str(), faces[1].corners.len()), ("wet grass", 4));
        assert_eq!(faces[1].corners[2], DVec3::new(1.0, 0.0, 1.0));
    }

    #[test]
    fn what_is_not_read_is_an_error_with_its_line() {
        let message = |text: &str| faces(text).unwrap_err().to_string();
        assert!(message("solid").starts_with("line 1: "));
        assert!(message(&TENT.replace("name \"roof\"", "loc 0 1 0")).starts_with("line 7: "));
        assert!(message(&TENT.replace("SURF 0x10", "SURF 0x12")).starts_with("line 14: "));
        assert!(message(&TENT.replace("mat 1", "mat 2")).starts_with("line 29: "));
        assert!(message(&TENT.replace("2 0 0\n1 0.5", "3 0 0\n1 0.5")).contains("no such vertex"));
        assert!(message(&TENT.replace("1 0 0.5", "1 0")).starts_with("line 11: "));
    }
}
