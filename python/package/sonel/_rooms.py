"""Furnished rooms: boxes and objects in a room, materials for a reverberation time, and random rooms by the thousand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, overload

import numpy as np

from . import _input
from ._sonel import Error

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from . import Scene, _sonel

# Faces of a box whose corner number is 4x + 2y + z.
_BOX_FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
SIDES = ["x0", "x1", "y0", "y1", "z0", "z1"]
UNITS_M = {"m": 1.0, "dm": 0.1, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}

# Entries of the material library that a living room or an office may have.
WALLS = ["brickwork-rendered", "concrete-painted", "plaster-painted", "plaster-wallpaper", "plasterboard-on-studs", "wood-panelling"]
FLOORS = ["floor-parquet", "floor-linoleum", "floor-wood-joists", "carpet-thin", "carpet-heavy-on-concrete", "carpet-soft-10mm"]
CEILINGS = ["plaster-painted", "plasterboard-ceiling", "ceiling-fissured-tile", "ceiling-metal-panel", "acoustic-plaster"]
FURNITURE = ["chipboard-22mm", "door-wooden", "wood-50mm", "chairs-heavy", "chairs-well-upholstered", "chairs-leather"]
WINDOWS = ["glass-window", "glass-window-ordinary", "double-glazing-10mm", "double-glazing-30mm"]
# Size of a person [m], seated or standing.
PERSON_M, HEIGHTS_M = [0.5, 0.3], (1.25, 1.7)


class Parts(NamedTuple):
    """Polygons: corners, corners of each face, indices of all corners, material of each face."""

    points: NDArray[np.float64]
    sizes: NDArray[np.intp]
    corners: NDArray[np.intp]
    names: list[str]


def box(low: NDArray[np.float64], high: NDArray[np.float64], names: list[str]) -> Parts:
    """A box whose six faces, x = low first, have these materials."""
    ends = np.array([low, high])
    points = np.array([[ends[x, 0], ends[y, 1], ends[z, 2]] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    return Parts(points, np.full(6, 4), np.ravel(_BOX_FACES), names)


def joined(parts: Sequence[Parts]) -> Parts:
    """Several parts as one."""
    first = np.cumsum([0, *(len(part.points) for part in parts)])
    corners = [part.corners + begin for part, begin in zip(parts, first)]
    names = [name for part in parts for name in part.names]
    return Parts(
        np.concatenate([part.points for part in parts]),
        np.concatenate([part.sizes for part in parts]),
        np.concatenate(corners),
        names,
    )


def encoded(parts: Parts) -> _sonel.Polygons:
    """Parts as the arrays in bytes that the compiled half takes."""
    used, indices = np.unique(np.asarray(parts.names, dtype=str), return_inverse=True)
    arrays = (parts.points.astype("<f8"), parts.corners.astype("<u4"), parts.sizes.astype("<u4"), indices.astype("<u4"))
    v, c, s, m = (array.tobytes() for array in arrays)
    return v, c, s, m, used.tolist()


def decoded(polygons: _sonel.Polygons) -> Parts:
    """Parts of the arrays in bytes."""
    v, c, s, m, names = polygons
    numbers = np.frombuffer(m, "<u4")
    points = np.frombuffer(v, "<f8").reshape(-1, 3)
    return Parts(points, np.frombuffer(s, "<u4").astype(int), np.frombuffer(c, "<u4").astype(int), [names[i] for i in numbers])


def walls(document: Mapping[str, Any], polygons: _sonel.Polygons | None) -> Parts:
    """The walls of a scene that was made in Python; sides of a shoebox have the materials that are named after them."""
    if polygons is not None:
        return decoded(polygons)
    names = [name if name in document["materials"] else "walls" for name in SIDES]
    return box(np.zeros(3), np.asarray(document["shoebox"], dtype=float), names)


def furnished(
    document: dict[str, Any], polygons: _sonel.Polygons | None, objects: Sequence[_sonel.Polygons]
) -> tuple[dict[str, Any], _sonel.Polygons | None]:
    """Keys and polygons of a scene with its objects."""
    if not objects:
        return document, polygons
    keys = {key: value for key, value in document.items() if key != "shoebox"}
    return keys, encoded(joined([walls(document, polygons), *map(decoded, objects)]))


def _ends(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Smallest and largest coordinates, [2, 3]."""
    return np.array([points.min(axis=0), points.max(axis=0)])


def _text(ends: NDArray[np.float64]) -> str:
    return " to ".join("[" + ", ".join(f"{x:g}" for x in end) + "]" for end in ends)


def space(scene: Scene) -> NDArray[np.float64]:
    """Smallest and largest coordinates of the walls [m], [2, 3]; in the open without end."""
    document, polygons, _ = scene._parts()
    is_open = polygons is not None and scene.room["volume_m3"] is None
    return np.array([[-np.inf] * 3, [np.inf] * 3]) if is_open else _ends(walls(document, polygons).points)


def _within(ends: NDArray[np.float64], space: NDArray[np.float64], what: str) -> None:
    """Refuses what leaves the space between the outermost walls by more than rounding."""
    rounding = 1e-9 * np.ptp(ends)
    if np.any(ends[0] < space[0] - rounding) or np.any(ends[1] > space[1] + rounding):
        raise Error(f"{what} from {_text(ends)} m leaves the room, which is from {_text(space)} m: move it, or make it smaller")


def placed_box(scene: Scene, low: ArrayLike, high: ArrayLike) -> Parts:
    """A box in a room, without material."""
    _, polygons, objects = scene._parts()
    right = "three numbers [x, y, z] in metres"
    ends = np.sort([_input.numbers(low, "low", right, (3,)), _input.numbers(high, "high", right, (3,))], axis=0)
    room = space(scene)
    if polygons is None:
        ends = np.clip(ends, *room)
    if not np.all(ends[0] < ends[1]):
        raise Error(f"the box from {_input.shown(low)} to {_input.shown(high)} has no volume in the room, which is from {_text(room)} m: give two opposite corners")
    _within(ends, room, "the box")
    for other in map(decoded, objects):
        there = _ends(other.points)
        is_box = len(other.points) == 8 and np.all((other.points == there[0]) | (other.points == there[1]))
        if is_box and np.all(np.minimum(ends[1], there[1]) - np.maximum(ends[0], there[0]) > 1e-9 * np.ptp(ends)):
            raise Error(f"the box from {_text(ends)} m overlaps another from {_text(there)} m: move it, or let it end at the faces of that one")
    return box(ends[0], ends[1], [""] * 6)


def faces(mesh: Any, of: str = " of the mesh") -> tuple[NDArray[np.float64], NDArray[np.intp], NDArray[np.intp]]:
    """Vertices of a mesh, corners of each face, and indices of all corners."""
    try:
        vertices, rows = (mesh.vertices, mesh.faces) if hasattr(mesh, "vertices") else mesh
        rings = [np.asarray(row) for row in rows]
    except (TypeError, ValueError, AttributeError) as problem:
        raise Error(f"the mesh is not vertices [N, 3] and faces of indices: {problem}") from None
    points = _input.numbers(vertices, f"vertices{of}", "finite numbers of shape [N, 3]")
    if points.ndim != 2 or points.shape[1] != 3:
        raise Error(f"vertices{of} have the shape {list(points.shape)}: give finite numbers of shape [N, 3]")
    if not rings:
        raise Error(f"faces{of} are none: give at least one, of indices of vertices")
    sizes = np.array([ring.size for ring in rings])
    corners = np.concatenate([ring.reshape(-1) for ring in rings])
    allowed = f"three and more indices of the {len(points)} vertices, counted from 0"
    if corners.dtype.kind not in "iuf":
        raise Error(f"faces{of} are not numbers: give each {allowed}")
    is_index = (corners >= 0) & (corners < len(points)) & (corners == np.floor(corners))
    wrong = np.concatenate([np.repeat(np.arange(len(rings)), sizes)[~is_index], np.flatnonzero(sizes < 3)])
    if len(wrong):
        raise Error(f"faces[{wrong.min()}]{of} is {rings[wrong.min()].tolist()}: give {allowed}")
    return points, sizes, corners.astype(int)


def material(document: Mapping[str, Any], given: Any) -> tuple[str, Any]:
    """Name of the material of an object, and its table where it is new."""
    materials = document["materials"]
    if isinstance(given, str):
        return given, None if given in materials else {"library": given}
    numbers = (number for number in range(1, len(materials) + 2) if f"object {number}" not in materials)
    return f"object {next(numbers)}", given if isinstance(given, Mapping) else {"absorption": given}


def placed(scene: Scene, mesh: Any, at: ArrayLike, turn: float) -> Parts:
    """A mesh about its origin, turned about z [°] and moved into a room, without material."""
    points, sizes, corners = faces(mesh)
    angle = np.radians(_input.numbers(turn, "turn", "an angle in degrees", ()))
    cosine, sine = np.cos(angle), np.sin(angle)
    rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    moved = points @ rotation.T + _input.numbers(at, "at", "three numbers [x, y, z] in metres", (3,))
    _within(_ends(moved), space(scene), "the mesh")
    return Parts(moved, sizes, corners, [])


def absorption_for(scene: Scene, t60: ArrayLike, name: str) -> NDArray[np.float64]:
    """Absorption of a material with which Eyring's formula gives `t60`, [B]."""
    room = scene.room
    materials = {entry["name"]: entry for entry in room["materials"]}
    if name not in materials:
        raise Error(f"there is no material {_input.shown(name)} in the room; it has {', '.join(materials)}")
    bands = scene.center_frequencies.shape
    right = f"a time above 0 s, or one for each of {bands[0]} bands"
    times = _input.numbers(t60, "t60", right)
    if times.shape not in ((), (1,), bands) or not np.all(times > 0):
        raise Error(f"t60 is {_input.shown(t60)}: give {right}")
    wanted = np.broadcast_to(times, bands)
    area, volume = room["area_m2"], room["volume_m3"]
    constant = 24 * np.log(10) / scene.speed_of_sound * volume
    mean = np.array([band["mean_absorption"] for band in room["bands"]])
    eyring = np.array([band["eyring_s"] for band in room["bands"]])
    air = constant / eyring + area * np.log1p(-mean)
    own = materials[name]
    others = mean * area - np.array(own["absorption"]) * own["area_m2"]
    found = (-np.expm1(-(constant / wanted - air) / area) * area - others) / own["area_m2"]
    wrong = np.flatnonzero(~((found >= 0) & (found <= 1)))
    if len(wrong):
        b = wrong[0]
        ends = [(others[b] + coefficient * own["area_m2"]) / area for coefficient in (0.99, 0.01)]
        low, high = (constant / (air[b] - area * np.log1p(-min(end, 0.999))) for end in ends)
        raise Error(
            f"t60 of {wanted[b]:g} s at {scene.center_frequencies[b]:g} Hz needs an absorption of {found[b]:.3f} of {_input.shown(name)}: "
            f"{low:.2f} to {high:.2f} s are possible there with the other materials and the air"
        )
    return np.asarray(found, dtype=float)


class RandomRooms(Sequence["Scene"]):
    """Furnished rooms, each made from its own random numbers when it is asked for. Made by `sonel.random_rooms`."""

    def __init__(self, count: int, options: dict[str, Any]) -> None:
        self._count = count
        self._options = options

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, index: int) -> Scene: ...

    @overload
    def __getitem__(self, index: slice) -> list[Scene]: ...

    def __getitem__(self, index: int | slice) -> Scene | list[Scene]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(self._count))]
        number = int(index) + (self._count if index < 0 else 0)
        if not 0 <= number < self._count:
            raise IndexError(f"there are {self._count} rooms")
        for attempt in range(100):
            found = _room(np.random.default_rng([self._options["seed"], number, attempt]), number, **self._options)
            if found is not None:
                return found
        raise Error(f"room {number}: no place for sources and receivers, or no absorption for t60, in a hundred tries: allow larger rooms, less furniture or other times")

    def __repr__(self) -> str:
        options = ", ".join(f"{name}={value!r}" for name, value in self._options.items())
        return f"sonel.random_rooms({self._count}, {options})"


def _furniture(draw: np.random.Generator, size: NDArray[np.float64], count: int) -> list[tuple[NDArray[Any], NDArray[Any]]]:
    """Boxes on the floor, each at a wall or 0.3 m and more from all else."""
    boxes: list[tuple[NDArray[Any], NDArray[Any]]] = []
    for _ in range(40 * count):
        if len(boxes) == count:
            break
        extent = draw.uniform([0.4, 0.4, 0.4], [1.8, 0.9, min(2.0, size[2] - 0.4)])
        if draw.random() < 0.5:
            extent[:2] = extent[1::-1]
        if np.any(size[:2] - extent[:2] < 0.9):
            continue
        low = np.append(draw.uniform(0.3, size[:2] - extent[:2] - 0.3), 0.0)
        if draw.random() < 0.6:
            axis = int(draw.integers(2))
            low[axis] = draw.choice([0.0, size[axis] - extent[axis]])
        low, extent = np.round(low, 3), np.round(extent, 3)
        high = low + extent
        at_far_wall = np.abs(high[:2] - size[:2]) < 0.01
        high[:2][at_far_wall] = size[:2][at_far_wall]
        if _are_apart(low, high, boxes):
            boxes.append((low, high))
    return boxes


def _are_apart(low: NDArray[Any], high: NDArray[Any], boxes: list[tuple[NDArray[Any], NDArray[Any]]]) -> bool:
    """Whether a box is 0.3 m and more from others on the floor."""
    return all(np.any((low - other_high >= 0.3)[:2] | (other_low - high >= 0.3)[:2]) for other_low, other_high in boxes)


def _people(
    draw: np.random.Generator, size: NDArray[np.float64], count: int, furniture: list[tuple[NDArray[Any], NDArray[Any]]]
) -> list[tuple[NDArray[Any], NDArray[Any]]]:
    """People as boxes, seated or standing, 0.3 m and more from walls and all else."""
    people: list[tuple[NDArray[Any], NDArray[Any]]] = []
    for _ in range(40 * count):
        if len(people) == count:
            break
        extent = np.append(draw.permutation(PERSON_M), draw.choice(HEIGHTS_M))
        low = np.round(np.append(draw.uniform(0.3, size[:2] - extent[:2] - 0.3), 0.0), 3)
        if extent[2] < size[2] and _are_apart(low, low + extent, furniture + people):
            people.append((low, low + extent))
    return people


def _walls(draw: np.random.Generator, size: NDArray[np.float64], openings: int) -> Parts:
    """The walls of a room, the first of these openings a door and the others windows, each in a wall of its own."""
    parts = [box(np.zeros(3), size, ["walls"] * 4 + ["z0", "z1"])]
    if not openings:
        return parts[0]
    pierced = draw.permutation(4)[:openings]
    points, _, corners, names = parts[0]
    kept = [face for face in range(6) if face not in pierced]
    parts = [Parts(points, np.full(len(kept), 4), np.ravel(corners.reshape(6, 4)[kept]), [names[face] for face in kept])]
    for number, face in enumerate(pierced):
        axis, is_far = divmod(int(face), 2)
        along = 1 - axis
        name = "window" if number else "door"
        width, height = draw.uniform([0.8, 1.0], [2.0, 1.5]) if number else draw.uniform([0.8, 2.0], [1.0, 2.1])
        sill = draw.uniform(0.8, 1.0) if number else 0.0
        width, top = min(width, size[along] - 0.4), min(sill + height, size[2] - 0.1)
        left = draw.uniform(0.2, size[along] - width - 0.2)
        left, right, sill, top = np.round([left, left + width, sill, top], 3)
        frame = [(0.0, left, 0.0, size[2]), (right, size[along], 0.0, size[2]), (left, right, top, size[2])]
        if number:
            frame.append((left, right, 0.0, sill))
        for rectangle, material in [((left, right, sill, top), name), *((piece, "walls") for piece in frame)]:
            parts.append(_rectangle(axis, size[axis] * is_far, rectangle, material))
    return joined(parts)


def _rectangle(axis: int, at: float, ends: tuple[float, float, float, float], name: str) -> Parts:
    """An upright rectangle across an axis: its ends along the wall and its height."""
    first, last, low, high = ends
    points = np.zeros((4, 3))
    points[:, axis], points[:, 1 - axis], points[:, 2] = at, [first, last, last, first], [low, low, high, high]
    return Parts(points, np.array([4]), np.arange(4), [name])


def _places(
    draw: np.random.Generator, size: NDArray[np.float64], boxes: Any, count: int, others: list[Any], clearance: float = 0.3
) -> list[Any] | None:
    """Places at 1 to 1.8 m, half a metre or more than `clearance` from walls, more than that from furniture, 1 m from one another; None where
    there is no room."""
    # In whole millimetres.
    wall = max(0.5, np.floor(1000 * clearance + 1) / 1000)
    low, high = np.array([wall, wall, max(1.0, wall)]), np.append(size[:2] - wall, min(1.8, size[2] - wall))
    if np.any(high < low):
        return None
    places: list[Any] = []
    for _ in range(200 * count):
        if len(places) == count:
            return places
        place = np.round(draw.uniform(low, high), 3)
        is_free = all(np.any((place < low - clearance) | (place > high + clearance)) for low, high in boxes)
        if is_free and all(np.linalg.norm(place - other) >= 1.0 for other in [*others, *places]):
            places.append(place)
    return places if len(places) == count else None


def _room(
    draw: np.random.Generator,
    number: int,
    *,
    seed: int,
    size: Any,
    furniture: tuple[int, int],
    t60: list[Any] | None,
    sources: int,
    receivers: int,
    clearance: float,
    keys: dict[str, Any],
    from_library: bool = False,
    people: tuple[int, int] = (0, 0),
    openings: tuple[int, int] = (0, 0),
) -> Scene | None:
    """A room, or None where what was drawn does not fit."""
    from . import Scene

    extent = np.round(draw.uniform(*np.asarray(size, dtype=float)), 3)
    boxes = _furniture(draw, extent, int(draw.integers(furniture[0], furniture[1] + 1)))
    persons = _people(draw, extent, int(draw.integers(people[0], people[1] + 1)), boxes) if people[1] else []
    stages = _places(draw, extent, boxes + persons, sources, [])
    seats = None if stages is None else _places(draw, extent, boxes + persons, receivers, stages, clearance)
    if stages is None or seats is None:
        return None

    def drawn(entries: list[str], scattering: float) -> dict[str, Any]:
        return {"library": entries[int(draw.integers(len(entries)))], "scattering": scattering}

    materials = {"walls": drawn(WALLS, 0.1), "z0": drawn(FLOORS, 0.1), "z1": drawn(CEILINGS, 0.1)}
    parts = [_walls(draw, extent, int(draw.integers(openings[0], openings[1] + 1)) if openings[1] else 0)]
    if "door" in parts[0].names:
        materials["door"] = {"library": "door-wooden", "scattering": 0.1}
    if "window" in parts[0].names:
        materials["window"] = drawn(WINDOWS, 0.1)
    for i, (low, high) in enumerate(persons, 1):
        # As much absorption as one person has in an audience.
        width, depth, height = (high - low).tolist()
        area = 2 * (width + depth) * height + width * depth
        materials[f"person {i}"] = {"absorption": 0.0, "people": 1 / area, "scattering": 0.3}
        parts.append(box(low, high, [f"person {i}"] * 6))
    for i, (low, high) in enumerate(boxes, 1):
        materials[f"furniture {i}"] = drawn(FURNITURE, 0.3)
        parts.append(box(low, high, [f"furniture {i}"] * 6))
    document = {
        "name": f"room {number}",
        **keys,
        "materials": materials,
        "sources": [{"name": f"source {i}", "position": place.tolist()} for i, place in enumerate(stages, 1)],
        "receivers": [{"name": f"receiver {i}", "position": place.tolist()} for i, place in enumerate(seats, 1)],
    }
    scene = Scene._of_document(document, encoded(joined(parts)))
    if t60 is None:
        return scene
    if from_library:
        shortest, longest = np.transpose(t60)
        times = np.array([band["eyring_s"] for band in scene.room["bands"]])
        return scene if np.all((shortest <= times) & (times <= longest)) else None
    try:
        return scene.with_materials({"walls": {"absorption": scene.absorption_for(draw.uniform(*np.transpose(t60))), "scattering": 0.1}})
    except Error:
        return None
