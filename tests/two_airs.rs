//! A black room of two airs with a plane border between them, and source and receiver on one side of it: direct sound and its reflection at
//! the border in closed form.

use std::f64::consts::PI;

use glam::{DVec3, dvec3};
use sonel_acoustics::{Air, BandWidth, Bands, Material};
use sonel_geometry::Mesh;
use sonel_map::Settings;
use sonel_renderer::RenderSettings;
use sonel_scene::{Region, Scene};
use sonel_testkit::uniform::Uniform;

use crate::airs::with_regions;
use crate::meshes::add_quad;
use crate::{Traced, batch_fluence};

/// Material of the border; walls are 0.
const BORDER: u32 = 1;

/// A room of two airs.
#[derive(Debug, Clone)]
pub struct TwoAirs {
    /// Inner size of the room [m].
    size: DVec3,
    /// The border is where z = height + slope · (x, y) [m, 1]; all of it is between floor and ceiling.
    height: f64,
    slope: [f64; 2],
    /// c and ρ above the border over those below it, where air is that of the scene.
    ratios: [f64; 2],
    /// Source and receiver, both above the border or both below [m].
    places: [DVec3; 2],
}

/// A region about the point `inside` [m] with the air of `scene` at another temperature, which does not attenuate.
#[must_use]
pub fn region_at(scene: &Scene, name: &str, inside: [f64; 3], temperature_celsius: f64) -> Region {
    let air = Air { temperature_celsius, ..scene.air };
    let ratio = air.temperature_kelvin() / scene.air.temperature_kelvin();
    Region {
        name: name.to_owned(),
        inside: inside.into(),
        speed_of_sound: scene.speed_of_sound * ratio.sqrt(),
        density: air.density(),
        air_attenuation: vec![0.0; scene.bands.count()],
        air,
    }
}

/// Reflected share of the energy of a plane wave.
pub type Law = fn(cosine: f64, speeds: [f64; 2], densities: [f64; 2]) -> f64;

/// That share by continuity of pressure and normal velocity, with the slowness along the border the same on both sides.
pub fn fresnel(cosine: f64, speeds: [f64; 2], densities: [f64; 2]) -> f64 {
    let along_squared = (1.0 - cosine * cosine) / (speeds[0] * speeds[0]);
    let normal_squared = 1.0 / (speeds[1] * speeds[1]) - along_squared;
    if normal_squared <= 0.0 {
        return 1.0;
    }
    // Normal slowness over density: admittance of each side.
    let [here, beyond] = [cosine / speeds[0] / densities[0], normal_squared.sqrt() / densities[1]];
    ((here - beyond) / (here + beyond)).powi(2)
}

impl TwoAirs {
    /// A room with places from a millimetre to metres off the border, at angles from its normal to grazing.
    #[must_use]
    pub fn draw(random: &mut Uniform) -> Self {
        let size = dvec3(random.between(3.0, 40.0), random.between(3.0, 30.0), random.between(3.0, 20.0));
        let height = random.between(0.35, 0.65) * size.z;
        let is_level = random.below(2) == 0;
        let mut steepest = |extent: f64| {
            let steepest = 0.15 * size.z / extent;
            if is_level { 0.0 } else { random.between(-steepest, steepest) }
        };
        let slope = [steepest(size.x), steepest(size.y)];
        let ratios = [random.between(0.75, 1.3), random.between(0.7, 1.4)];
        let side = if random.below(2) == 0 { 1.0 } else { -1.0 };
        let mut room = Self { size, height, slope, ratios, places: [DVec3::ZERO; 2] };
        room.places = [(); 2].map(|()| {
            let [x, y] = [size.x, size.y].map(|extent| random.between(0.02, 0.98) * extent);
            let border = room.border(x, y);
            let most: f64 = 0.95 * if side > 0.0 { size.z - border } else { border };
            let least: f64 = 1e-3;
            dvec3(x, y, border + side * least * (most / least).powf(random.next_f64()))
        });
        room
    }

    fn border(&self, x: f64, y: f64) -> f64 {
        self.height + self.slope[0] * (x - 0.5 * self.size.x) + self.slope[1] * (y - 0.5 * self.size.y)
    }

    fn is_above(&self) -> bool {
        let DVec3 { x, y, z } = self.places[0];
        z > self.border(x, y)
    }

    fn scene(&self) -> Scene {
        let mut mesh = Mesh::shoebox(self.size.to_array(), [0; 6]);
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let corner = |[x, y]: [f64; 2]| (x * self.size.x, y * self.size.y);
        let on_border = corners.map(corner).map(|(x, y)| dvec3(x, y, self.border(x, y)));
        add_quad(&mut mesh, BORDER, on_border);
        let bands = Bands::new(vec![500.0], BandWidth::Octave).expect("an octave");
        let materials = ["walls", "border"].map(|name| Material::uniform(name, 1.0, 0.0, 1));
        let [source, receiver] = self.places.map(|place| place.to_array());
        let scene = Scene::from_parts(mesh, materials.to_vec(), bands, 0.5)
            .with_source("source", source)
            .with_receiver("receiver", receiver)
            .without_air_attenuation();
        let DVec3 { x, y, z } = self.size;
        let region = region_at(&scene, "above", [0.5 * x, 0.5 * y, 0.95 * z], 20.0);
        let speed_of_sound = self.ratios[0] * region.speed_of_sound;
        let region = Region { speed_of_sound, density: self.ratios[1] * region.density, ..region };
        with_regions(scene, vec![region], vec![BORDER]).expect("sound regions")
    }

    /// Fluence times ρc of the receiver's air over that below the border, where the border reflects by `law` [1/m²].
    #[must_use]
    pub fn expected(&self, law: Law) -> f64 {
        let [source, receiver] = self.places;
        let normal = dvec3(-self.slope[0], -self.slope[1], 1.0).normalize();
        let height = |place: DVec3| (place.z - self.border(place.x, place.y)) * normal.z;
        let image = source - 2.0 * height(source) * normal;
        let share = height(source) / (height(source) + height(receiver));
        let met = source - height(source) * normal
            + share * (receiver - source - (height(receiver) - height(source)) * normal);
        let is_in_room = met.cmpgt(DVec3::ZERO).all() && met.cmplt(self.size).all();
        let spread = |from: DVec3| 1.0 / (4.0 * PI * from.distance_squared(receiver));
        let [mut speeds, mut densities] = self.ratios.map(|above| [1.0, above]);
        if self.is_above() {
            speeds.reverse();
            densities.reverse();
        }
        let cosine = normal.dot((receiver - image).normalize()).abs();
        let reflected = if is_in_room { law(cosine, speeds, densities) * spread(image) } else { 0.0 };
        speeds[0] * densities[0] * (spread(source) + reflected)
    }

    /// The same as rendered: mean and standard error over batches.
    #[must_use]
    pub fn rendered(&self) -> (f64, f64) {
        let settings = Settings { emissions: 64, ..Settings::default() };
        batch_fluence(&Traced::new(self.scene(), settings).render(RenderSettings::default()), 0, 0)
    }
}

/// Checks `count` rooms drawn from `seed`: no noise, and the closed form to 10⁻⁵. Borders that reflect nothing or everything show in a
/// quarter of them at least.
///
/// # Panics
/// Where a level is off.
pub fn check(count: usize, seed: u64) {
    let mut random = Uniform::new(seed);
    let mut wrong = [0; 2];
    for _ in 0..count {
        let room = TwoAirs::draw(&mut random);
        let (found, sigma) = room.rendered();
        assert!(sigma <= 1e-12 * found, "{room:?}: noise of {sigma}");
        let is_off = |law: Law| (found / room.expected(law) - 1.0).abs() > 1e-5;
        assert!(!is_off(fresnel), "{room:?}: {found} instead of {}", room.expected(fresnel));
        let laws: [Law; 2] = [|_, _, _| 0.0, |_, _, _| 1.0];
        wrong.iter_mut().zip(laws).for_each(|(wrong, law)| *wrong += usize::from(is_off(law)));
    }
    assert!(wrong.iter().all(|&wrong| wrong > count / 4), "{wrong:?} of {count}");
}
