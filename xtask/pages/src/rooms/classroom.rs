//! A classroom of 9 × 7 × 3 m: board, windows, door, a field of desks, a cupboard and the teacher's desk.

use super::{Plan, centimetres};
use crate::quads::grid::{Finish, Patch, Solid};

/// The plan [cm]: x from the board to the rear wall, y from the door to the windows, z up.
pub(super) fn plan() -> Plan {
    Plan {
        title: "Classroom",
        mesh: "scenes/classroom/classroom.obj",
        scene: "scenes/classroom/scene.toml",
        readme: Some("scenes/classroom/README.md"),
        extent: [(0, 900), (0, 700), (0, 300)],
        shell: Finish { top: "floor", side: "walls", bottom: "ceiling" },
        solids: vec![
            Solid { extent: [(60, 130), (450, 590), (0, 76)], finish: Finish::all("furniture") },
            Solid { extent: [(700, 900), (0, 45), (0, 190)], finish: Finish::all("furniture") },
        ],
        patches: vec![
            Patch { extent: [(0, 0), (150, 550), (90, 210)], material: "board" },
            Patch { extent: [(100, 800), (700, 700), (90, 270)], material: "windows" },
            Patch { extent: [(50, 150), (0, 0), (0, 210)], material: "door" },
            Patch { extent: [(900, 900), (100, 600), (80, 240)], material: "rear wall" },
            Patch { extent: [(240, 860), (80, 620), (0, 0)], material: "desks" },
        ],
        place: centimetres,
    }
}
