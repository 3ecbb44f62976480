//! Positions and directions in a SOFA file.

use glam::DVec3;

use crate::{Array, Sofa, SofaError};

/// Triplets of coordinates, by row and measurement.
pub struct Triplets {
    /// Whether they are azimuth, elevation [°] and distance, not x, y, z.
    pub is_spherical: bool,
    shape: [usize; 3],
    values: Vec<f64>,
}

impl Triplets {
    /// The array `name` of one or `rows` rows, alike in all or separate in each of the `measurements`; `default` where there is none.
    ///
    /// # Errors
    /// When the array is missing, has another shape or other units.
    pub fn read(
        file: &Sofa<'_>,
        name: &str,
        rows: usize,
        measurements: usize,
        default: Option<DVec3>,
    ) -> Result<Self, SofaError> {
        let Some(array) = file.array(name)? else {
            let default = default.ok_or_else(|| format!("the file has no array {name}"))?;
            return Ok(Self { is_spherical: false, shape: [1, 3, 1], values: default.to_array().to_vec() });
        };
        let is_spherical = is_spherical(name, &array)?;
        let shape = match array.shape[..] {
            [found, 3] => [found, 3, 1],
            [found, 3, layers] => [found, 3, layers],
            _ => [0; 3],
        };
        if !(shape[0] == 1 || shape[0] == rows) || !(shape[2] == 1 || shape[2] == measurements) {
            return Err(format!(
                "{name} has the shape {:?}; needed are 1 or {rows} rows of 3 coordinates",
                array.shape
            )
            .into());
        }
        Ok(Self { is_spherical, shape, values: array.values })
    }

    /// Cartesian coordinates.
    #[must_use]
    pub fn at(&self, row: usize, measurement: usize) -> DVec3 {
        let [rows, columns, layers] = self.shape;
        let (row, layer) = (row.min(rows - 1), measurement.min(layers - 1));
        let value = |column: usize| self.values[(row * columns + column) * layers + layer];
        let [x, y, z] = [0, 1, 2].map(value);
        if !self.is_spherical {
            return DVec3::new(x, y, z);
        }
        spherical(x, y, z)
    }
}

/// Cartesian coordinates of an azimuth, an elevation [°] and a distance.
#[must_use]
pub fn spherical(azimuth: f64, elevation: f64, distance: f64) -> DVec3 {
    let (azimuth, elevation) = (azimuth.to_radians(), elevation.to_radians());
    let across = distance * libm::cos(elevation);
    DVec3::new(across * libm::cos(azimuth), across * libm::sin(azimuth), distance * libm::sin(elevation))
}

/// Whether an array has azimuth, elevation [°] and distance [m], not x, y, z [m].
fn is_spherical(name: &str, array: &Array) -> Result<bool, SofaError> {
    let kind = array.attribute("Type").unwrap_or("cartesian");
    let units = array.attribute("Units").unwrap_or_default().to_lowercase();
    let words: Vec<&str> = units.split([',', ' ']).filter(|word| !word.is_empty()).collect();
    let is_length = |word: &&str| ["metre", "meter", "metres", "meters", "m"].contains(word);
    let (is_spherical, is_in_units) = match (kind, &words[..]) {
        ("cartesian", words) => (false, words.iter().all(is_length)),
        ("spherical", [a, b, c]) => {
            (true, a.starts_with("degree") && b.starts_with("degree") && is_length(c))
        }
        ("spherical", words) => (true, words.is_empty()),
        _ => {
            return Err(format!(
                "{name} has coordinates of the type {kind}; cartesian and spherical are read"
            )
            .into());
        }
    };
    if is_in_units {
        Ok(is_spherical)
    } else {
        Err(format!("{name} is in \"{units}\"; degrees and metres are read").into())
    }
}
