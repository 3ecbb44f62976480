//! Intervals in rooms of every kind, with default effects: coverage, half-widths over 1.96 standard deviations of the values, and how far
//! half-widths scatter themselves. Prints the table of docs/accuracy.md.

use sonel::{
    BandWidth, Bands, Material, MaterialKey, Parameter, PolygonMesh, RenderOptions, Scene, SceneBuilder,
    Silent, TraceOptions,
};
use sonel_analysis::parameters;

/// Faces of a mesh in the making.
#[derive(Default)]
struct Drawing {
    vertices: Vec<[f64; 3]>,
    faces: Vec<(usize, &'static str)>,
}

impl Drawing {
    fn face(&mut self, material: &'static str, corners: &[[f64; 3]]) {
        self.vertices.extend(corners);
        self.faces.push((corners.len(), material));
    }

    /// A closed box.
    fn solid(&mut self, material: &'static str, [x0, y0, z0]: [f64; 3], [x1, y1, z1]: [f64; 3]) {
        for [a, b, c, d] in [
            [[x0, y0, z0], [x0, y1, z0], [x1, y1, z0], [x1, y0, z0]],
            [[x0, y0, z1], [x1, y0, z1], [x1, y1, z1], [x0, y1, z1]],
            [[x0, y0, z0], [x1, y0, z0], [x1, y0, z1], [x0, y0, z1]],
            [[x0, y1, z0], [x0, y1, z1], [x1, y1, z1], [x1, y1, z0]],
            [[x0, y0, z0], [x0, y0, z1], [x0, y1, z1], [x0, y1, z0]],
            [[x1, y0, z0], [x1, y1, z0], [x1, y1, z1], [x1, y0, z1]],
        ] {
            self.face(material, &[a, b, c, d]);
        }
    }

    /// Walls over a convex or L-shaped plan, seen from its first corner.
    fn prism(&mut self, plan: &[[f64; 2]], height: f64, [floor, ceiling, walls]: [&'static str; 3]) {
        let at = |i: usize, z: f64| [plan[i % plan.len()][0], plan[i % plan.len()][1], z];
        for i in 1..plan.len() - 1 {
            self.face(floor, &[at(0, 0.0), at(i, 0.0), at(i + 1, 0.0)]);
            self.face(ceiling, &[at(0, height), at(i + 1, height), at(i, height)]);
        }
        for i in 0..plan.len() {
            self.face(walls, &[at(i, 0.0), at(i, height), at(i + 1, height), at(i + 1, 0.0)]);
        }
    }

    fn scene(self) -> SceneBuilder {
        let mut mesh = PolygonMesh::new(self.vertices);
        let mut first = 0;
        for (count, material) in self.faces {
            let corners: Vec<u32> = (first..first + count as u32).collect();
            mesh.face(&corners, material);
            first += count as u32;
        }
        Scene::of_polygons(mesh)
    }
}

fn wall(absorption: f64, scattering: f64) -> Material {
    Material::new(absorption).with(MaterialKey::Scattering, scattering)
}

/// Two rooms of 6 x 5 x 3 m, joined by an opening of that width from y = 2 m and that height.
fn joined(width: f64, height: f64) -> SceneBuilder {
    let mut drawing = Drawing::default();
    for (name, x0, x1) in [("dry", 0.0, 6.0), ("live", 6.0, 12.0)] {
        drawing.face(name, &[[x0, 0.0, 0.0], [x0, 5.0, 0.0], [x1, 5.0, 0.0], [x1, 0.0, 0.0]]);
        drawing.face(name, &[[x0, 0.0, 3.0], [x1, 0.0, 3.0], [x1, 5.0, 3.0], [x0, 5.0, 3.0]]);
        drawing.face(name, &[[x0, 0.0, 0.0], [x1, 0.0, 0.0], [x1, 0.0, 3.0], [x0, 0.0, 3.0]]);
        drawing.face(name, &[[x0, 5.0, 0.0], [x0, 5.0, 3.0], [x1, 5.0, 3.0], [x1, 5.0, 0.0]]);
    }
    drawing.face("dry", &[[0.0, 0.0, 0.0], [0.0, 0.0, 3.0], [0.0, 5.0, 3.0], [0.0, 5.0, 0.0]]);
    drawing.face("live", &[[12.0, 0.0, 0.0], [12.0, 5.0, 0.0], [12.0, 5.0, 3.0], [12.0, 0.0, 3.0]]);
    let end = 2.0 + width;
    drawing.face("dry", &[[6.0, 0.0, 0.0], [6.0, 2.0, 0.0], [6.0, 2.0, 3.0], [6.0, 0.0, 3.0]]);
    drawing.face("dry", &[[6.0, end, 0.0], [6.0, 5.0, 0.0], [6.0, 5.0, 3.0], [6.0, end, 3.0]]);
    drawing.face("dry", &[[6.0, 2.0, height], [6.0, end, height], [6.0, end, 3.0], [6.0, 2.0, 3.0]]);
    drawing
        .scene()
        .material("dry", wall(0.15, 0.4))
        .material("live", wall(0.06, 0.3))
        .source("source", [2.0, 1.5, 1.5])
        .receiver("here", [4.0, 3.6, 1.2])
        .receiver("there", [9.0, 3.4, 1.2])
}

fn room(size: [f64; 3], absorption: f64, scattering: f64) -> SceneBuilder {
    let at = |x: f64, y: f64, z: f64| [x * size[0], y * size[1], z * size[2]];
    Scene::shoebox(size)
        .material("walls", wall(absorption, scattering))
        .source("source", at(0.23, 0.31, 0.45))
        .receiver("a", at(0.71, 0.42, 0.37))
        .receiver("b", at(0.38, 0.78, 0.52))
}

/// A classroom with four tables of one sheet each.
fn desks() -> SceneBuilder {
    let mut drawing = Drawing::default();
    drawing.solid("walls", [0.0, 0.0, 0.0], [9.0, 7.0, 3.0]);
    for (x, y) in [(2.0, 1.0), (2.0, 4.0), (5.0, 1.0), (5.0, 4.0)] {
        let corners = [[x, y], [x + 1.0, y], [x + 1.0, y + 1.8], [x, y + 1.8]];
        drawing.face("desk", &corners.map(|[x, y]| [x, y, 0.72]));
    }
    let scene = drawing.scene().material("walls", wall(0.1, 0.2)).material("desk", wall(0.08, 0.1));
    scene.source("source", [1.0, 3.5, 1.5]).receiver("a", [5.5, 2.0, 1.2]).receiver("b", [8.0, 6.0, 0.5])
}

/// An office with a cupboard, a desk and a screen under a ceiling of tiles.
fn office() -> SceneBuilder {
    let mut drawing = Drawing::default();
    drawing.prism(&[[0.0, 0.0], [8.0, 0.0], [8.0, 6.0], [0.0, 6.0]], 2.8, ["carpet", "tiles", "walls"]);
    drawing.solid("wood", [1.0, 0.5, 0.001], [1.5, 2.5, 1.9]);
    drawing.solid("wood", [4.0, 4.0, 0.001], [5.6, 4.8, 0.74]);
    drawing.solid("wood", [6.0, 1.0, 0.001], [6.1, 3.0, 1.5]);
    let materials = [("walls", 0.08, 0.1), ("carpet", 0.3, 0.2), ("tiles", 0.7, 0.1), ("wood", 0.1, 0.1)];
    let scene = materials.into_iter().fold(drawing.scene(), |scene, (name, absorption, scattering)| {
        scene.material(name, wall(absorption, scattering))
    });
    scene.source("source", [2.2, 2.0, 1.2]).receiver("a", [7.0, 2.0, 1.2]).receiver("b", [4.5, 3.2, 1.2])
}

/// A corridor with a bend.
fn corridor() -> SceneBuilder {
    let plan = [[2.0, 2.0], [2.0, 15.0], [0.0, 15.0], [0.0, 0.0], [20.0, 0.0], [20.0, 2.0]];
    let mut drawing = Drawing::default();
    drawing.prism(&plan, 2.6, ["floor", "ceiling", "walls"]);
    let scene = drawing.scene().material("floor", wall(0.1, 0.1)).material("ceiling", wall(0.3, 0.1));
    let scene = scene.material("walls", wall(0.05, 0.1)).source("source", [18.0, 1.0, 1.5]);
    scene.receiver("a", [8.0, 1.1, 1.3]).receiver("b", [0.9, 12.0, 1.2])
}

/// A barrel vault of radius 4 m on walls of 3 m, which focuses.
fn vault() -> SceneBuilder {
    const PIECES: u32 = 12;
    let arc = (0..=PIECES).map(|piece| {
        let (sine, cosine) = (std::f64::consts::PI * f64::from(piece) / f64::from(PIECES)).sin_cos();
        [4.0 * cosine, 3.0 + 4.0 * sine]
    });
    let profile: Vec<[f64; 2]> = std::iter::once([4.0, 0.0]).chain(arc).chain([[-4.0, 0.0]]).collect();
    let mut drawing = Drawing::default();
    for x in [0.0, 14.0] {
        let corners: Vec<[f64; 3]> = profile.iter().map(|&[y, z]| [x, y, z]).collect();
        drawing.face("walls", &corners);
    }
    for (i, &[y0, z0]) in profile.iter().enumerate() {
        let [y1, z1] = profile[(i + 1) % profile.len()];
        let name = if z0 + z1 <= 0.0 { "floor" } else { "walls" };
        drawing.face(name, &[[0.0, y0, z0], [14.0, y0, z0], [14.0, y1, z1], [0.0, y1, z1]]);
    }
    let scene = drawing.scene().material("floor", wall(0.2, 0.2)).material("walls", wall(0.08, 0.08));
    scene.source("source", [3.0, 0.5, 1.5]).receiver("a", [9.0, -0.4, 2.8]).receiver("b", [11.0, 2.0, 1.2])
}

/// Two rooms with a partition of 20 dB.
fn partition() -> SceneBuilder {
    let mut drawing = Drawing::default();
    drawing.solid("walls", [0.0, 0.0, 0.0], [10.0, 5.0, 3.0]);
    drawing.face("partition", &[[5.0, 0.0, 0.0], [5.0, 5.0, 0.0], [5.0, 5.0, 3.0], [5.0, 0.0, 3.0]]);
    let partition = wall(0.1, 0.3).with(MaterialKey::Transmission, 0.01);
    let scene = drawing.scene().material("walls", wall(0.1, 0.3)).material("partition", partition);
    let scene = scene.source("source", [1.3, 2.1, 1.2]);
    scene.receiver("here", [3.5, 3.6, 1.2]).receiver("there", [7.4, 3.4, 1.2])
}

/// A street between two buildings.
fn street() -> SceneBuilder {
    let ground = [[-40.0, -30.0, 0.0], [40.0, -30.0, 0.0], [40.0, 30.0, 0.0], [-40.0, 30.0, 0.0]];
    let mut drawing = Drawing::default();
    drawing.face("ground", &ground);
    drawing.solid("facade", [-20.0, 8.0, 0.0], [20.0, 18.0, 9.0]);
    drawing.solid("facade", [-20.0, -18.0, 0.0], [5.0, -8.0, 6.0]);
    let scene = drawing.scene().material("ground", wall(0.1, 0.2)).material("facade", wall(0.1, 0.3));
    let scene = scene.duration(1.0).source("source", [-5.0, 0.0, 1.5]);
    scene.receiver("a", [10.0, 3.0, 1.5]).receiver("b", [12.0, -12.0, 1.5])
}

/// Rooms with their packets: as many as a run of about a second takes.
fn rooms() -> Vec<(&'static str, SceneBuilder, u64)> {
    let treated =
        room([9.0, 7.0, 3.0], 0.05, 0.1).material("z1", wall(0.9, 0.1)).material("z0", wall(0.1, 0.1));
    let hard = || wall(0.03, 0.02);
    let flutter = room([7.0, 5.0, 3.0], 0.6, 0.5).material("x0", hard()).material("x1", hard());
    vec![
        ("even box", room([10.0, 7.0, 3.0], 0.2, 0.5), 2048),
        ("dead box", room([6.0, 5.0, 3.0], 0.6, 0.3), 4096),
        ("live box", room([6.0, 5.0, 3.0], 0.04, 0.3), 1024),
        ("smooth box", room([7.0, 5.0, 3.2], 0.15, 0.05), 4096),
        ("0.5 × 0.4 × 0.3 m", room([0.5, 0.4, 0.3], 0.1, 0.2), 2048),
        ("150 × 90 × 30 m", room([150.0, 90.0, 30.0], 0.25, 0.3), 2048),
        ("absorbing ceiling", treated, 16_384),
        ("flutter", flutter, 16_384),
        ("tables", desks(), 2048),
        ("office", office(), 2048),
        ("corridor, bend", corridor(), 4096),
        ("barrel vault", vault(), 2048),
        ("rooms, door", joined(1.0, 2.0), 4096),
        ("rooms, gap", joined(0.1, 1.0), 4096),
        ("rooms, partition", partition(), 2048),
        ("street", street(), 4096),
    ]
}

const SEEDS: u64 = 12;
const READ: [Parameter; 9] = [
    Parameter::Level,
    Parameter::EarlyDecayTime,
    Parameter::T20,
    Parameter::T30,
    Parameter::ClarityC80,
    Parameter::DefinitionD50,
    Parameter::CenterTime,
    Parameter::LateralFraction,
    Parameter::LateLateralLevel,
];

/// Value and interval.
type Found = (f64, [f64; 2]);

/// What the intervals of one parameter are, over receivers and seeds.
#[derive(Clone, Copy, Default)]
struct Row {
    given: f64,
    covered: f64,
    /// Sums over `places`: mean half-width over 1.96 standard deviations of the values, and relative standard deviation of the half-widths.
    ratio: f64,
    scatter: f64,
    places: f64,
}

impl Row {
    /// Of the runs at one place, had intervals been `scale` times as wide.
    fn of(runs: &[Found], scale: f64) -> Self {
        let count = runs.len() as f64;
        let moments = |of: &dyn Fn(&Found) -> f64| {
            let mean = runs.iter().map(of).sum::<f64>() / count;
            (mean, (runs.iter().map(|run| (of(run) - mean).powi(2)).sum::<f64>() / (count - 1.0)).sqrt())
        };
        let (truth, spread) = moments(&|run| run.0);
        let (width, scatter) = moments(&|(_, [low, high])| 0.5 * scale * (high - low));
        let holds = |(value, [low, high]): &&Found| {
            (value + scale * (low - value)..=value + scale * (high - value)).contains(&truth)
        };
        let covered = runs.iter().filter(holds).count() as f64;
        // The mean reciprocal of a standard deviation of n normal values is larger by about 3/(4(n − 1)) than that of all.
        let ratio = width / (1.96 * spread) * (1.0 - 0.75 / (count - 1.0));
        Self { given: count, covered, ratio, scatter: scatter / width, places: 1.0 }
    }

    fn with(self, other: Self) -> Self {
        Self {
            given: self.given + other.given,
            covered: self.covered + other.covered,
            ratio: self.ratio + other.ratio,
            scatter: self.scatter + other.scatter,
            places: self.places + other.places,
        }
    }

    /// Coverage, width ratio and scatter of the widths.
    fn means(self) -> [f64; 3] {
        [self.covered / self.given, self.ratio / self.places, self.scatter / self.places]
    }
}

/// Runs of `scene` with `packets`, by parameter and receiver.
fn runs(scene: &Scene, packets: u64) -> Vec<[Vec<Found>; 2]> {
    let mut found = vec![[Vec::new(), Vec::new()]; READ.len()];
    for seed in 1..=SEEDS {
        let trace = TraceOptions { packets: Some(packets), seed: Some(seed), ..TraceOptions::default() };
        let map = scene.trace(&trace, &Silent).expect("a map").map;
        let render = RenderOptions { directions: true, ..RenderOptions::default() };
        let rendered = map.render(&[], &render, &Silent).expect("a response");
        for (r, row) in parameters(rendered.response.echograms()).iter().enumerate() {
            for (found, parameter) in found.iter_mut().zip(READ) {
                let estimate = row.bands[0].parameter(parameter).as_ref().ok();
                let interval =
                    estimate.and_then(|estimate| Some((estimate.value, *estimate.interval.as_ref().ok()?)));
                found[r].extend(interval);
            }
        }
    }
    found
}

/// Places with fewer values than this part of the seeds are not counted: the parameter is refused there.
const LEAST_GIVEN: f64 = 0.9;

#[test]
fn intervals_are_as_wide_as_the_spread_in_rooms_of_every_kind() {
    let scales = [1.0, 1.5, 0.7];
    let mut all = [[Row::default(); READ.len()]; 3];
    for (name, builder, packets) in rooms() {
        let bands = Bands::new(vec![1000.0], BandWidth::Octave).expect("an octave");
        let scene = builder.bands(&bands).build(&Silent).expect("a scene");
        let mut cells = Vec::new();
        for (index, places) in runs(&scene, packets).iter().enumerate() {
            let counted = || places.iter().filter(|runs| runs.len() as f64 > LEAST_GIVEN * SEEDS as f64);
            let row = |scale| counted().fold(Row::default(), |sum, runs| sum.with(Row::of(runs, scale)));
            for (all, scale) in all.iter_mut().zip(scales) {
                all[index] = all[index].with(row(scale));
            }
            let [coverage, ratio, _] = row(1.0).means();
            cells.push(format!("{coverage:.2}, {ratio:.2}"));
        }
        println!("| {name} | {packets} | {} |", cells.join(" | "));
    }
    let means = all.map(|rows| rows.map(Row::means));
    let text = means[0].map(|[coverage, ratio, scatter]| format!("{coverage:.3}, {ratio:.2}, {scatter:.2}"));
    println!("| all | | {} |", text.join(" | "));
    // Of 384 intervals 0.95 ± 0.037 hold the truth in 999 of 1000 campaigns, and the mean ratio is off by up to 0.1: ratios of 0.95 … 1.2 are
    // right.
    let holds = |[coverage, ..]: &[f64; 3]| (0.913..=0.987).contains(coverage);
    let is_sharp = |[_, ratio, _]: &[f64; 3]| (0.85..=1.3).contains(ratio);
    for (parameter, found) in READ.iter().zip(&means[0]) {
        // Levels include what edges that are left out may bring.
        let is_right = *parameter == Parameter::Level || (holds(found) && is_sharp(found));
        assert!(is_right && found[0] > 0.913, "{parameter:?}: {found:?}");
    }
    // Known-wrong: intervals wider by one half, as those of T30 were, and narrower by three tenths.
    assert!(!means[1].iter().any(is_sharp) && !means[2].iter().any(holds), "{means:?}");
}
