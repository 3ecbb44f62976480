//! Pairs corresponding parts of two scenes: sources and materials by name, bands by centre, surfaces by position.

use sonel_geometry::{Geometry, Surface};
use sonel_map::{BandClasses, SonelMap, Spectral};

use super::{ArrivalPlace, Incomparable, Traced};

/// Places where energy arrives, and to which of them every surface of either map contributes.
pub(super) struct Places {
    /// The room first, then materials, then surfaces.
    pub list: Vec<ArrivalPlace>,
    /// Per surface of A and of B.
    pub of: [Vec<PlacesOf>; 2],
}

/// The places that a surface contributes to: the room, its material, itself; the latter two only with a counterpart.
pub(super) type PlacesOf = [Option<u32>; 3];

impl Places {
    /// Pairs the surfaces and materials of `a` and `b`.
    pub(super) fn new(a: &Traced<'_>, b: &Traced<'_>) -> Self {
        let mut places = Self {
            list: vec![ArrivalPlace::Room],
            of: [a, b].map(|side| vec![[Some(0), None, None]; side.geometry.surfaces().len()]),
        };
        places.pair_materials(a, b);
        places.pair_surfaces(a, b);
        places
    }

    fn pair_materials(&mut self, a: &Traced<'_>, b: &Traced<'_>) {
        let others = &b.map.header().scene.materials;
        let materials = a.map.header().scene.materials.iter();
        let common = materials.filter(|material| others.iter().any(|other| other.name == material.name));
        self.list.extend(common.map(|material| ArrivalPlace::Material(material.name.clone())));
        for (side, of) in [a, b].into_iter().zip(&mut self.of) {
            for (surface, places) in side.geometry.surfaces().iter().zip(of) {
                let own = ArrivalPlace::Material(material_of(side.map, surface).to_owned());
                places[1] = self.list.iter().position(|place| *place == own).map(|number| number as u32);
            }
        }
    }

    fn pair_surfaces(&mut self, a: &Traced<'_>, b: &Traced<'_>) {
        for (index, counterpart) in counterparts(a.geometry, b.geometry).into_iter().enumerate() {
            let Some(other) = counterpart else { continue };
            let number = Some(self.list.len() as u32);
            (self.of[0][index][2], self.of[1][other][2]) = (number, number);
            let surface = &a.geometry.surfaces()[index];
            self.list.push(ArrivalPlace::Surface {
                in_a: index as u32,
                in_b: other as u32,
                material: material_of(a.map, surface).to_owned(),
                area: surface.area,
            });
        }
    }
}

fn material_of<'a>(map: &'a SonelMap, surface: &Surface) -> &'a str {
    &map.header().scene.materials[surface.material as usize].name
}

/// For each surface of `a` the one of `b` in the same place, whatever its number and material.
fn counterparts(a: &Geometry, b: &Geometry) -> Vec<Option<usize>> {
    let resolution = f64::from(a.resolution().max(b.resolution()));
    let extent = f64::from(a.extent().max(b.extent()));
    let is_same = |a: &Surface, b: &Surface| {
        a.normal.distance(b.normal) * extent <= resolution
            && (a.offset - b.offset).abs() <= resolution
            && a.centroid.distance(b.centroid) <= resolution
            && (a.area - b.area).abs() <= resolution * extent
    };
    let mut taken = vec![false; b.surfaces().len()];
    let find = |(index, surface): (usize, &Surface)| {
        // Surfaces of equal scenes have equal numbers: that one is tried first.
        let found = std::iter::once(index)
            .chain(0..taken.len())
            .filter(|&other| other < taken.len() && !taken[other])
            .find(|&other| is_same(surface, &b.surfaces()[other]));
        if let Some(other) = found {
            taken[other] = true;
        }
        found
    };
    a.surfaces().iter().enumerate().map(find).collect()
}

/// Bands that both maps have and that nothing tells apart in either: they are compared once.
pub(super) struct BandGroup {
    /// Nominal centres [Hz].
    pub center_frequencies_hz: Vec<f64>,
    /// Index of the first of them in A and in B.
    pub columns: [usize; 2],
}

/// The bands that `a` and `b` have in common.
pub(super) fn band_groups(a: &SonelMap, b: &SonelMap) -> Vec<BandGroup> {
    let (classes_a, classes_b) = (classes(a), classes(b));
    let mut groups: Vec<BandGroup> = Vec::new();
    for (in_a, &center) in a.header().scene.bands.nominal().iter().enumerate() {
        let Some(in_b) = b.header().scene.bands.index_of(center) else { continue };
        let alike = |group: &&mut BandGroup| {
            classes_a.of(group.columns[0]) == classes_a.of(in_a)
                && classes_b.of(group.columns[1]) == classes_b.of(in_b)
        };
        match groups.iter_mut().find(alike) {
            Some(group) => group.center_frequencies_hz.push(center),
            None => {
                groups.push(BandGroup { center_frequencies_hz: vec![center], columns: [in_a, in_b] });
            }
        }
    }
    groups
}

/// Classes of bands by what happens to them at walls; air comes later and does not matter here.
fn classes(map: &SonelMap) -> BandClasses {
    let (scene, spectral): (_, Spectral) = (&map.header().scene, map.header().settings.spectral);
    BandClasses::alike(&scene.materials, &scene.sources, &vec![0.0; scene.bands.count()], spectral)
}

/// Numbers of the sources that have a namesake, in A and in B.
pub(super) fn common_sources(a: &Traced<'_>, b: &Traced<'_>) -> Result<Vec<[u32; 2]>, Incomparable> {
    let (ours, theirs) = (&a.map.header().scene.sources, &b.map.header().scene.sources);
    let common: Vec<[u32; 2]> = ours
        .iter()
        .enumerate()
        .filter_map(|(index, source)| {
            let other = theirs.iter().position(|other| other.name == source.name)?;
            Some([index as u32, other as u32])
        })
        .collect();
    if common.is_empty() {
        return Err(Incomparable::Sources { a: source_names(a), b: source_names(b) });
    }
    Ok(common)
}

fn source_names(side: &Traced<'_>) -> String {
    let sources = &side.map.header().scene.sources;
    sources.iter().map(|source| format!("\"{}\"", source.name)).collect::<Vec<_>>().join(", ")
}

/// Parts that could not be compared, a sentence each.
pub(super) fn unmatched(a: &Traced<'_>, b: &Traced<'_>, places: &Places) -> Vec<String> {
    let mut sentences = Vec::new();
    for (map, of, [side, other]) in [("A", &places.of[0], [a, b]), ("B", &places.of[1], [b, a])] {
        let alone = of.iter().filter(|places| places[2].is_none()).count();
        if alone > 0 {
            sentences.push(format!(
                "{alone} of the {} surfaces of {map} have no counterpart in place and size: compared only \
                 within their materials and the room",
                of.len()
            ));
        }
        let (scene, others) = (&side.map.header().scene, &other.map.header().scene);
        let known = |name: &str| others.materials.iter().any(|material| material.name == name);
        for material in scene.materials.iter().filter(|material| !known(&material.name)) {
            sentences.push(format!("only {map} has material \"{}\"", material.name));
        }
        for source in &scene.sources {
            if !others.sources.iter().any(|other| other.name == source.name) {
                sentences.push(format!("only {map} has source \"{}\": not compared", source.name));
            }
        }
        for center in scene.bands.nominal() {
            if others.bands.index_of(*center).is_none() {
                sentences.push(format!("only {map} has the band at {center} Hz: not compared"));
            }
        }
        if scene.duration > others.duration {
            sentences.push(format!("{map} lasts {} s: compared up to {} s", scene.duration, others.duration));
        }
    }
    sentences
}
