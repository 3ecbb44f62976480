//! The rooms that base paths meet, unfolded about one mirror or two, and which family each of them belongs to.
//!
//! An image is in the family of the base path that the planes without edges among its mirrors show: those planes end nowhere, so that their
//! image is a base path wherever it is not shaded. In planes with edges an image of that path begins and ends at the edges of the planes.

use sonel_geometry::Geometry;
use sonel_map::CoefficientTable;

use super::apart;
use super::chain::Chain;
use super::family::Course;
use super::mirror::{self, PlaneMirror};
use super::world::{RoomEdge, World};
use super::{Listening, Reflection};

/// Planes that face no edge, as the inner sides of a hollow box, are left out as long as planes times edges are no more than this: looking takes
/// a ray or a few for each pair that sees one another, hundreds for one that does not.
const SEEN_LIMIT: usize = 8000;
/// Base paths with a reflection are diffracted as long as planes times edges are no more than this.
const PAIR_LIMIT: usize = 2000;
/// More passages than this by way of all mirrors, a third of a second for each receiver, and they go without those over three edges of a
/// face, without all over three, or without any.
const PASSAGE_LIMIT: usize = 2048;
/// Images of two reflections are diffracted at no more edges than this, counted in every copy of the room: a fifth of a second if a receiver
/// sees them all.
const TWOFOLD_LIMIT: usize = 2000;
/// The same as for one mirror of passages by way of two.
const TWOFOLD_PASSAGE_LIMIT: usize = 256;

/// All edges as base paths meet them.
pub(super) struct Rooms {
    /// As the direct path does.
    pub direct: World,
    /// As its images in planes with edges, in one or two of them, meet those that are before the planes.
    images: Vec<World>,
    /// What the images of edges add to the direct path, and what is taken away for it.
    behind: Vec<[World; 2]>,
    /// As base paths do that planes without edges mirror, one or two of them. The first of each is the base path, the others are images of it in
    /// a plane with edges.
    mirrored: Vec<Vec<World>>,
}

impl Rooms {
    /// The rooms of `edges`.
    #[must_use]
    pub fn new(geometry: &Geometry, table: &CoefficientTable, edges: Vec<RoomEdge>) -> Self {
        let has_edges = |mirror: &PlaneMirror| {
            edges.iter().any(|edge| edge.faces.iter().any(|face| face.plane == mirror.plane))
        };
        let mut planes = mirror::planes(geometry, table);
        if planes.len() * edges.len() <= SEEN_LIMIT {
            planes.retain(|mirror| edges.iter().any(|edge| mirror.faces_edge(geometry, edge)));
        }
        let (mut with_edges, mut without) = planes.into_iter().partition::<Vec<PlaneMirror>, _>(has_edges);
        if without.len() * edges.len() > PAIR_LIMIT {
            without.clear();
        }
        if (without.len() + with_edges.len()) * edges.len() > PAIR_LIMIT {
            with_edges.clear();
        }
        let mut direct = World::new(geometry, edges);
        let alone = |mirrors: &[PlaneMirror]| -> Vec<World> {
            mirrors.iter().filter_map(|mirror| unfolded(geometry, &direct, &[*mirror])).collect()
        };
        let (mut images, mut mirrored) = (alone(&with_edges), alone(&without));
        let behind = with_edges.iter().chain(&without).map(|mirror| World::behind(geometry, &direct, mirror));
        let mut behind: Vec<[World; 2]> = behind.filter(|[world, _]| !world.edges.is_empty()).collect();
        shorten(
            images.iter_mut().chain(&mut mirrored).chain(behind.iter_mut().flatten()).collect(),
            PASSAGE_LIMIT,
        );
        let in_mirrors = images.iter_mut().chain(&mut mirrored).chain(behind.iter_mut().flatten());
        apart::shorten(&mut in_mirrors.map(|world| &mut world.apart).collect::<Vec<_>>(), PASSAGE_LIMIT);
        direct.shows = images.iter().flat_map(|world| world.shown.mirrors()).copied().collect();
        let mirrored = mirrored.into_iter().map(|world| vec![world]).collect();
        let mut rooms = Self { direct, images, behind, mirrored };
        let both = [&without[..], &with_edges].concat();
        let worlds = twofold(geometry, &rooms.direct, &both)
            .or_else(|| twofold(geometry, &rooms.direct, &without))
            .unwrap_or_default();
        for world in worlds {
            rooms.add(world, &without);
        }
        rooms
    }

    /// Adds the room of an image of two reflections to its family; `without` are the planes without edges.
    fn add(&mut self, world: World, without: &[PlaneMirror]) {
        let is_base = |mirror: &&PlaneMirror| without.iter().any(|other| other.is(mirror));
        let bases: Vec<&PlaneMirror> = world.shown.mirrors().iter().filter(is_base).collect();
        let is_of = |family: &&mut Vec<World>| match (family[0].shown.mirrors(), &bases[..]) {
            ([mirror], [base]) => mirror.is(base),
            _ => false,
        };
        if bases.is_empty() {
            self.images.push(world);
        } else if let Some(family) = self.mirrored.iter_mut().find(is_of) {
            family.push(world);
        } else {
            self.mirrored.push(vec![world]);
        }
    }

    /// The courses of every family, the first one that of its base path. `reflections` are all mirror images of up to two reflections that
    /// reach the receiver.
    #[must_use]
    pub fn families<'a>(&'a self, at: &Listening<'_>, reflections: &[Reflection]) -> Vec<Vec<Course<'a>>> {
        let mut direct = vec![Course::direct(&self.direct, at)];
        // The images in the planes at the edges have one reflection more than their base.
        if at.complete_order < 2 {
            return vec![direct];
        }
        let shown = |worlds: &'a [World]| -> Vec<Course<'a>> {
            worlds.iter().filter_map(|world| Course::image(world, at, reflections)).collect()
        };
        direct.extend(shown(&self.images));
        direct.extend(self.behind.iter().filter_map(|worlds| Course::behind(worlds, at)).flatten());
        let mirrored = self.mirrored.iter().map(|family| shown(family));
        std::iter::once(direct).chain(mirrored.filter(|courses| !courses.is_empty())).collect()
    }
}

/// The room unfolded about `mirrors`, if there is any edge before them.
fn unfolded(geometry: &Geometry, room: &World, mirrors: &[PlaneMirror]) -> Option<World> {
    let world = World::unfolded(geometry, &room.edges, Chain::of(mirrors));
    Some(world).filter(|world| !world.edges.is_empty())
}

/// The room unfolded about all pairs of `mirrors`; [`None`] where that is more than can be followed.
fn twofold(geometry: &Geometry, room: &World, mirrors: &[PlaneMirror]) -> Option<Vec<World>> {
    // Every edge is in three copies or four.
    if mirrors.len() * mirrors.len().saturating_sub(1) * room.edges.len() > 16 * TWOFOLD_LIMIT {
        return None;
    }
    let chains = mirror::chains(geometry, mirrors);
    let mut worlds: Vec<World> = chains.iter().filter_map(|chain| unfolded(geometry, room, chain)).collect();
    if worlds.iter().map(|world| world.edges.len()).sum::<usize>() > TWOFOLD_LIMIT {
        return None;
    }
    let are_whole = shorten(worlds.iter_mut().collect(), TWOFOLD_PASSAGE_LIMIT);
    worlds.iter_mut().for_each(|world| world.is_cut_short = !are_whole);
    Some(worlds)
}

/// Leaves passages over three edges of a face out of `worlds`, over any three, or all, where they are more than `limit` together. Whether
/// those over two are kept.
fn shorten(mut worlds: Vec<&mut World>, limit: usize) -> bool {
    for most in [3, 2, 0] {
        if worlds.iter().map(|world| world.passages.len()).sum::<usize>() <= limit {
            return true;
        }
        worlds.iter_mut().for_each(|world| world.shorten(most));
    }
    false
}
