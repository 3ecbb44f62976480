//! How many sonels: a pilot asked before the run.

use std::io::Write;

use sonel_analysis::Parameter;
use sonel_console::clock::CpuClock;
use sonel_map::{Mode, Settings};
use sonel_renderer::{ReceiverPoint, RenderSettings};
use sonel_study::judges::judges;
use sonel_study::pilot::{self, Mission, Pilot};
use sonel_study::plan::{DEFAULT_ACCURACY, most_by_default};
use sonel_study::spread::PLANNED;
use sonel_study::trial::{Room, TrialError};

/// Whoever judges a run, and how.
pub struct Planner<'a> {
    /// The room.
    pub room: &'a Room<'a>,
    /// Settings of the run.
    pub settings: Settings,
    /// Where it is judged.
    pub judges: Vec<ReceiverPoint>,
}

impl<'a> Planner<'a> {
    /// A planner for a run with `settings`.
    pub fn new(room: &'a Room<'a>, settings: Settings) -> Self {
        Self { room, settings, judges: judges(room.scene(), room.geometry()) }
    }

    /// Runs a pilot that looks at `parameters`, in so many CPU `seconds` where they are limited.
    pub fn pilot(&self, parameters: &[Parameter], seconds: Option<f64>) -> Result<Pilot, TrialError> {
        pilot::run(&self.mission(parameters, seconds), &CpuClock)
    }

    fn mission<'b>(&'b self, parameters: &'b [Parameter], seconds: Option<f64>) -> Mission<'b> {
        Mission {
            room: self.room,
            trace: self.settings,
            render: RenderSettings::default(),
            receivers: &self.judges,
            parameters,
            seconds,
        }
    }

    /// Emissions where nobody says how many, and the pilot that found them. A function of scene and settings alone.
    pub fn default_emissions(&self, log: &mut dyn Write) -> anyhow::Result<(u64, Option<Pilot>)> {
        let least = Settings::default().emissions;
        if self.settings.mode == Mode::Paper {
            return Ok((least, None));
        }
        // Where paths are so long that no more than the least would be taken anyway, nobody needs to know how many should be.
        let segments = pilot::segments(&self.mission(&PLANNED, None))?;
        if most_by_default(segments) <= least {
            writeln!(
                log,
                "{least} sonels: paths of {segments:.0} segments leave no room for more unasked (--plan, --until)"
            )?;
            return Ok((least, None));
        }
        let pilot = match self.pilot(&PLANNED, None) {
            Ok(pilot) => pilot,
            Err(TrialError::Render(error)) => {
                writeln!(log, "{least} sonels: nobody can judge this scene ({error})")?;
                return Ok((least, None));
            }
            Err(error) => return Err(error.into()),
        };
        let (emissions, limited) = pilot.default_emissions(self.settings.batches, least);
        let reason = if limited {
            "as many as are traced unasked; a twentieth of a just-noticeable difference takes more (--plan, --until)"
        } else if emissions == least {
            "never fewer; a twentieth of a just-noticeable difference takes no more"
        } else {
            "for a twentieth of a just-noticeable difference"
        };
        debug_assert!((DEFAULT_ACCURACY - 0.05).abs() < 1e-12, "the words above");
        writeln!(log, "{emissions} sonels: {reason}")?;
        Ok((emissions, Some(pilot)))
    }
}
