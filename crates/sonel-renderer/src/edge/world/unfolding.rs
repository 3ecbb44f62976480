//! The room unfolded about mirrors: its copies side by side, what stands on a mirror joined with its image.

use glam::DVec3;
use sonel_diffraction::face::Orders;
use sonel_geometry::{Geometry, PlaneId};

use super::super::apart::{Outlook, Pairs, apart};
use super::super::chain::Chain;
use super::super::mirror::PlaneMirror;
use super::super::passage::{Border, Passage, faces, is_convex, passages};
use super::super::view::joined;
use super::{Copy, IN_MIRROR, RoomEdge};

/// Two copies side by side, and the mirror between them as it is in the room.
type Joint = (usize, usize, PlaneMirror);

/// The room unfolded.
pub(super) struct Unfolding<'a> {
    geometry: &'a Geometry,
    /// Resolution [m] of what is in a mirror.
    within: f64,
    pub copies: Vec<Copy>,
    joints: Vec<Joint>,
    /// For each joint the planes that meet its mirror in an edge that diffracts: they go round that and not on in an image.
    round: Vec<Vec<PlaneId>>,
    /// For each copy what of each edge is in it, as it is in the room.
    pieces: Vec<Vec<Option<RoomEdge>>>,
    /// Where each of them is among the unfolded edges.
    places: Vec<Vec<Option<usize>>>,
    pub edges: Vec<RoomEdge>,
    /// Up to where each unfolded edge is in which copy [m].
    pub parts: Vec<Vec<(f64, usize)>>,
}

/// The copies of a room that is unfolded about the mirrors of `chain`, the first one that the receiver is in, and which are side by side.
pub(super) fn copies(chain: &Chain) -> (Vec<Copy>, Vec<Joint>) {
    let copy = |before: &[PlaneMirror], behind: &[PlaneMirror], beside: &[PlaneMirror]| Copy {
        before: Chain::of(before),
        behind: Chain::of(behind),
        beside: beside.to_vec(),
    };
    match *chain.mirrors() {
        [one] => (vec![copy(&[one], &[], &[one]), copy(&[], &[one], &[one])], vec![(0, 1, one)]),
        [one, other] if chain.is_either_way() => {
            let both = [one, other];
            let copies = vec![
                copy(&both, &[], &both),
                copy(&[one], &[other], &both),
                copy(&[other], &[one], &both),
                copy(&[], &both, &both),
            ];
            (copies, vec![(0, 1, other), (0, 2, one), (1, 3, one), (2, 3, other)])
        }
        [one, other] => {
            let copies = vec![
                copy(&[one, other], &[], &[other]),
                copy(&[one], &[other], &[one, other]),
                copy(&[], &[other, one], &[one]),
            ];
            (copies, vec![(0, 1, other), (1, 2, one)])
        }
        _ => (vec![Copy::default()], Vec::new()),
    }
}

impl<'a> Unfolding<'a> {
    /// The room of `real` edges unfolded about the mirrors of `chain`, the first copy the one that the receiver is in.
    pub fn of(geometry: &'a Geometry, real: &[RoomEdge], chain: &Chain) -> Self {
        let (copies, joints) = copies(chain);
        Self::new(geometry, real, copies, joints)
    }

    /// The room of `real` edges for paths that meet `mirror` before the first and after the last edge in the second copy, and nowhere in the
    /// first.
    pub fn behind(geometry: &'a Geometry, real: &[RoomEdge], mirror: &PlaneMirror) -> Self {
        let of = |mirrors: &[PlaneMirror]| Copy {
            before: Chain::of(mirrors),
            behind: Chain::of(mirrors),
            beside: vec![*mirror],
        };
        Self::new(geometry, real, vec![of(&[]), of(&[*mirror])], vec![(0, 1, *mirror)])
    }

    fn new(geometry: &'a Geometry, real: &[RoomEdge], copies: Vec<Copy>, joints: Vec<Joint>) -> Self {
        let within = IN_MIRROR * f64::from(geometry.resolution());
        let before = |edge: &RoomEdge, mirrors: &[PlaneMirror]| {
            mirrors.iter().try_fold(*edge, |edge, mirror| edge.before(mirror, within))
        };
        let pieces: Vec<Vec<Option<RoomEdge>>> =
            copies.iter().map(|copy| real.iter().map(|edge| before(edge, &copy.beside)).collect()).collect();
        let round = joints.iter().map(|(_, _, mirror)| {
            let at_mirror =
                real.iter().filter(|edge| edge.faces.iter().any(|face| face.plane == mirror.plane));
            at_mirror.flat_map(|edge| edge.faces.map(|face| face.plane)).collect()
        });
        let round = round.collect();
        let places = vec![vec![None; real.len()]; copies.len()];
        let (edges, parts) = (Vec::new(), Vec::new());
        let mut unfolding = Self { geometry, within, copies, joints, round, pieces, places, edges, parts };
        for edge in 0..real.len() {
            unfolding.add(edge);
        }
        unfolding
    }

    /// Adds what there is of `edge` in all copies.
    fn add(&mut self, edge: usize) {
        for copy in 0..self.copies.len() {
            let Some(piece) = self.pieces[copy][edge] else { continue };
            if self.places[copy][edge].is_some() {
                continue;
            }
            let place = Some(self.edges.len());
            self.places[copy][edge] = place;
            let RoomEdge { mut wedge, faces } = piece.image(&self.copies[copy].behind.reversed());
            let mut parts = vec![(piece.wedge.length(), copy)];
            let mut last = copy;
            // Copies are numbered from the receiver's on, and what stands on mirrors goes on away from there.
            while let Some((next, foot)) = self.next(edge, last) {
                let length = self.pieces[next][edge].map_or(0.0, |piece| piece.wedge.length());
                let end = wedge.length();
                self.places[next][edge] = place;
                if (foot - wedge.at(0.5 * end)).dot(wedge.direction()) > 0.0 {
                    wedge = wedge.between([0.0, end + length]);
                    parts.push((length, next));
                } else {
                    wedge = wedge.between([-length, end]);
                    parts.insert(0, (length, next));
                }
                last = next;
            }
            let mut end = 0.0;
            for (length, _) in &mut parts {
                end += *length;
                *length = end;
            }
            self.edges.push(RoomEdge { wedge, faces });
            self.parts.push(parts);
        }
    }

    /// The copy in which an edge goes on that is in `copy`, and where it does among the unfolded edges [m].
    fn next(&self, edge: usize, copy: usize) -> Option<(usize, DVec3)> {
        self.joints.iter().enumerate().find_map(|(joint, &(one, other, _))| {
            let is_next = one == copy && self.places[other][edge].is_none();
            let foot = is_next.then(|| self.foot(edge, joint))??;
            Some((other, self.copies[copy].behind.reversed().image(foot)))
        })
    }

    /// Where `edge` stands on the mirror of `joint`, if it goes on beyond it [m].
    fn foot(&self, edge: usize, joint: usize) -> Option<DVec3> {
        let (one, other, mirror) = &self.joints[joint];
        let piece = self.pieces[*one][edge].filter(|_| self.pieces[*other][edge].is_some())?;
        let goes_on = piece.faces.iter().all(|face| !self.round[joint].contains(&face.plane));
        let is_there = |foot: &DVec3| mirror.is_felt(self.geometry, *foot, piece.wedge.into_air());
        piece.foot(mirror, self.within).filter(|_| goes_on).filter(is_there)
    }

    /// Which edge of the room each unfolded one is, or is an image of.
    pub fn originals(&self) -> Vec<usize> {
        let mut originals = vec![0; self.edges.len()];
        for places in &self.places {
            for (edge, place) in places.iter().enumerate() {
                if let Some(place) = place {
                    originals[*place] = edge;
                }
            }
        }
        originals
    }

    /// Whether an edge that is before the mirrors goes on in its image.
    pub fn goes_on(&self, edge: usize) -> Option<bool> {
        self.pieces[0][edge].map(|_| self.foot(edge, 0).is_some())
    }

    /// Whether any part of each unfolded edge is in a copy in which its edge of the room is wanted.
    pub fn holds(&self, in_copies: &[Vec<bool>]) -> Vec<bool> {
        let mut holds = vec![false; self.edges.len()];
        for (copy, places) in self.places.iter().enumerate() {
            for (place, wanted) in places.iter().zip(in_copies) {
                if let Some(place) = place {
                    holds[*place] |= wanted[copy];
                }
            }
        }
        holds
    }

    /// The passages, the ways over edges apart, and the faces among the unfolded edges. Where copies are more than two nothing is followed over
    /// edges apart.
    pub fn ways(&self) -> (Vec<Passage>, Orders, Option<Pairs>, Vec<Vec<Border>>) {
        let faces = self.faces();
        let (mut passages, mut orders) = passages(&self.edges, &faces);
        passages.retain(|way| self.is_mirrored(way));
        orders.along_a_face = passages.iter().any(Passage::is_along_a_face);
        let apart = match self.copies.len() {
            ..=2 => apart(&self.edges, &faces, &passages, |places| self.see_one_another(places)),
            _ => None,
        };
        (passages, orders, apart, faces)
    }

    /// Whether two places on unfolded edges see one another, in one copy or over the mirror between two.
    fn see_one_another(&self, places: [Outlook; 2]) -> bool {
        let in_copy = |&(edge, place, _): &Outlook| {
            let wedge = &self.edges[edge].wedge;
            let along = (place - wedge.at(0.0)).dot(wedge.direction());
            self.parts[edge].iter().find(|(end, _)| along <= *end).map(|(_, copy)| *copy)
        };
        let [Some(one), Some(other)] = places.each_ref().map(in_copy) else { return false };
        let is_between = |joint: &&Joint| [(one, other), (other, one)].contains(&(joint.0, joint.1));
        let between = self.joints.iter().find(is_between).map(|joint| &joint.2);
        let copies = [one, other].map(|copy| &self.copies[copy]);
        let places = [0, 1].map(|of| (copies[of], places[of].1, places[of].2));
        (one == other || between.is_some()) && joined(self.geometry, between, places)
    }

    /// The borders of all faces: in each copy, or of those that stand on mirrors in several at once.
    fn faces(&self) -> Vec<Vec<Border>> {
        let in_copy = |copy: usize| -> Vec<Vec<Border>> {
            let present: Vec<usize> =
                (0..self.pieces[copy].len()).filter(|&edge| self.pieces[copy][edge].is_some()).collect();
            let pieces: Vec<RoomEdge> = present.iter().filter_map(|&edge| self.pieces[copy][edge]).collect();
            let named =
                |face: Vec<Border>| face.into_iter().map(|(piece, of)| (present[piece], of)).collect();
            faces(&pieces).into_iter().map(named).collect()
        };
        let in_copies: Vec<Vec<Vec<Border>>> = (0..self.copies.len()).map(in_copy).collect();
        let mut left: Vec<(usize, usize)> = in_copies
            .iter()
            .enumerate()
            .flat_map(|(copy, faces)| (0..faces.len()).map(move |face| (copy, face)))
            .collect();
        let mut all = Vec::new();
        while let Some(first) = left.pop() {
            let mut whole = vec![first];
            let mut reached = 0;
            while reached < whole.len() {
                let (more, rest) =
                    left.iter().partition(|&&next| self.is_one_face(&in_copies, whole[reached], next));
                whole.extend::<Vec<(usize, usize)>>(more);
                left = rest;
                reached += 1;
            }
            let borders = |&(copy, face): &(usize, usize)| -> Vec<Border> {
                let place = |&(edge, of): &Border| self.places[copy][edge].map(|place| (place, of));
                in_copies[copy][face].iter().filter_map(place).collect()
            };
            let mut joined: Vec<Border> = whole.iter().flat_map(borders).collect();
            joined.sort_unstable();
            joined.dedup();
            let of_sheet = || joined.iter().all(|&(edge, _)| self.edges[edge].wedge.is_rim());
            if whole.len() == 1 || is_convex(&self.edges, &joined) || of_sheet() {
                all.push(joined);
            } else {
                all.extend(whole.iter().map(borders));
            }
        }
        all
    }

    /// Whether two faces, each in a copy, are one and its image that it goes on in.
    fn is_one_face(
        &self,
        faces: &[Vec<Vec<Border>>],
        (copy, face): (usize, usize),
        (next, other): (usize, usize),
    ) -> bool {
        let (near, far) = (&faces[copy][face], &faces[next][other]);
        self.joints.iter().enumerate().any(|(joint, &(one, two, _))| {
            let is_beside = (one, two) == (copy, next) || (two, one) == (copy, next);
            is_beside
                && near.iter().any(|border| far.contains(border))
                && self.stands(copy, near, joint)
                && self.stands(next, far, joint)
        })
    }

    /// Whether a face in `copy` stands on the mirror of `joint` at a right angle.
    fn stands(&self, copy: usize, face: &[Border], joint: usize) -> bool {
        let (mesh, center) = (self.geometry.mesh(), self.geometry.center());
        let (mirror, round) = (&self.joints[joint].2, &self.round[joint]);
        let is_at_foot = |triangle: u32| {
            let corners = mesh.triangles[triangle as usize].corners;
            let height = |corner: u32| mirror.height(mesh.vertices[corner as usize] - center);
            corners.iter().filter(|&&corner| height(corner).abs() <= self.within).count() >= 2
        };
        let planes =
            || face.iter().filter_map(|&(edge, of)| self.pieces[copy][edge].map(|piece| piece.faces[of]));
        planes().all(|plane| mirror.is_across(&plane) && !round.contains(&plane.plane))
            && planes().any(|plane| {
                self.geometry.surface(plane.surface).triangles.iter().any(|&triangle| is_at_foot(triangle))
            })
    }

    /// Whether there is a mirror, which may have an end, between edges that sound passes one after the other on different sides of it.
    fn is_mirrored(&self, way: &Passage) -> bool {
        way.edges.windows(2).all(|pair| {
            let middles = [pair[0], pair[1]].map(|passed| {
                let wedge = &self.edges[passed.edge].wedge;
                wedge.at(0.5 * wedge.length())
            });
            let face = self.edges[pair[0].edge].faces[usize::from(pair[0].at_second[1])];
            let is_in = |copy: usize| {
                pair.iter().any(|passed| self.parts[passed.edge].iter().any(|&(_, of)| of == copy))
            };
            self.joints.iter().filter(|joint| is_in(joint.0) && is_in(joint.1)).all(|(one, _, mirror)| {
                let copy = &self.copies[*one];
                let [from, to] = middles.map(|middle| copy.behind.image(middle));
                let [above, below] = [mirror.height(from), -mirror.height(to)];
                if above * below <= 0.0 {
                    return true;
                }
                let foot = from + (to - from) * (above / (above + below));
                // Beside this joint another one is passed, of the same mirror.
                if copy.beside.iter().any(|other| other.height(foot) < -self.within) {
                    return true;
                }
                let normal = copy.behind.image_of(&face).normal();
                mirror.is_felt(self.geometry, foot, normal)
            })
        })
    }
}
