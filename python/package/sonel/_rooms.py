"""Furnished rooms: boxes and objects in a room, materials for a reverberation time, and random rooms by the thousand."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ._sonel import Error

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from . import Scene, _sonel

# Faces of a box whose corner number is 4x + 2y + z.
_BOX_FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
_WALLS = ["x0", "x1", "y0", "y1", "z0", "z1"]

# Entries of the material library that a living room or an office may have.
WALLS = ["brickwork-rendered", "concrete-painted", "plaster-painted", "plaster-wallpaper", "plasterboard-on-studs", "wood-panelling"]
FLOORS = ["floor-parquet", "floor-linoleum", "floor-wood-joists", "carpet-thin", "carpet-heavy-on-concrete", "carpet-soft-10mm"]
CEILINGS = ["plaster-painted", "plasterboard-ceiling", "ceiling-fissured-tile", "ceiling-metal-panel", "acoustic-plaster"]
FURNITURE = ["chipboard-22mm", "door-wooden", "wood-50mm", "chairs-heavy", "chairs-well-upholstered", "chairs-leather"]


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


def decoded(document: Mapping[str, Any], polygons: _sonel.Polygons | None) -> Parts:
    """The walls of a scene that was made in Python."""
    if polygons is None:
        materials = document["materials"]
        names = [name if name in materials else "walls" for name in _WALLS]
        return box(np.zeros(3), np.asarray(document["shoebox"], dtype=float), names)
    v, c, s, m, names = polygons
    numbers = np.frombuffer(m, "<u4")
    points = np.frombuffer(v, "<f8").reshape(-1, 3)
    return Parts(points, np.frombuffer(s, "<u4").astype(int), np.frombuffer(c, "<u4").astype(int), [names[i] for i in numbers])


def corner(position: ArrayLike, what: str) -> NDArray[np.float64]:
    """Three finite numbers."""
    try:
        numbers = np.asarray(position, dtype=float)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (3,) or not np.all(np.isfinite(numbers)):
        raise Error(f"{what} is {position!r}: give three numbers [x, y, z] in metres")
    return numbers


def added(document: Mapping[str, Any], polygons: _sonel.Polygons | None, part: Parts, name: str, table: Any) -> tuple[Any, Any]:
    """Document and polygons with another part, of a material that is there or comes with its table."""
    materials = dict(document["materials"])
    if table is not None:
        materials[name] = table
    changed = {key: value for key, value in document.items() if key != "shoebox"}
    return {**changed, "materials": materials}, encoded(joined([decoded(document, polygons), part]))


def material(document: Mapping[str, Any], given: Any) -> tuple[str, Any]:
    """Name of the material of an object, and its table where it is new."""
    materials = document["materials"]
    if isinstance(given, str):
        return given, None if given in materials else {"library": given}
    numbers = (number for number in range(1, len(materials) + 2) if f"object {number}" not in materials)
    return f"object {next(numbers)}", given if isinstance(given, Mapping) else {"absorption": given}


def turned(mesh: Any, at: ArrayLike, turn: float, name: str) -> Parts:
    """A mesh about its origin, turned about z [°] and moved."""
    vertices, faces = (mesh.vertices, mesh.faces) if hasattr(mesh, "vertices") else mesh
    try:
        points = np.asarray(vertices, dtype=float)
        rows = [np.asarray(face, dtype=int) for face in faces]
        angle = np.radians(float(turn))
    except (TypeError, ValueError) as problem:
        raise Error(f"the mesh is not vertices [N, 3] and faces of indices: {problem}") from None
    if points.ndim != 2 or points.shape[1] != 3 or not rows:
        raise Error(f"the vertices of the mesh have the shape {list(points.shape)}: give [N, 3] in metres, and faces of indices")
    corners = np.concatenate(rows)
    if corners.min() < 0 or corners.max() >= len(points):
        raise Error(f"the mesh has {len(points)} vertices, counted from 0, and faces with the indices {corners.min()} to {corners.max()}")
    cosine, sine = np.cos(angle), np.sin(angle)
    rotation = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    moved = points @ rotation.T + corner(at, "at")
    return Parts(moved, np.array([len(row) for row in rows]), corners, [name] * len(rows))


def absorption_for(scene: Scene, t60: ArrayLike, name: str) -> NDArray[np.float64]:
    """Absorption of a material with which Eyring's formula gives `t60`, [B]."""
    room = scene.room
    materials = {entry["name"]: entry for entry in room["materials"]}
    if name not in materials:
        raise Error(f"there is no material {name!r} in the room; it has {', '.join(materials)}")
    wanted = np.broadcast_to(np.asarray(t60, dtype=float), scene.center_frequencies.shape)
    if not np.all(wanted > 0):
        raise Error(f"t60 is {t60!r}: give a time above 0 s, or one per band")
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
            f"t60 of {wanted[b]:g} s at {scene.center_frequencies[b]:g} Hz needs an absorption of {found[b]:.3f} of {name!r}: "
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

    def __getitem__(self, index: Any) -> Any:
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
        apart = [np.any((low - other_high >= 0.3)[:2] | (other_low - high >= 0.3)[:2]) for other_low, other_high in boxes]
        if all(apart):
            boxes.append((low, high))
    return boxes


def _places(draw: np.random.Generator, size: NDArray[np.float64], boxes: Any, count: int, others: list[Any]) -> list[Any] | None:
    """Places at 1 to 1.8 m, half a metre from walls, 0.3 m from furniture, 1 m from one another; None where there is no room."""
    places: list[Any] = []
    for _ in range(200 * count):
        if len(places) == count:
            return places
        place = np.round(draw.uniform([0.5, 0.5, 1.0], [size[0] - 0.5, size[1] - 0.5, min(1.8, size[2] - 0.5)]), 3)
        is_free = all(np.any((place < low - 0.3) | (place > high + 0.3)) for low, high in boxes)
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
    t60: tuple[float, float] | None,
    sources: int,
    receivers: int,
    keys: dict[str, Any],
) -> Scene | None:
    """A room, or None where what was drawn does not fit."""
    from . import Scene

    extent = np.round(draw.uniform(*np.asarray(size, dtype=float)), 3)
    boxes = _furniture(draw, extent, int(draw.integers(furniture[0], furniture[1] + 1)))
    stages = _places(draw, extent, boxes, sources, [])
    seats = None if stages is None else _places(draw, extent, boxes, receivers, stages)
    if stages is None or seats is None:
        return None

    def drawn(entries: list[str], scattering: float) -> dict[str, Any]:
        return {"library": entries[int(draw.integers(len(entries)))], "scattering": scattering}

    materials = {"walls": drawn(WALLS, 0.1), "z0": drawn(FLOORS, 0.1), "z1": drawn(CEILINGS, 0.1)}
    parts = [box(np.zeros(3), extent, ["walls"] * 4 + ["z0", "z1"])]
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
    try:
        return scene.with_materials({"walls": {"absorption": scene.absorption_for(draw.uniform(*t60)), "scattering": 0.1}})
    except Error:
        return None
