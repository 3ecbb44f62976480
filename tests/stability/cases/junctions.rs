//! Junctions: paths that meet an edge, a corner or the foot of a partition exactly, as round coordinates make them do.

use std::collections::BTreeMap;

use glam::{DVec3, dvec3};
use sonel_acoustics::{BandWidth, Bands, Material};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::{Estimator, ReceiverPoint, RenderSettings};
use sonel_scene::Scene;
use sonel_testkit::uniform::Uniform;
use sonel_tests::{Traced, meshes};

use super::form;

const ESTIMATORS: [Estimator; 4] =
    [Estimator::Auto, Estimator::Gather, Estimator::Connection, Estimator::Sphere];

/// A box with its corner in the origin and a sealed partition in a plane x = `partition`, both on the integer grid.
#[derive(Debug, Clone, Copy)]
struct TwoRooms {
    size: [u32; 3],
    partition: u32,
    /// Whether walls end at the partition and share its vertices; else the partition just crosses the box.
    shared: bool,
}

impl TwoRooms {
    fn random(random: &mut Uniform) -> Self {
        let mut between = |low: u32, high: u32| low + random.below((high - low + 1) as usize) as u32;
        let size = [between(4, 12), between(3, 9), between(2, 5)];
        Self { size, partition: between(2, size[0] - 2), shared: between(0, 1) == 1 }
    }

    fn mesh(&self) -> Mesh {
        let [x, y, z] = self.size.map(f64::from);
        let at = f64::from(self.partition);
        if !self.shared {
            let mut mesh = Mesh::shoebox([x, y, z], [0; 6]);
            add_partition(&mut mesh, at, [y, z]);
            return mesh;
        }
        let mut mesh = Mesh::default();
        for [low, high] in [[0.0, at], [at, x]] {
            for height in [0.0, z] {
                let corner = |x, y| dvec3(x, y, height);
                meshes::add_quad(
                    &mut mesh,
                    0,
                    [corner(low, 0.0), corner(high, 0.0), corner(high, y), corner(low, y)],
                );
            }
            for side in [0.0, y] {
                let corner = |x, z| dvec3(x, side, z);
                meshes::add_quad(
                    &mut mesh,
                    0,
                    [corner(low, 0.0), corner(high, 0.0), corner(high, z), corner(low, z)],
                );
            }
        }
        [0.0, at, x].into_iter().for_each(|wall| add_partition(&mut mesh, wall, [y, z]));
        mesh
    }

    /// A place on the grid of half metres, before the partition or behind it.
    fn place(&self, random: &mut Uniform, behind: bool) -> DVec3 {
        let mut inside = |low: u32, high: u32| {
            f64::from(low) + 0.5 * (1 + random.below((2 * (high - low) - 1) as usize)) as f64
        };
        let along = if behind { [self.partition, self.size[0]] } else { [0, self.partition] };
        dvec3(inside(along[0], along[1]), inside(0, self.size[1]), inside(0, self.size[2]))
    }
}

fn add_partition(mesh: &mut Mesh, x: f64, [y, z]: [f64; 2]) {
    let corner = |y, z| dvec3(x, y, z);
    meshes::add_quad(mesh, 0, [corner(0.0, 0.0), corner(y, 0.0), corner(y, z), corner(0.0, z)]);
}

fn scene(mesh: Mesh, source: DVec3) -> Scene {
    let bands = Bands::new(vec![1000.0], BandWidth::Octave).expect("an octave");
    Scene::from_parts(mesh, vec![Material::uniform("walls", 0.2, 0.4, 1)], bands, 0.05)
        .with_source("source", source.to_array())
        .without_air_attenuation()
}

/// Fluence at each of `places` [1/m²].
fn fluences(traced: &Traced, places: &[DVec3], estimator: Estimator) -> Vec<f64> {
    let mirror_order = Some(form(3, 4));
    let settings = RenderSettings { estimator, rays: Some(32), mirror_order, ..RenderSettings::default() };
    let renderer = traced.renderer(settings);
    let named = |(index, &position): (usize, &DVec3)| ReceiverPoint::omni(&index.to_string(), position);
    let receivers: Vec<ReceiverPoint> = places.iter().enumerate().map(named).collect();
    let borders = vec![vec![0.0, 0.05]; places.len()];
    let rendering = renderer.render(0, &receivers, &borders).expect("sound receivers");
    let bins = renderer.bins().edges().len() - 1;
    (0..places.len()).map(|place| sonel_tests::fluence(&rendering, bins, place, 0)).collect()
}

/// No sound passes a sealed partition: not one joule at any place, by any estimator, with edges or without, whether the
/// walls share vertices with the partition or are crossed by it.
#[test]
fn nothing_passes_a_sealed_partition() {
    let mut random = Uniform::new(23);
    for room in 0..form(8, 500) {
        let rooms = TwoRooms::random(&mut random);
        let source = rooms.place(&mut random, false);
        let settings = Settings { emissions: form(32, 256), ..Settings::default() };
        let scene = scene(rooms.mesh(), source);
        let traced =
            if room % 2 == 0 { Traced::new(scene, settings) } else { Traced::diffracting(scene, settings) };
        let mut places: Vec<DVec3> = (0..form(8, 50)).map(|_| rooms.place(&mut random, true)).collect();
        places.push(source.with_x(2.0 * f64::from(rooms.partition) - source.x));
        places.retain(|place| place.x < f64::from(rooms.size[0]));
        let own = rooms.place(&mut random, false);
        if own != source {
            places.push(own);
        }
        // All estimators in turn, two of them in each room.
        for estimator in ESTIMATORS.into_iter().skip(room / 2 % 2).step_by(2) {
            for (place, fluence) in places.iter().zip(fluences(&traced, &places, estimator)) {
                let behind = place.x > f64::from(rooms.partition);
                assert!(
                    (fluence == 0.0) == behind,
                    "{rooms:?}, {source} to {place}, {estimator:?}: {fluence:e}"
                );
            }
        }
    }
}

/// What reaches `place` [1/m²] from each image of the source without edges, by the place of the image [µm].
fn images(traced: &Traced, place: DVec3) -> BTreeMap<[i64; 3], f64> {
    let settings =
        RenderSettings { rays: Some(64), mirror_order: Some(3), edges: false, ..RenderSettings::default() };
    let renderer = traced.renderer(settings);
    let receiver = ReceiverPoint::omni("here", place);
    let rendering = renderer.render(0, &[receiver], &[vec![0.0, 0.05]]).expect("a sound receiver");
    let mut images = BTreeMap::new();
    for arrival in &rendering.arrivals {
        let image = place + DVec3::from(arrival.towards) * arrival.length;
        *images.entry((image * 1e6).round().to_array().map(|x| x as i64)).or_insert(0.0) += arrival.energy[0];
    }
    images
}

/// Where source and receiver are in line with edges and corners of the room, what is mirrored there arrives, and once: all
/// images are those of a tenth of a millimetre beside.
#[test]
fn nothing_is_lost_or_doubled_in_line_with_a_corner() {
    let mut mesh = Mesh::shoebox([6.0, 5.0, 4.0], [0; 6]);
    // Something small far off, so that images are validated one by one.
    meshes::add_box(&mut mesh, 0, dvec3(5.31, 0.62, 3.47), dvec3(5.36, 0.69, 3.53));
    let source = dvec3(1.0, 1.0, 1.0);
    let traced = Traced::new(scene(mesh, source), Settings { emissions: 64, ..Settings::default() });
    for place in [dvec3(2.0, 2.0, 2.0), dvec3(2.0, 2.0, 1.0), dvec3(3.0, 3.0, 3.0), dvec3(2.0, 1.0, 2.0)] {
        let here = images(&traced, place);
        let beside = images(&traced, place + dvec3(1e-4, -2e-4, 1.5e-4));
        assert!(here.keys().eq(beside.keys()), "{place}: {here:?}\n{beside:?}");
        for (here, beside) in here.values().zip(beside.values()) {
            assert!((here / beside - 1.0).abs() < 2e-3, "{place}: {here} against {beside}");
        }
    }
}

/// In line with the end of a screen a receiver has every image that it has on both sides of the line, and none that it has on
/// neither.
#[test]
fn past_the_end_of_a_screen_nothing_is_lost_beyond_what_the_screen_takes() {
    let mut mesh = Mesh::shoebox([8.0, 6.0, 3.0], [0; 6]);
    let corner = |y, z| dvec3(4.0, y, z);
    meshes::add_quad(&mut mesh, 0, [corner(0.0, 0.0), corner(3.0, 0.0), corner(3.0, 3.0), corner(0.0, 3.0)]);
    let source = dvec3(2.0, 2.0, 1.0);
    let traced = Traced::new(scene(mesh, source), Settings { emissions: 64, ..Settings::default() });
    for place in [dvec3(6.0, 4.0, 1.0), dvec3(6.0, 4.0, 2.0), dvec3(5.0, 3.5, 1.0), dvec3(7.0, 4.5, 1.5)] {
        let [here, lit, shaded] = [0.0, 1e-3, -1e-3].map(|y| images(&traced, place + dvec3(0.0, y, 0.0)));
        assert!(lit.len() > shaded.len(), "{place} is on no shadow boundary");
        assert!(lit.keys().filter(|image| shaded.contains_key(*image)).all(|image| here.contains_key(image)));
        assert!(here.keys().all(|image| lit.contains_key(image) || shaded.contains_key(image)));
    }
}

/// The broken variant: a partition that ends half a metre below the ceiling is noticed at every place behind it.
#[test]
fn a_gap_above_a_partition_is_noticed() {
    let mut mesh = Mesh::shoebox([8.0, 6.0, 3.0], [0; 6]);
    add_partition(&mut mesh, 4.0, [6.0, 2.5]);
    let traced =
        Traced::new(scene(mesh, dvec3(2.0, 2.0, 1.0)), Settings { emissions: 64, ..Settings::default() });
    let places = [dvec3(6.0, 2.0, 1.0), dvec3(5.0, 3.0, 1.5), dvec3(4.5, 5.5, 0.5)];
    for estimator in [Estimator::Auto, Estimator::Gather] {
        assert!(fluences(&traced, &places, estimator).iter().all(|&fluence| fluence > 0.0), "{estimator:?}");
    }
}
