//! Conforming meshes: any two triangles share a corner, a side, all of both, or nothing.
//!
//! Drawings are not so: walls end in the middle of others, cross them, or lie on them. Between faces that touch without
//! sharing corners a ray may slip through, and what lies behind is then in doubt. Here every triangle is divided along all
//! lines in which others touch or cross it, and faces that overlap in one plane are divided alike. The ray test
//! is watertight where corners are shared, so it is for whatever people draw, and no other rule is needed where faces meet.
//!
//! A pass finds the contacts of all pairs of triangles ([`contact`]), divides the lines on each face where they meet
//! ([`arrangement`]) and triangulates what is between them. Points nearer to one another than the tolerance are one. New
//! corners may touch further sides within the tolerance, so passes are repeated on the triangles that have changed; most
//! meshes need two. Faces that coincide are united later ([`crate::layers`]).
//!
//! Valid for details well above the tolerance. Reference: [Shewchuk1996] (docs/references.md), by the crate spade.

mod arrangement;
mod contact;
mod overhangs;

use crate::layers::{Stack, stacks};
use crate::stitch::share_along;
use crate::topology::Connected;
use crate::weld::{Points, has_area};
use crate::{Crossing, GeometryError, Mesh, MeshTriangle};
use arrangement::{FaceTrace, Lines};
use contact::{Contact, Meeting};
use foldhash::{HashMap, HashSet};
use smallvec::SmallVec;

/// Most passes; each divides what the one before brought within the tolerance of a side. Chosen, not measured: the loop ends when nothing is
/// left, doubled it only ends later on a mesh that never does.
const PASSES: usize = 6;

/// Most crossings of lines on faces: up to a minute of a processor, since each makes two triangles or more of 22 µs. Of triangles at random the number
/// grows as their third power; 250 in a room are below it.
const MOST_CROSSINGS: usize = 500_000;

/// Corners in the interior of a side, by the side's ends, the lower first.
type OnSides = HashMap<[u32; 2], SmallVec<[u32; 4]>>;

/// Findings in a mesh before it conformed.
pub(crate) struct Conformed {
    /// Crossings of faces.
    pub crossings: Vec<Crossing>,
    /// Triangles that coincide.
    pub stacks: Vec<Stack>,
}

/// Divides triangles until the mesh conforms within `tolerance` [m].
///
/// Triangles keep their order; the parts of divided ones follow at the end.
///
/// # Errors
/// [`GeometryError::Tangled`] with more than [`MOST_CROSSINGS`].
pub(crate) fn conform(mesh: &mut Mesh, tolerance: f64) -> Result<Conformed, GeometryError> {
    let mut points = None;
    let mut changed: Option<HashSet<u32>> = None;
    let mut on_sides = OnSides::default();
    let mut drawn: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
    let mut crossings = Vec::new();
    for pass in 0..PASSES {
        let meetings = contact::find(mesh, changed.as_ref(), tolerance);
        if pass == 0 {
            crossings.extend(meetings.iter().filter_map(Meeting::crossing));
        }
        if meetings.is_empty() && on_sides.is_empty() {
            break;
        }
        let points = points.get_or_insert_with(|| Points::new(tolerance, &mesh.vertices));
        let parts = divided(mesh, points, &meetings, std::mem::take(&mut on_sides), tolerance)?;
        if parts.is_empty() {
            break;
        }
        changed = Some(replace(mesh, &mut drawn, parts, points, &mut on_sides, tolerance));
    }
    if points.is_some() {
        overhangs::cut_off(mesh, &mut drawn);
    }
    Ok(Conformed { crossings, stacks: stacks(mesh, &drawn) })
}

/// Triangles that are divided, each with its parts.
type Parts = Vec<(u32, Vec<[u32; 3]>)>;

/// Divides the triangles that meet others, or have corners `on_sides`; `points` gets the new corners.
fn divided(
    mesh: &mut Mesh,
    points: &mut Points,
    meetings: &[Meeting],
    mut on_sides: OnSides,
    tolerance: f64,
) -> Result<Parts, GeometryError> {
    let mut groups = grouped(mesh, points, meetings);
    let mut count = 0;
    for lines in &mut groups {
        count += lines.divide(mesh, points, tolerance, &mut on_sides);
        if count > MOST_CROSSINGS {
            return Err(GeometryError::Tangled { most: MOST_CROSSINGS });
        }
    }
    mesh.vertices.clone_from(&points.places);
    let known: HashSet<u32> = groups.iter().flat_map(|lines| lines.faces.iter().copied()).collect();
    groups.extend(
        beside(mesh, &on_sides).filter(|face| !known.contains(face)).map(|face| Lines::new(vec![face])),
    );
    Ok(groups.iter().filter_map(|lines| lines.triangulated(mesh, tolerance, &on_sides)).flatten().collect())
}

/// Faces that have to be divided together, since they overlap, each group with the lines in which others meet it.
fn grouped(mesh: &Mesh, points: &mut Points, meetings: &[Meeting]) -> Vec<Lines> {
    let mut connected = Connected::new(mesh.triangles.len());
    for Meeting { faces: [a, b], contact, .. } in meetings {
        if matches!(contact, Contact::Overlap) {
            connected.join(*a, *b);
        }
    }
    let mut faces: Vec<u32> = meetings.iter().flat_map(|meeting| meeting.faces).collect();
    faces.sort_unstable();
    faces.dedup();
    let mut groups: Vec<Lines> = connected.groups(faces).into_iter().map(Lines::new).collect();
    let of_face: HashMap<u32, usize> = (0..)
        .zip(&groups)
        .flat_map(|(group, lines)| lines.faces.iter().map(move |&face| (face, group)))
        .collect();
    for Meeting { faces, contact, .. } in meetings {
        let piece = match contact {
            Contact::Overlap => continue,
            Contact::Along(ends) => FaceTrace::Line(ends.map(|end| points.join(end))),
            Contact::At(place) => FaceTrace::Point(points.join(*place)),
        };
        for &face in faces {
            groups[of_face[&face]].add(piece);
        }
    }
    groups
}

/// Faces with a side that has corners on it, in ascending order.
fn beside<'a>(mesh: &'a Mesh, on_sides: &'a OnSides) -> impl Iterator<Item = u32> + 'a {
    let is_beside = move |face: &u32| {
        mesh.triangles[*face as usize].sides().iter().any(|side| on_sides.contains_key(side))
    };
    let count = if on_sides.is_empty() { 0 } else { mesh.triangles.len() as u32 };
    (0..count).filter(is_beside)
}

/// Puts parts in the place of the triangles they are of; returns the triangles that have changed.
///
/// A part lower than the tolerance is left out, as a triangle that is drawn so is: its normal would be rounding.
fn replace(
    mesh: &mut Mesh,
    drawn: &mut Vec<u32>,
    mut parts: Parts,
    points: &mut Points,
    on_sides: &mut OnSides,
    tolerance: f64,
) -> HashSet<u32> {
    parts.sort_by_key(|(face, _)| *face);
    let mut changed = HashSet::default();
    for (face, parts) in parts {
        let whole = mesh.triangles[face as usize];
        let has_area =
            |corners: &[u32; 3]| has_area(corners.map(|corner| mesh.vertices[corner as usize]), tolerance);
        let (parts, flat): (Vec<[u32; 3]>, Vec<[u32; 3]>) = parts.into_iter().partition(has_area);
        for corners in flat {
            for (side, corner) in closing(mesh, points, MeshTriangle { corners, ..whole }, &parts) {
                on_sides.entry(side).or_default().push(corner);
            }
        }
        for (at, corners) in parts.into_iter().enumerate() {
            let index = if at == 0 { face } else { mesh.triangles.len() as u32 };
            let part = MeshTriangle { corners, ..whole };
            if at == 0 {
                mesh.triangles[face as usize] = part;
            } else {
                mesh.triangles.push(part);
                drawn.push(drawn[face as usize]);
            }
            changed.insert(index);
        }
    }
    changed
}

/// Corners on sides that close the gap of a `flat` part, whose apex is on its longest side. The part beyond that side gets a corner opposite to the
/// apex too: a narrow strip with corners on one side alone has no triangles but flat ones.
fn closing(mesh: &Mesh, points: &mut Points, flat: MeshTriangle, parts: &[[u32; 3]]) -> Vec<([u32; 2], u32)> {
    let place = |corner: u32| mesh.vertices[corner as usize];
    let length = |[from, to]: [u32; 2]| place(from).distance(place(to));
    let sides = flat.sides().into_iter();
    let side = sides.max_by(|a, b| length(*a).total_cmp(&length(*b))).expect("a triangle has sides");
    let apex = *flat.corners.iter().find(|corner| !side.contains(corner)).expect("a triangle has an apex");
    let is_beyond = |part: &&[u32; 3]| side.iter().all(|end| part.contains(end)) && !part.contains(&apex);
    let beyond = parts.iter().find(is_beyond).map(|&corners| MeshTriangle { corners, ..flat }.sides());
    let mut corners = vec![(side, apex)];
    for other in beyond.into_iter().flatten().filter(|other| *other != side) {
        let ends = other.map(place);
        if let Some(share) = share_along(ends, place(apex), f64::INFINITY) {
            corners.push((other, points.join(ends[0].lerp(ends[1], share))));
        }
    }
    corners
}
