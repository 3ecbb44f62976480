//! The hall as its architect would dictate it: boxes of solid and air on a rectilinear grid.
//!
//! Lengths in this module are whole decimetres before the walls are splayed and the ceiling is tilted
//! ([`super::shape`]): x across (the hall is symmetric about 0), y from the stage's back wall to the rear wall,
//! z up from the floor before the stage. Integers make the grid exact; nothing has to be compared within a tolerance.

use crate::quads::grid::{Finish, Patch, Solid};

/// Half the width of the hall at the stage's back wall [dm].
pub(super) const HALF_WIDTH: i32 = 110;
/// From the stage's back wall to the rear wall [dm].
pub(super) const LENGTH: i32 = 338;
/// Ceiling above the stage's back wall [dm].
pub(super) const CEILING: i32 = 120;
/// Above this height the ceiling's tilt applies; nothing but walls crosses it [dm].
pub(super) const TILT_FROM: i32 = 102;

const STAGE_HALF_WIDTH: i32 = 80;
const STAGE_DEPTH: i32 = 90;
const STAGE_HEIGHT: i32 = 9;
const STALLS_FROM: i32 = 110;
const STALLS_TERRACES: i32 = 12;
const STALLS_RISE: i32 = 3;
const TERRACE_DEPTH: i32 = 19;
const WALKWAY: i32 = 5;
const SEAT_HEIGHT: i32 = 6;
const BALCONY_FROM: i32 = 262;
const BALCONY_TERRACES: i32 = 4;
const BALCONY_RISE: i32 = 6;
const BALCONY_UNDERSIDE: i32 = 63;
const BALCONY_FLOOR: i32 = 69;
const PARAPET_TOP: i32 = 78;
const PARAPET_THICKNESS: i32 = 3;
const SEAT_BLOCKS: [(i32, i32); 3] = [(-100, -50), (-38, 38), (50, 100)];

/// What encloses the hall: floor, walls and ceiling as seen from inside.
pub(super) const SHELL: Finish = Finish { top: "audience_floor", side: "plaster", bottom: "ceiling" };

const TERRACE: Finish = Finish { top: "audience_floor", side: "audience_floor", bottom: "plaster" };
const SEATS: Finish = Finish { top: "seats", side: "seats", bottom: "seats" };
const STAGE: Finish = Finish { top: "stage_floor", side: "stage_floor", bottom: "panelling" };
const PANELLED: Finish = Finish { top: "audience_floor", side: "panelling", bottom: "panelling" };
const REFLECTOR: Finish = Finish { top: "plywood", side: "plywood", bottom: "plywood" };

/// The solids, in painting order.
pub(super) fn solids() -> Vec<Solid> {
    let mut solids = stage();
    solids.extend(stalls());
    solids.extend(balcony());
    solids.extend(ledges());
    solids.extend(reflectors());
    solids
}

/// Doors, and panelling on the stage's back wall.
pub(super) fn patches() -> Vec<Patch> {
    let rear_sill = (STALLS_TERRACES - 1) * STALLS_RISE;
    let mut patches = vec![Patch {
        extent: [(-STAGE_HALF_WIDTH, STAGE_HALF_WIDTH), (0, 0), (STAGE_HEIGHT, TILT_FROM)],
        material: "panelling",
    }];
    for side in [-1, 1] {
        let aisle = if side < 0 { (-50, -38) } else { (38, 50) };
        patches
            .push(Patch { extent: [aisle, (LENGTH, LENGTH), (rear_sill, rear_sill + 21)], material: "door" });
        patches.push(Patch {
            extent: [(side * HALF_WIDTH, side * HALF_WIDTH), (STAGE_DEPTH, STALLS_FROM), (0, 21)],
            material: "door",
        });
    }
    patches
}

fn full_width() -> (i32, i32) {
    (-HALF_WIDTH, HALF_WIDTH)
}

/// Platform, a riser for the rear desks, side walls that narrow the opening, a canopy over the back.
fn stage() -> Vec<Solid> {
    let opening = (-STAGE_HALF_WIDTH, STAGE_HALF_WIDTH);
    let mut solids = vec![
        Solid { extent: [opening, (0, STAGE_DEPTH), (0, STAGE_HEIGHT)], finish: STAGE },
        Solid { extent: [(-50, 50), (0, 20), (0, 15)], finish: STAGE },
        Solid { extent: [opening, (0, 45), (TILT_FROM, CEILING)], finish: PANELLED },
    ];
    for wall in [(-HALF_WIDTH, -STAGE_HALF_WIDTH), (STAGE_HALF_WIDTH, HALF_WIDTH)] {
        solids.push(Solid { extent: [wall, (0, STAGE_DEPTH), (0, CEILING)], finish: PANELLED });
    }
    solids
}

/// Terraces of two seat rows each; the last is the aisle along the rear wall.
fn stalls() -> Vec<Solid> {
    let mut solids = Vec::new();
    for step in 0..STALLS_TERRACES {
        let (front, floor) = (STALLS_FROM + TERRACE_DEPTH * step, STALLS_RISE * step);
        solids.push(Solid { extent: [full_width(), (front, LENGTH), (0, floor)], finish: TERRACE });
        if step + 1 < STALLS_TERRACES {
            solids.extend(seat_blocks(front, floor));
        }
    }
    solids
}

/// An overhang with a solid parapet and steeper terraces.
fn balcony() -> Vec<Solid> {
    let edge = BALCONY_FROM - PARAPET_THICKNESS;
    let mut solids = vec![
        Solid { extent: [full_width(), (edge, LENGTH), (BALCONY_UNDERSIDE, BALCONY_FLOOR)], finish: TERRACE },
        Solid {
            extent: [full_width(), (edge, BALCONY_FROM), (BALCONY_UNDERSIDE, PARAPET_TOP)],
            finish: Finish { bottom: "plaster", ..PANELLED },
        },
    ];
    for step in 0..BALCONY_TERRACES {
        let (front, floor) = (BALCONY_FROM + TERRACE_DEPTH * step, BALCONY_FLOOR + BALCONY_RISE * step);
        solids.push(Solid {
            extent: [full_width(), (front, LENGTH), (BALCONY_UNDERSIDE, floor)],
            finish: TERRACE,
        });
        solids.extend(seat_blocks(front, floor));
    }
    solids
}

fn seat_blocks(front: i32, floor: i32) -> impl Iterator<Item = Solid> {
    SEAT_BLOCKS.into_iter().map(move |across| Solid {
        extent: [across, (front + WALKWAY, front + TERRACE_DEPTH), (floor, floor + SEAT_HEIGHT)],
        finish: SEATS,
    })
}

/// Ledges along the side walls at the balcony's height: useful early reflections from their undersides.
fn ledges() -> Vec<Solid> {
    [(-HALF_WIDTH, -100), (100, HALF_WIDTH)]
        .into_iter()
        .map(|across| Solid {
            extent: [
                across,
                (STALLS_FROM, BALCONY_FROM - PARAPET_THICKNESS),
                (BALCONY_UNDERSIDE, BALCONY_FLOOR),
            ],
            finish: Finish { bottom: "plaster", ..PANELLED },
        })
        .collect()
}

/// Two panels hung over the front of the stage and the first row.
fn reflectors() -> Vec<Solid> {
    [(55, 80), (STAGE_DEPTH, STALLS_FROM)]
        .into_iter()
        .map(|along| Solid { extent: [(-38, 38), along, (93, 96)], finish: REFLECTOR })
        .collect()
}
