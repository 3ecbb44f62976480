//! A church of three aisles: nave under a gabled roof, arcades, side aisles, chancel, and a gallery over the entrance.

use super::Plan;
use crate::quads::grid::{Finish, Patch, Solid};

/// Half the width of nave and of the church [dm].
const NAVE: i32 = 60;
const WIDTH: i32 = 100;
/// Length of nave, depth of the chancel [dm].
const LENGTH: i32 = 280;
const CHANCEL: i32 = 80;
/// Eaves of the nave [dm].
const EAVES: i32 = 100;
/// From the eaves to the ridge [m].
const RIDGE: f64 = 4.0;

/// The plan [dm]: x across, 0 on the axis, y from the chancel arch to the entrance, z up.
pub(super) fn plan() -> Plan {
    Plan {
        title: "Church",
        mesh: "scenes/church/church.obj",
        scene: "scenes/church/scene.toml",
        readme: Some("scenes/church/README.md"),
        extent: [(-WIDTH, WIDTH), (-CHANCEL, LENGTH), (0, EAVES)],
        shell: Finish { top: "floor", side: "walls", bottom: "roof" },
        solids: solids(),
        patches: patches(),
        place,
    }
}

/// Under the eaves nothing moves; the ceiling of the nave rises to its ridge, whose line is one of the grid.
fn place([x, y, z]: [i32; 3]) -> [f64; 3] {
    let rise = if z == EAVES { RIDGE * (1.0 - f64::from(x.abs().min(NAVE)) / f64::from(NAVE)) } else { 0.0 };
    [f64::from(x) / 10.0, f64::from(y) / 10.0, f64::from(z) / 10.0 + rise]
}

fn solids() -> Vec<Solid> {
    let masonry = Finish { top: "floor", side: "walls", bottom: "walls" };
    let mut solids = Vec::new();
    for side in [-1, 1] {
        let across = |near: i32, far: i32| if side < 0 { (-far, -near) } else { (near, far) };
        // Wall of the nave above the arcade, and the roof of the aisle at 5 m.
        solids.push(Solid { extent: [across(NAVE, WIDTH), (0, LENGTH), (50, EAVES)], finish: masonry });
        // Beside the chancel, 8 m wide.
        solids.push(Solid { extent: [across(40, WIDTH), (-CHANCEL, 0), (0, EAVES)], finish: masonry });
        for column in 1..7 {
            let along = (40 * column - 4, 40 * column + 4);
            solids.push(Solid {
                extent: [across(NAVE, NAVE + 8), along, (0, 50)],
                finish: Finish::all("walls"),
            });
        }
    }
    solids.push(Solid { extent: [(-40, 40), (-CHANCEL, 0), (90, EAVES)], finish: masonry });
    // Steps of the chancel, altar, gallery with its parapet.
    solids.push(Solid { extent: [(-40, 40), (-CHANCEL, 0), (0, 4)], finish: masonry });
    solids.push(Solid { extent: [(-12, 12), (-50, -40), (4, 14)], finish: Finish::all("walls") });
    let gallery = Finish { top: "gallery", side: "gallery front", bottom: "gallery front" };
    solids.push(Solid { extent: [(-NAVE, NAVE), (220, LENGTH), (36, 40)], finish: gallery });
    solids
        .push(Solid { extent: [(-NAVE, NAVE), (220, 222), (36, 49)], finish: Finish::all("gallery front") });
    solids
}

fn patches() -> Vec<Patch> {
    let mut patches = vec![
        Patch { extent: [(-50, -8), (40, 210), (0, 0)], material: "pews" },
        Patch { extent: [(8, 50), (40, 210), (0, 0)], material: "pews" },
        Patch { extent: [(-15, 15), (LENGTH, LENGTH), (0, 30)], material: "door" },
        // The line under the ridge.
        Patch { extent: [(0, 0), (0, LENGTH), (0, EAVES)], material: "walls" },
    ];
    for side in [-1, 1] {
        for window in 0..6 {
            let along = (40 * window + 30, 40 * window + 50);
            patches
                .push(Patch { extent: [(side * WIDTH, side * WIDTH), along, (20, 45)], material: "windows" });
            patches
                .push(Patch { extent: [(side * NAVE, side * NAVE), along, (60, 90)], material: "windows" });
        }
    }
    patches
}
