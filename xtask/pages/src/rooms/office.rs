//! An open-plan office of 20 × 10 × 2.8 m: a line of eight workstations, without screens and with screens of 1.4 m and 1.8 m.

use super::{Plan, centimetres};
use crate::quads::grid::{Finish, Patch, Solid};

/// The scenes: without screens, with screens of 1.4 m, of 1.8 m.
pub(super) const SCENES: [&str; 3] =
    ["scenes/office/scene.toml", "scenes/office/screens-1.4.toml", "scenes/office/screens-1.8.toml"];
/// Middle of the line of workstations [cm].
const LINE: i32 = 500;
/// Between two workstations [cm].
const PITCH: i32 = 220;
/// The first desk [cm].
const FIRST: i32 = 150;
/// Workstations of the line.
const WORKSTATIONS: i32 = 8;

/// The plans [cm]: x along the line of workstations, y from the corridor to the windows, z up.
pub(super) fn plans() -> Vec<Plan> {
    let of = |at: usize, title, mesh, height| Plan {
        title,
        mesh,
        scene: SCENES[at],
        readme: (at == 0).then_some("scenes/office/README.md"),
        extent: [(0, 2000), (0, 1000), (0, 280)],
        shell: Finish { top: "floor", side: "walls", bottom: "ceiling" },
        solids: solids(height),
        patches: vec![
            Patch { extent: [(0, 2000), (1000, 1000), (90, 260)], material: "windows" },
            Patch { extent: [(900, 1000), (0, 0), (0, 210)], material: "door" },
        ],
        place: centimetres,
    };
    vec![
        of(0, "Office without screens", "scenes/office/office.obj", 0),
        of(1, "Office with screens of 1.4 m", "scenes/office/screens-1.4.obj", 140),
        of(2, "Office with screens of 1.8 m", "scenes/office/screens-1.8.obj", 180),
    ]
}

/// Desk tops 4 cm thick, cupboards along the corridor, and between two workstations a screen of this height [cm].
fn solids(height: i32) -> Vec<Solid> {
    let mut solids = Vec::new();
    for station in 0..WORKSTATIONS {
        let front = FIRST + station * PITCH;
        solids.push(Solid {
            extent: [(front + 80, front + 160), (LINE - 80, LINE + 80), (70, 74)],
            finish: Finish::all("desks"),
        });
        if height > 0 && station + 1 < WORKSTATIONS {
            solids.push(Solid {
                extent: [(front + 165, front + 170), (LINE - 100, LINE + 100), (0, height)],
                finish: Finish::all("screen"),
            });
        }
    }
    for along in [(200, 800), (1100, 1800)] {
        solids.push(Solid { extent: [along, (0, 45), (0, 120)], finish: Finish::all("cupboards") });
    }
    solids
}
