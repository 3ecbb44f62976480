//! Reverberation times of rooms of group A by their volume, slope · lg(V / 1 m³) + offset, for the volumes that the standard has.
//!
//! They hold for the occupied room, that of sport for the empty hall, within a range per octave.
//!
//! Reference: [DIN18041] (docs/references.md).

/// A use of rooms.
#[derive(Debug, PartialEq)]
pub struct Use {
    /// A1 … A5.
    pub class: &'static str,
    slope: f64,
    offset: f64,
    /// Smallest and largest volume [m³].
    pub volumes: [f64; 2],
    /// Octaves [Hz] with the lowest and the highest time as parts of the target.
    pub range: &'static [(f64, [f64; 2])],
}

/// Range in the middle octaves.
const MIDDLE: [f64; 2] = [0.8, 1.2];

/// Time of halls for sport above their volumes [s].
const LARGE_HALL: f64 = 2.0;

/// The uses of group A: music, speech, teaching (and inclusive speech), inclusive teaching, sport.
pub const GROUP_A: [Use; 5] = [
    Use { class: "A1", slope: 0.45, offset: 0.07, volumes: [30.0, 1000.0], range: &RANGE },
    Use { class: "A2", slope: 0.37, offset: -0.14, volumes: [50.0, 5000.0], range: &RANGE },
    Use { class: "A3", slope: 0.32, offset: -0.17, volumes: [30.0, 5000.0], range: &RANGE },
    Use { class: "A4", slope: 0.26, offset: -0.14, volumes: [30.0, 500.0], range: &RANGE },
    Use { class: "A5", slope: 0.75, offset: -1.0, volumes: [200.0, f64::INFINITY], range: &SPORT },
];

const SPORT: [(f64, [f64; 2]); 4] = [(250.0, MIDDLE), (500.0, MIDDLE), (1000.0, MIDDLE), (2000.0, MIDDLE)];
/// Figure 2 of the standard.
const RANGE: [(f64, [f64; 2]); 6] = [
    (125.0, [0.65, 1.45]),
    (250.0, MIDDLE),
    (500.0, MIDDLE),
    (1000.0, MIDDLE),
    (2000.0, MIDDLE),
    (4000.0, [0.65, 1.2]),
];

impl Use {
    /// The target for a room of a `volume` [m³] in [s]; none outside the volumes of the standard.
    #[must_use]
    pub fn time(&self, volume: f64) -> Option<f64> {
        let [least, most] = self.volumes;
        let time = self.slope * libm::log10(volume) + self.offset;
        (least..=most).contains(&volume).then(|| if self.is_occupied() { time } else { time.min(LARGE_HALL) })
    }

    /// Whether it holds for the room with people: for all but sport.
    #[must_use]
    pub fn is_occupied(&self) -> bool {
        self.class != "A5"
    }
}
