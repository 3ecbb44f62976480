//! A parameter with its quality, or the reason why there is none.

use thiserror::Error;

/// A parameter, or why the echogram cannot support it.
pub type ParameterValue = Result<Estimate, Unsupported>;

/// A number with what is known about it.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// In the unit of its parameter; finite.
    pub value: f64,
    /// Interval that holds the true value with a probability of 95 %.
    pub interval: Interval,
    /// Parts of the interval; none without an interval.
    pub error: Option<StandardError>,
    /// The same parameter without each batch, for comparisons of parameters that share their batches; empty without an interval.
    pub without: Vec<f64>,
    /// Weights of the batches, adding up to 1.
    pub weight: Vec<f64>,
    /// Why the interval deserves less trust than usual.
    pub warning: Option<String>,
    /// For reverberation times: how straight the decay is.
    pub decay: Option<DecayQuality>,
    /// Bias of discs and spheres; none where nothing is averaged over an area.
    pub kernel: Option<KernelShift>,
    /// Whether it is a time, whose reciprocal is about linear in the absorption ([`crate::materials`]).
    pub is_time: bool,
    /// Changes by each uncertain material ([`crate::materials`]); empty where they are not known.
    pub materials: Vec<MaterialChange>,
}

/// Changes of a value by the absorption of an uncertain material, to first order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaterialChange {
    /// By one standard uncertainty.
    pub by_one: f64,
    /// At the lowest and the highest absorption within the 95 % interval and within 0 … 1.
    pub at_ends: [f64; 2],
}

/// Shift of a parameter when it is freed of the bias of discs and spheres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KernelShift {
    /// The parameter freed of it less the parameter, in the unit of the parameter.
    pub shift: f64,
    /// Standard error of that shift. As the inner and the outer half of an area hold different sonels, it is twice the standard error
    /// that the areas' sonels bring to the parameter itself.
    pub sigma: f64,
}

impl KernelShift {
    /// How far the parameter is off by its bias, as far as noise lets see: the shift, shrunk by its variance over its square
    /// [JamesStein1961], positive part.
    #[must_use]
    pub fn bias(self) -> f64 {
        let shift = self.shift.abs();
        if shift > self.sigma { shift - self.sigma * (self.sigma / shift) } else { 0.0 }
    }

    /// `interval` extended by the bias to the side of the shift: the true value lies there.
    #[must_use]
    pub fn extend(self, [low, high]: [f64; 2]) -> [f64; 2] {
        if self.shift < 0.0 { [low - self.bias(), high] } else { [low, high + self.bias()] }
    }
}

/// An interval of more than this many just-noticeable differences to either side says nothing, and its linear theory does not
/// hold any more.
const MOST_JUST_NOTICEABLE: f64 = 10.0;

impl Estimate {
    /// A value with its interval alone.
    #[must_use]
    pub fn bare(value: f64, interval: Interval) -> Self {
        Self {
            value,
            interval,
            error: None,
            without: Vec::new(),
            weight: Vec::new(),
            warning: None,
            decay: None,
            kernel: None,
            is_time: false,
            materials: Vec::new(),
        }
    }

    /// The 95 % interval that the uncertainty of the materials makes; none where it is not known. The upper end of a time is infinite where its
    /// decay rate may be zero.
    #[must_use]
    pub fn material_interval(&self) -> Option<[f64; 2]> {
        (!self.materials.is_empty())
            .then(|| [-1.0, 1.0].map(|side| self.moved(side * self.material_change(side))))
    }

    /// The 95 % interval of simulation and materials together, as far as they are known: to either side the root of the sum of squares.
    ///
    /// # Errors
    /// Why the simulation has none.
    pub fn whole_interval(&self) -> Interval {
        let [low, high] = self.interval.clone()?;
        Ok([(low, -1.0), (high, 1.0)].map(|(end, side)| {
            self.moved(side * libm::hypot(self.change_to(end), self.material_change(side)))
        }))
    }

    /// First-order change by the materials to one `side`, −1 or 1: the root of the sum of squares, at least 0.
    fn material_change(&self, side: f64) -> f64 {
        let farthest =
            |change: &MaterialChange| change.at_ends.iter().fold(0.0_f64, |far, end| far.max(side * end));
        self.materials.iter().map(|change| farthest(change) * farthest(change)).sum::<f64>().sqrt()
    }

    /// The value after a first-order `change`: of a time, that of its reciprocal is taken.
    fn moved(&self, change: f64) -> f64 {
        if self.is_time { self.value / (1.0 - change / self.value).max(0.0) } else { self.value + change }
    }

    /// The first-order change that moves the value to `end`.
    fn change_to(&self, end: f64) -> f64 {
        if self.is_time { self.value - self.value * (self.value / end.max(0.0)) } else { end - self.value }
    }

    /// The estimate, unless its interval is hopelessly wide; `just_noticeable` is the just-noticeable difference about its
    /// value, in the same unit.
    ///
    /// # Errors
    /// [`Unsupported::Noisy`].
    pub fn unless_noisy(self, just_noticeable: f64) -> ParameterValue {
        let half_width = self.interval.as_ref().map_or(0.0, |[low, high]| 0.5 * (high - low));
        if half_width > MOST_JUST_NOTICEABLE * just_noticeable {
            return Err(Unsupported::Noisy { just_noticeable: half_width / just_noticeable });
        }
        Ok(self)
    }
}

/// Standard error of a parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StandardError {
    /// In the unit of the parameter.
    pub sigma: f64,
    /// Degrees of freedom that it was estimated with, batches less one.
    pub freedom: u32,
}

/// A 95 % interval, or why there is none.
pub type Interval = Result<[f64; 2], NoInterval>;

/// Reading of a reverberation time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DecayQuality {
    /// Part of the decay evaluated, relative to its start [dB].
    pub range_db: [f64; 2],
    /// Non-linearity ξ = 1000 (1 − r²), r the correlation of level and time [‰] (ISO 3382-2 annex B).
    pub non_linearity_permille: f64,
    /// Curvature C = 100 (T30/T20 − 1) [%] (ISO 3382-2 annex B); none where either time is missing.
    pub curvature_percent: Option<f64>,
}

/// Largest non-linearity ξ of a straight decay [‰] (ISO 3382-2 annex B).
const LARGEST_NON_LINEARITY: f64 = 10.0;
/// Largest curvature |C| of a straight decay [%] (ISO 3382-2 annex B).
const LARGEST_CURVATURE: f64 = 10.0;
/// Beyond so many times these limits a decay has no reverberation time: at ξ = 100 ‰ a tenth of the variance of the level is no decay at
/// the rate of the line, at C = 100 % T30 is twice T20.
const HOPELESS: f64 = 10.0;

impl DecayQuality {
    /// Quantities that exceed `times` the limits of ISO 3382-2; [`None`] where none does.
    fn excess(&self, times: f64) -> Option<String> {
        let (linear, curved) = (times * LARGEST_NON_LINEARITY, times * LARGEST_CURVATURE);
        if self.non_linearity_permille > linear {
            let found = above(self.non_linearity_permille, linear);
            return Some(format!("ξ = {found} ‰, limit {linear:.0} ‰"));
        }
        let curvature = self.curvature_percent.filter(|curvature| curvature.abs() > curved)?;
        Some(format!("C = {} %, limit {curved:.0} %", above(curvature, curved)))
    }
}

/// `value`, whose size exceeds `limit`, with the digits that show it.
fn above(value: f64, limit: f64) -> String {
    let digits = (0..3).find(|&digits| format!("{:.digits$}", value.abs()) != format!("{limit:.digits$}"));
    format!("{value:.*}", digits.unwrap_or(3))
}

impl Estimate {
    /// A reverberation time read as `quality` says, with a warning where the decay exceeds the limits of ISO 3382-2 annex B.
    ///
    /// # Errors
    /// [`Unsupported::NotStraight`] where it exceeds ten times the limits.
    pub fn if_straight(self, quality: Option<DecayQuality>) -> ParameterValue {
        let Some(quality) = quality else { return Ok(self) };
        if let Some(found) = quality.excess(HOPELESS) {
            let [from_db, to_db] = quality.range_db;
            return Err(Unsupported::NotStraight { from_db, to_db, found });
        }
        let bent =
            quality.excess(1.0).map(|found| format!("the decay curve is not straight: {found} (ISO 3382-2)"));
        Ok(Self { decay: Some(quality), ..self }.warned(bent))
    }

    /// The estimate with one more warning.
    #[must_use]
    pub fn warned(self, warning: Option<String>) -> Self {
        let warning = match (self.warning, warning) {
            (Some(first), Some(second)) => Some(format!("{first}; {second}")),
            (first, second) => first.or(second),
        };
        Self { warning, ..self }
    }
}

/// Why a parameter has no value.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum Unsupported {
    /// The echogram is empty.
    #[error("no energy arrives")]
    NoEnergy,
    /// The echogram ends too early.
    #[error(
        "the direct sound is due at {direct_time:.4} s, the echogram ends at {end:.4} s: simulate a longer duration"
    )]
    DirectOutside {
        /// [s].
        direct_time: f64,
        /// [s].
        end: f64,
    },
    /// Windows of the echo criterion are narrower than the bins.
    #[error("time bins of {width_ms} ms are too wide for the echo criterion: use `bin` 0.001 or below")]
    BinsBeyondEchoes {
        /// Widest bin [ms].
        width_ms: f64,
    },
    /// Nothing after the direct sound.
    #[error("no energy arrives after the direct sound")]
    NoReverberation,
    /// A steady or rising echogram.
    #[error("the echogram does not decay towards its end: simulate or record a longer duration")]
    NotDecaying,
    /// The tail would be extrapolation.
    #[error(
        "the echogram holds only {reached_db:.1} dB of the decay, 10 dB are needed: set duration_s to {needed_s:.2} or more, or record as many seconds"
    )]
    RecordTooShort {
        /// [dB].
        reached_db: f64,
        /// Duration that brings T30 at the rate of the record's end [s].
        needed_s: f64,
    },
    /// The part after the record decides.
    #[error(
        "the run ends at {end_s:.2} s and the missing decay is too large for this parameter: set duration_s to {needed_s:.2} or more"
    )]
    CutOff {
        /// [s].
        end_s: f64,
        /// [s].
        needed_s: f64,
    },
    /// The decay is no line.
    #[error(
        "the decay from {from_db:.0} to {to_db:.0} dB is not straight: {found}; no reverberation time describes it, see the decay curve"
    )]
    NotStraight {
        /// [dB].
        from_db: f64,
        /// [dB].
        to_db: f64,
        /// Quantity beyond its limit.
        found: String,
    },
    /// The evaluation range is not covered.
    #[error(
        "the decay reaches only {reached_db:.1} dB, {needed_db:.0} dB are needed: set duration_s to {needed_s:.2} or more, or record as many seconds"
    )]
    RangeNotReached {
        /// [dB], negative.
        reached_db: f64,
        /// [dB], negative.
        needed_db: f64,
        /// Duration that brings it, at the rate of the record's end [s].
        needed_s: f64,
    },
    /// The decay is too fast for the bins.
    #[error(
        "time bins are too coarse: {borders} of the 3 bin borders needed lie between {from_db:.0} and {to_db:.0} dB of the decay: render with a shorter `bin`"
    )]
    TooSteep {
        /// [dB].
        from_db: f64,
        /// [dB].
        to_db: f64,
        /// Bin borders within the range.
        borders: usize,
    },
    /// The bins are too wide for a time that the parameter depends on.
    #[error(
        "time bins are too coarse: {width_ms:.1} ms wide, at most {most_ms:.1} ms are allowed: render with a shorter `bin`"
    )]
    BinTooWide {
        /// [ms].
        width_ms: f64,
        /// [ms].
        most_ms: f64,
    },
    /// A decay needs two bins.
    #[error(
        "time bins are too coarse: a single one follows the direct sound: render with a shorter `bin`, or simulate a longer duration"
    )]
    SingleBin,
    /// The limit between early and late lies outside the record.
    #[error(
        "the echogram ends before {limit_ms:.0} ms after the direct sound: simulate or record a longer duration"
    )]
    LimitOutside {
        /// [ms].
        limit_ms: f64,
    },
    /// No early energy: the ratio is zero.
    #[error("no energy arrives within {limit_ms:.0} ms after the direct sound")]
    NothingEarly {
        /// [ms].
        limit_ms: f64,
    },
    /// No late energy: the ratio is infinite.
    #[error("no energy arrives later than {limit_ms:.0} ms after the direct sound")]
    NothingLate {
        /// [ms].
        limit_ms: f64,
    },
    /// The parameter rests on one batch.
    #[error("the noise is too high: without one of the batches {reason}; trace more packets")]
    OneBatchDecides {
        /// The fault.
        reason: Box<Unsupported>,
    },
    /// The interval is too wide to say anything.
    #[error(
        "the noise is too high: ± {just_noticeable:.0} just-noticeable differences at 95 %; trace more packets"
    )]
    Noisy {
        /// Half-width in just-noticeable differences.
        just_noticeable: f64,
    },
    /// Energies so large or so small that the arithmetic leaves the range of doubles.
    #[error("the energies are outside the range of 64-bit numbers")]
    BeyondNumbers,
    /// No directions were asked for.
    #[error("the response holds no directions: render with `directions`")]
    NoDirections,
    /// A line needs places.
    #[error(
        "a regression needs two places at different distances, of levels between 2 m and 16 m; found {found}"
    )]
    TooFewPlaces {
        /// Number of them.
        found: usize,
    },
    /// Speech stays intelligible.
    #[error("the regression line of {of_what} does not fall through {value} at any distance")]
    NotFalling {
        /// Whose line it is.
        of_what: &'static str,
        /// The value looked for.
        value: f64,
    },
    /// Only some parameters were read.
    #[error("it was not asked for")]
    NotAsked,
    /// No musician stands there.
    #[error("support is defined one metre from the source")]
    NotOnStage,
    /// A measurement whose noise is too loud.
    #[error(
        "the noise of the measurement meets the decay at {reached_db:.1} dB, {needed_db:.0} dB are needed (ISO 3382-1): measure with more level or less noise"
    )]
    NoiseReached {
        /// Level of the decay curve where it meets the noise [dB].
        reached_db: f64,
        /// What the parameter needs [dB].
        needed_db: f64,
    },
    /// A measurement of unknown level.
    #[error("the measurement is not calibrated: levels are not known")]
    NotCalibrated,
    /// Nothing is said, or nothing else sounds.
    #[error("speech in noise needs levels of the noise, which are stated in the octaves 125 … 8000 Hz")]
    NoNoise,
    /// The direct sound is blocked, or there is nothing else.
    #[error("no direct sound arrives, or nothing but direct sound")]
    NoDirectSound,
    /// Speech needs all its octaves.
    #[error("speech needs the octaves 125 to 8000 Hz; missing: {missing}")]
    BandsMissing {
        /// Names of the bands.
        missing: String,
    },
    /// Single numbers need their octaves.
    #[error("its single number is the mean over the octaves {octaves} Hz; missing: {missing}")]
    OctavesMissing {
        /// Nominal centres.
        octaves: &'static str,
        /// Names of the bands.
        missing: String,
    },
    /// One of the octaves of speech has no modulation transfer.
    #[error("at {center_frequency_hz} Hz: {reason}")]
    Band {
        /// Nominal centre [Hz].
        center_frequency_hz: f64,
        /// The fault there.
        reason: Box<Unsupported>,
    },
}

/// Why a parameter has no interval.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum NoInterval {
    /// The file holds no batches.
    #[error("the response holds no batches")]
    NoBatches,
    /// Measured once.
    #[error("a single measurement has no interval")]
    SingleMeasurement,
    /// One batch has no spread.
    #[error("the response holds one batch: trace with `batches` 2 or more")]
    OneBatch,
    /// The batches, which are single numbers, cannot hold what the echogram holds.
    #[error("the energy is below 1e-38 1/m², the least that the batches can hold")]
    TooQuiet,
    /// Not read from batches.
    #[error("this parameter is read from the time bins alone, which have no spread")]
    NotOfBatches,
    /// The spread leaves the range of doubles.
    #[error("the spread of the batches is outside the range of 64-bit numbers")]
    BeyondNumbers,
}

#[cfg(test)]
mod tests {
    use super::*;
    use sonel_testkit::uniform::Uniform;

    /// A time read off a decay of non-linearity `xi` [‰] and curvature `c` [%].
    fn time(xi: f64, c: f64) -> ParameterValue {
        let estimate = Estimate::bare(1.0, Ok([0.9, 1.1]));
        let quality =
            DecayQuality { range_db: [-5.0, -25.0], non_linearity_permille: xi, curvature_percent: Some(c) };
        estimate.if_straight(Some(quality))
    }

    #[test]
    fn curved_decays_are_warned_of_and_refused_beyond_ten_times_the_limits() {
        assert_eq!(time(9.0, -9.0).unwrap().warning, None);
        assert!(time(11.0, 0.0).unwrap().warning.unwrap().contains("ξ = 11 ‰"));
        assert!(time(10.04, 0.0).unwrap().warning.unwrap().contains("ξ = 10.04 ‰, limit 10 ‰"));
        assert!(time(0.0, -11.0).unwrap().warning.unwrap().contains("C = -11 %"));
        assert!(time(0.0, -10.2).unwrap().warning.unwrap().contains("C = -10.2 %"));
        for refused in [time(101.0, 0.0), time(0.0, 101.0)] {
            assert!(matches!(refused, Err(Unsupported::NotStraight { .. })), "{refused:?}");
        }
    }

    /// Coverage and mean half-width [1.96 σ] of intervals of a parameter of standard error σ = 1 that discs bring with a `bias`, extended by
    /// what `extension` makes of the shift and its standard error.
    fn of_discs(bias: f64, extension: impl Fn(KernelShift) -> f64) -> [f64; 2] {
        const RUNS: usize = 100_000;
        let mut numbers = Uniform::new(3);
        let mut normal = || (0..12).map(|_| numbers.next_f64()).sum::<f64>() - 6.0;
        let [mut covered, mut width] = [0.0; 2];
        for _ in 0..RUNS {
            let (value, kernel) = (normal() - bias, KernelShift { shift: bias + 2.0 * normal(), sigma: 2.0 });
            let more = extension(kernel);
            let [low, high] = if kernel.shift < 0.0 { [more, 0.0] } else { [0.0, more] };
            covered += f64::from(u8::from(value - 1.96 - low <= 0.0 && 0.0 <= value + 1.96 + high));
            width += 1.0 + (low + high) / 3.92;
        }
        [covered, width].map(|sum| sum / RUNS as f64)
    }

    /// What noise alone adds is an eighth; a bias of half a standard error, which noise hides, costs no more than one run in sixty.
    #[test]
    fn bias_is_shrunk_where_noise_may_be_all() {
        let found = [0.0, 0.5, 1.0].map(|bias| of_discs(bias, KernelShift::bias));
        assert!(found[0][0] > 0.95 && found[1][0] > 0.932 && found[2][0] > 0.86, "{found:?}");
        assert!(found[0][1] < 1.145, "{found:?}");
        let by_square =
            |kernel: KernelShift| (kernel.shift * kernel.shift - kernel.sigma * kernel.sigma).max(0.0).sqrt();
        assert!(of_discs(0.0, by_square)[1] > 1.16, "the root of the difference of squares adds more");
        assert!(of_discs(1.0, |_| 0.0)[0] < 0.84, "without it intervals miss");
    }
}
