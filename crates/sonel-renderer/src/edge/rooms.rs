//! The rooms that base paths meet, unfolded about one mirror or two, and which family each of them belongs to.
//!
//! An image is in the family of the base path that the planes without edges among its mirrors show: those planes end nowhere, so that their
//! image is a base path wherever it is not shaded. In planes with edges an image of that path begins and ends at the edges of the planes.
//! Where planes and edges are too many to unfold all of them beforehand they are near each receiver ([`near`](super::near)).

use sonel_geometry::Geometry;
use sonel_map::CoefficientTable;

use super::apart;
use super::beside::{FacePlane, face_planes};
use super::chain::Chain;
use super::family::Course;
use super::hollow::{HollowCorner, hollow_corners};
use super::mirror::{self, PlaneMirror};
use super::near::Near;
use super::world::{RoomEdge, World};
use super::{Listening, Reflection};

/// Planes that face no edge, as the inner sides of a hollow box, are left out as long as planes times edges are no more than this: looking takes
/// a ray or a few for each pair that sees one another, hundreds for one that does not.
const SEEN_LIMIT: usize = 8000;
/// Rooms are unfolded about mirrors as a whole as long as planes times edges are no more than this.
const PAIR_LIMIT: usize = 2000;
/// More passages than this by way of all mirrors, a third of a second for each receiver, and they go without those over three edges of a
/// face, without all over three, or without any.
const PASSAGE_LIMIT: usize = 2048;
/// Images of two reflections are diffracted at all edges where these are no more than this, counted in every copy of the room: a fifth of a
/// second if a receiver sees them all.
const TWOFOLD_LIMIT: usize = 2000;
/// The same as for one mirror of passages by way of two.
const TWOFOLD_PASSAGE_LIMIT: usize = 1024;

/// All edges as base paths meet them.
pub(super) struct Rooms {
    /// As the direct path does.
    pub direct: World,
    /// As images do, in one or two planes.
    unfolded: Vec<World>,
    /// What the images of edges add to the direct path, and what is taken away for it.
    behind: Vec<[World; 2]>,
    /// As images do that have to be unfolded for each receiver.
    near: Near,
    /// The planes without edges.
    without: Vec<PlaneMirror>,
    /// Those of faces at edges.
    pub faces: Vec<FacePlane>,
    /// Those of mirrors that are not at right angles.
    pub corners: Vec<HollowCorner>,
}

impl Rooms {
    /// The rooms of `edges`.
    #[must_use]
    pub fn new(geometry: &Geometry, table: &CoefficientTable, edges: Vec<RoomEdge>) -> Self {
        let has_edges =
            |mirror: &PlaneMirror| edges.iter().any(|edge| edge.faces.iter().any(|face| face.is(mirror)));
        let mut planes = mirror::planes(geometry, table);
        if planes.len() * edges.len() <= SEEN_LIMIT {
            planes.retain(|mirror| edges.iter().any(|edge| mirror.faces_edge(geometry, edge)));
        }
        let without: Vec<PlaneMirror> = planes.iter().filter(|mirror| !has_edges(mirror)).copied().collect();
        let are_few = |mirrors: &&[PlaneMirror]| mirrors.len() * edges.len() <= PAIR_LIMIT;
        let whole = [&planes[..], &without].into_iter().find(are_few).unwrap_or_default();
        let mut direct = World::new(geometry, edges);
        let mut unfolded: Vec<World> = whole
            .iter()
            .filter_map(|mirror| World::about(geometry, &direct, Chain::of(&[*mirror])))
            .collect();
        let behind = whole.iter().map(|mirror| World::behind(geometry, &direct, mirror));
        let mut behind: Vec<[World; 2]> = behind.filter(|[world, _]| !world.edges.is_empty()).collect();
        shorten(unfolded.iter_mut().chain(behind.iter_mut().flatten()).collect(), PASSAGE_LIMIT);
        let in_mirrors = unfolded.iter_mut().chain(behind.iter_mut().flatten());
        apart::shorten(&mut in_mirrors.map(|world| &mut world.apart).collect::<Vec<_>>(), PASSAGE_LIMIT);
        let in_mirrors = unfolded.iter_mut().chain(behind.iter_mut().map(|[with_images, _]| with_images));
        in_mirrors.for_each(World::hide);
        direct.shows = unfolded.iter().flat_map(|world| world.shown.mirrors()).copied().collect();
        let twofold = [whole, &without].into_iter().find_map(|mirrors| twofold(geometry, &direct, mirrors));
        unfolded.extend(twofold.unwrap_or_default());
        let near = near(geometry, &direct, &planes, &unfolded, &without);
        let faces = face_planes(&direct);
        let corners = hollow_corners(geometry, &mirror::planes(geometry, table));
        Self { direct, unfolded, behind, near, without, faces, corners }
    }

    /// The rooms about the receiver's images that are not unfolded as a whole, for wave numbers of at least `smallest_k` [1/m].
    #[must_use]
    pub fn near(&self, at: &Listening<'_>, smallest_k: f64) -> Vec<World> {
        if at.complete_order < 2 { Vec::new() } else { self.near.rooms(&self.direct.edges, at, smallest_k) }
    }

    /// The courses of every family, the first one that of its base path; `near` are the rooms about the receiver's images.
    /// `reflections` are all mirror images of up to two reflections that reach the receiver.
    #[must_use]
    pub fn families<'a>(
        &'a self,
        near: &'a [World],
        at: &Listening<'_>,
        reflections: &[Reflection],
    ) -> Vec<Vec<Course<'a>>> {
        let mut direct = vec![Course::direct(&self.direct, at)];
        // The images in the planes at the edges have one reflection more than their base.
        if at.complete_order < 2 {
            return vec![direct];
        }
        let mut mirrored: Vec<(Vec<PlaneMirror>, Vec<Course<'a>>)> = Vec::new();
        for world in self.unfolded.iter().chain(near) {
            let Some(course) = Course::image(world, at, reflections) else { continue };
            let bases = self.bases(world);
            let is_of = |family: &&mut (Vec<PlaneMirror>, _)| matches!((&family.0[..], &bases[..]), ([one], [other]) if one.is(other));
            match mirrored.iter_mut().find(is_of) {
                _ if bases.is_empty() => direct.push(course),
                Some((_, family)) => family.push(course),
                None => mirrored.push((bases, vec![course])),
            }
        }
        direct.extend(self.behind.iter().filter_map(|worlds| Course::behind(worlds, at)).flatten());
        std::iter::once(direct).chain(mirrored.into_iter().map(|(_, family)| family)).collect()
    }

    /// The planes without edges among the mirrors of `world`.
    fn bases(&self, world: &World) -> Vec<PlaneMirror> {
        let is_base = |mirror: &&PlaneMirror| self.without.iter().any(|other| other.is(mirror));
        world.shown.mirrors().iter().filter(is_base).copied().collect()
    }
}

/// What of the room about one of `planes` or two is not among `unfolded`; families begin with those about a plane that is among `bases`.
fn near(
    geometry: &Geometry,
    room: &World,
    planes: &[PlaneMirror],
    unfolded: &[World],
    bases: &[PlaneMirror],
) -> Near {
    let alone = planes.iter().map(|mirror| Chain::of(&[*mirror]));
    let pairs = mirror::chains(geometry, planes).into_iter().map(|pair| Chain::of(&pair));
    let is_known = |chain: &Chain| unfolded.iter().any(|world| world.shown.is(chain));
    let is_base = |chain: &Chain| match chain.mirrors() {
        [mirror] => bases.iter().any(|base| base.is(mirror)),
        _ => false,
    };
    let chains = alone.chain(pairs).filter(|chain| !is_known(chain));
    Near::new(geometry, &room.edges, chains.map(|chain| (is_base(&chain), chain)))
}

/// The room unfolded about all pairs of `mirrors`; [`None`] where that is more than can be followed.
fn twofold(geometry: &Geometry, room: &World, mirrors: &[PlaneMirror]) -> Option<Vec<World>> {
    // Every edge is in three copies or four.
    if mirrors.len() * mirrors.len().saturating_sub(1) * room.edges.len() > 16 * TWOFOLD_LIMIT {
        return None;
    }
    let pairs = mirror::chains(geometry, mirrors);
    let mut worlds: Vec<World> =
        pairs.iter().filter_map(|pair| World::about(geometry, room, Chain::of(pair))).collect();
    if worlds.iter().map(|world| world.edges.len()).sum::<usize>() > TWOFOLD_LIMIT {
        return None;
    }
    shorten(worlds.iter_mut().collect(), TWOFOLD_PASSAGE_LIMIT);
    Some(worlds)
}

/// Leaves passages over three edges of a face out of `worlds`, over any three, or all, where they are more than `limit` together.
fn shorten(mut worlds: Vec<&mut World>, limit: usize) {
    for most in [3, 2, 0] {
        if worlds.iter().map(|world| world.passages.len()).sum::<usize>() <= limit {
            return;
        }
        worlds.iter_mut().for_each(|world| world.shorten(most));
    }
}
