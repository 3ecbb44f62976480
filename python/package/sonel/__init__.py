"""Room acoustics by sonel mapping: trace a scene once, render it at any receivers.

    import sonel
    scene = sonel.Scene.shoebox([10, 7, 3], 0.2, sources=[2, 2, 1.5])
    map = sonel.trace(scene, packets=50_000)
    response = map.render([[6, 4, 1.2], [8, 5, 1.2]])
    response.parameters()["t30_s"]                      # [source, receiver, band], seconds

Results are those of the programs sonel-trace, sonel-render and sonel-analyze, byte for byte. Bad input raises `sonel.Error`
with their message. Long work releases the interpreter's lock and stops at KeyboardInterrupt. Notes and warnings go to the
logger "sonel". `docs/python.md` in the repository has examples.
"""

from __future__ import annotations

import hashlib
import importlib
import logging
import os
import struct
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, Union

import numpy as np

from . import _fit, _input, _rooms, _sonel
from ._fit import Fit
from ._rooms import RandomRooms
from ._sonel import Error, __version__
from ._sphere import rigid_sphere

if TYPE_CHECKING:
    import pandas
    import pyfar  # type: ignore[import-untyped]
    import xarray
    from numpy.typing import ArrayLike, NDArray

__all__ = ["Error", "Fit", "Map", "RandomRooms", "Response", "Scene", "__version__", "check", "dataset", "fit", "library", "random_rooms", "rigid_sphere", "trace"]

_Path = Union[str, "os.PathLike[str]"]
_Progress = Union[None, bool, Callable[[str, float], object]]
_Points = Union["ArrayLike", Mapping[str, Any]]
_Materials = Union["ArrayLike", Mapping[str, Any]]
_Whole = Union[int, "np.integer[Any]"]

# Arrays of docs/formats/response.md but format_version and digest.
_LATERAL = ["lateral_energy", "lateral_energy_batches", "lateral_kernel_difference_batches"]
_CROSS = [key.replace("lateral", "lateral_cross", 1) for key in _LATERAL]
_KEYS = (
    "center_frequency_hz time_edges_s receiver_name receiver_position_m receiver_directivity receiver_aim receiver_diffuse_sensitivity "
    "source_name source_position_m source_power_level_db speed_of_sound characteristic_impedance direct_time_s energy batch_weight "
    "batch_time_edges_s energy_batches kernel_difference_batches lateral_axis"
).split()
_KEYS += [*_LATERAL, *_CROSS, "direction_moment", "missing_fluence", "missing_decay_rate"]
_KEYS += [f"arrival_{name}" for name in ("source", "receiver", "time_s", "energy", "direction", "order", "kind")]
_KEYS += ["metadata_json"]

_Loaded = TypeVar("_Loaded")
_Entered = TypeVar("_Entered", bound="_Managed")

_LOGGER = logging.getLogger("sonel")


def _log(level: int, text: str) -> None:
    _LOGGER.log(level, "%s", _input.in_python(text))


def _worked(work: Callable[..., _Loaded], *arguments: Any, **keywords: Any) -> _Loaded:
    """What a function of the compiled half returns; in its messages functions of this package stand for commands."""
    try:
        return work(*arguments, **keywords)
    except Error as problem:
        raise Error(_input.in_python(str(problem))) from None


class _Missing(Error, FileNotFoundError):
    """A file that is not there."""


def _loaded(load: Callable[[str], _Loaded], path: str) -> _Loaded:
    """What a file holds; one that is not there is a FileNotFoundError too."""
    try:
        return load(path)
    except Error as error:
        raise (Error if os.path.lexists(path) else _Missing)(_input.in_python(str(error))) from None


class _Managed:
    """What a `with` statement closes at its end, by leaving go of everything that it holds."""

    def close(self) -> None:
        """Releases memory, and the file of a map; any use after that is an `Error`. Arrays of a response stay readable."""
        self.__dict__.clear()

    def __enter__(self: _Entered) -> _Entered:
        """Itself; the `with` statement ends with `close`."""
        if not self.__dict__:
            raise self._closed()
        return self

    def __exit__(self, *_: object) -> None:
        """As `close`."""
        self.close()

    def __copy__(self: _Entered) -> _Entered:
        return self

    def __deepcopy__(self: _Entered, _: Any) -> _Entered:
        """Nothing can be changed: a copy is the same."""
        return self

    def _closed(self) -> Error:
        kind = type(self).__name__
        return Error(f"this sonel.{kind} is closed: use it within its with statement, or make it again")

    # Type checkers shall go on to name attributes that there are not.
    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            """Attributes of a closed object."""
            if name in ("_inner", "_origin", "_path") and not self.__dict__:
                raise self._closed()
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")


class Scene(_Managed):
    """A room with materials, sources and receivers, read and checked.

    Made by `Scene.load`, `Scene.shoebox` or `Scene.from_mesh`. Positions are in metres, in the axes of the mesh.
    """

    def __init__(self, inner: _sonel.Scene, origin: tuple[Callable[..., Scene], Any]) -> None:
        self._inner = inner
        self._origin = origin

    def __reduce__(self) -> tuple[Callable[..., Scene], Any]:
        """A scene of a file is read again where it is unpickled; one made in Python is made again."""
        return self._origin

    @classmethod
    def load(cls, path: _Path) -> Scene:
        """The scene in a file (docs/formats/scene.md) and the mesh that it names.

        Parameters
        ----------
        path
            A file `scene.toml`.

        Returns
        -------
        Scene
            The scene, read and checked.

        Raises
        ------
        Error
            A file that is missing (also a FileNotFoundError), damaged or invalid.
        """
        path = os.path.abspath(os.fspath(path))
        return cls(_loaded(lambda name: _sonel.Scene.load(name, _log), path), (cls.load, (path,)))

    @classmethod
    def shoebox(
        cls,
        size: ArrayLike,
        materials: _Materials,
        *,
        sources: _Points,
        receivers: _Points | None = None,
        **keys: Any,
    ) -> Scene:
        """A rectangular room with one corner at the origin.

        Parameters
        ----------
        size
            Inner lengths [x, y, z] [m].
        materials
            One absorption coefficient (0 … 1) or library entry for all walls, or a mapping from "walls", "x0", "x1", "y0", "y1", "z0", "z1"
            to materials ("x0" is the wall at x = 0). A material is a number, the name of a library entry, or a mapping with the keys of
            [materials.NAME], such as {"absorption": [0.1, …], "scattering": 0.3}; one number, or one per band.
        sources
            Positions [m], shape [3] or [S, 3], or a mapping from names to positions or to mappings with the keys of [[sources]], such as
            {"stage": {"position": [2, 2, 1.5], "power_level_db": 94}}.
        receivers
            Likewise, [3] or [R, 3]; they can also be given to `Map.render`.
        **keys
            Other keys of the scene file: name, duration_s [s], bands, air, …

        Returns
        -------
        Scene
            The scene, checked.

        Raises
        ------
        Error
            Bad input: what is wrong, where, and what is allowed.
        """
        return cls._made({"shoebox": size, **keys}, None, materials, sources, receivers)

    @classmethod
    def from_mesh(
        cls,
        vertices: Any,
        faces: ArrayLike | Sequence[Sequence[int]] | None = None,
        materials: _Materials | None = None,
        *,
        sources: _Points,
        receivers: _Points | None = None,
        face_materials: Sequence[str] | None = None,
        **keys: Any,
    ) -> Scene:
        """A room of polygons.

        Parameters
        ----------
        vertices
            Positions [m], or in the unit of the key `mesh_unit`, shape [N, 3]; or an object that has `vertices` and `faces`, such as those of
            trimesh, without the argument `faces`.
        faces
            Indices of vertices, from 0, shape [M, 3] or [M, K], or M sequences of different lengths; either sense.
        materials
            As for `Scene.shoebox`, but the names are free. Required.
        sources
            As for `Scene.shoebox`.
        receivers
            As for `Scene.shoebox`.
        face_materials
            The name of the material of each face, [M]; not needed where there is one material.
        **keys
            As for `Scene.shoebox`. Sources, receivers and objects are in metres, whatever `mesh_unit` is.

        Returns
        -------
        Scene
            The scene, checked.

        Raises
        ------
        Error
            Bad input: what is wrong, where, and what is allowed.
        """
        if materials is None:
            raise Error("materials is None: give a coefficient, an entry of the library, or a mapping from names to materials")
        if "shoebox" in keys:
            raise Error("a mesh has no key shoebox: its faces are the walls")
        points, sizes, corners = _rooms.faces(vertices if faces is None else (vertices, faces), "")
        # A unit that there is not stays for the message.
        scale = _rooms.UNITS_M.get(str(keys.get("mesh_unit")))
        if scale is not None:
            keys.pop("mesh_unit")
            points = points * scale
        names = _face_materials(len(sizes), list(_materials(materials)), face_materials)
        return cls._made(keys, _rooms.encoded(_rooms.Parts(points, sizes, corners, names)), materials, sources, receivers)

    @classmethod
    def _made(
        cls,
        keys: dict[str, Any],
        polygons: _sonel.Polygons | None,
        materials: _Materials,
        sources: _Points,
        receivers: _Points | None,
    ) -> Scene:
        document = {**keys, "materials": _materials(materials), "sources": _points(sources, "source")}
        if receivers is not None:
            document["receivers"] = _points(receivers, "receiver")
        return cls._of_document(document, polygons)

    @classmethod
    def _of_document(cls, document: dict[str, Any], polygons: Any, objects: tuple[Any, ...] = ()) -> Scene:
        inner = _worked(_sonel.Scene.made, *_rooms.furnished(document, polygons, objects), _log)
        return cls(inner, (cls._of_document, (document, polygons, objects)))

    def _parts(self) -> tuple[dict[str, Any], Any, tuple[Any, ...]]:
        """Keys, polygons of the walls where they are no shoebox, and polygons of each object of a scene made in Python."""
        arguments = self._origin[1]
        if len(arguments) != 3:
            raise Error("a scene of a file cannot be changed: make it with Scene.shoebox or Scene.from_mesh, or edit the file")
        document, polygons, objects = arguments
        return document, polygons, objects

    def _with_object(self, part: _rooms.Parts, material: _Materials) -> Scene:
        """The same room with an object, whose material has no name yet."""
        document, polygons, objects = self._parts()
        name, table = _rooms.material(document, material)
        materials = document["materials"] if table is None else {**document["materials"], name: table}
        named = part._replace(names=[name] * len(part.sizes))
        return self._of_document({**document, "materials": materials}, polygons, (*objects, _rooms.encoded(named)))

    def add_box(self, low: ArrayLike, high: ArrayLike, material: _Materials = 0.1) -> Scene:
        """The same room with a box in it: furniture, a pillar, a screen.

        Parameters
        ----------
        low, high
            Two opposite corners [m]. Faces may lie in walls and in faces of other boxes. Of a box in a shoebox what is beyond the walls is cut off;
            a box that leaves the space between the outermost walls of another closed room, or that overlaps another box, is an error.
        material
            A number, a material of the scene, an entry of the library, or a mapping with the keys of [materials.NAME].

        Returns
        -------
        Scene
            Another scene; this one stays as it is.

        Raises
        ------
        Error
            A scene of a file, or bad input.
        """
        return self._with_object(_rooms.placed_box(self, low, high), material)

    def add_object(self, mesh: Any, material: _Materials = 0.1, *, at: ArrayLike = (0, 0, 0), turn: float = 0.0) -> Scene:
        """The same room with a closed mesh in it.

        It is not checked whether the mesh crosses walls or other objects: then volume and areas are wrong.

        Parameters
        ----------
        mesh
            Vertices [N, 3] in metres about its own origin and faces of their indices, or an object that has `vertices` and `faces`, such as
            those of trimesh.
        material
            As for `add_box`, of all its faces.
        at
            Where its origin goes [m].
        turn
            About the z axis through its origin [°], from x to y.

        Returns
        -------
        Scene
            Another scene; this one stays as it is.

        Raises
        ------
        Error
            A scene of a file, a mesh that leaves the space between the outermost walls, or bad input.
        """
        return self._with_object(_rooms.placed(self, mesh, at, turn), material)

    def with_materials(self, materials: _Materials) -> Scene:
        """The same room with other materials; those that are not named stay.

        Parameters
        ----------
        materials
            In the form of `Scene.shoebox`; names of materials of the scene, and of the sides of a shoebox, also with objects in it.

        Returns
        -------
        Scene
            Another scene; this one stays as it is.

        Raises
        ------
        Error
            A scene of a file, a name that no face has, or bad input.
        """
        document, polygons, objects = self._parts()
        changed = _materials(materials)
        known = [*document["materials"], *(_rooms.SIDES if polygons is None else [])]
        for name in changed:
            if name not in known:
                raise Error(f"no face is of the material {_input.shown(name)}: the room has {', '.join(dict.fromkeys(known))}")
        return self._of_document({**document, "materials": {**document["materials"], **changed}}, polygons, objects)

    def with_sources(self, sources: _Points) -> Scene:
        """The same room with other sources: with microphones in their place a `walk` is the path of a source that they hear (docs/formats/sound.md).

        Parameters
        ----------
        sources
            As for `Scene.shoebox`.

        Returns
        -------
        Scene
            Another scene; this one stays as it is.

        Raises
        ------
        Error
            A scene of a file, or bad input.
        """
        document, polygons, objects = self._parts()
        return self._of_document({**document, "sources": _points(sources, "source")}, polygons, objects)

    def absorption_for(self, t60: ArrayLike, material: str = "walls") -> NDArray[np.float64]:
        """Absorption of a material with which Eyring's formula gives a reverberation time, for `with_materials`.

        In rooms that are not diffuse T30 differs from Eyring's.

        Parameters
        ----------
        t60
            Time [s], one for all bands or one per band. Other materials and the air stay. In rooms that are not diffuse T30 differs from Eyring's.
        material
            Its name.

        Returns
        -------
        NDArray[np.float64]
            Absorption coefficients, 0 … 1, shape [B].

        Raises
        ------
        Error
            What no coefficient from 0 to 1 gives, with the times that are possible.
        """
        return _rooms.absorption_for(self, t60, material)

    def save(self, folder: _Path) -> Path:
        """Writes a scene made in Python as scene.toml, and its mesh beside it, for the programs.

        Parameters
        ----------
        folder
            Made where there is none; files that are there are not replaced.

        Returns
        -------
        Path
            The path of scene.toml.

        Raises
        ------
        Error
            A scene of a file, or files that are there.
        """
        return Path(self._inner.save(os.fspath(folder)))

    @property
    def toml(self) -> str:
        """The text of the scene file."""
        return self._inner.toml()

    def check(self) -> dict[str, Any]:
        """The checkup of `sonel-trace check --json` (docs/interface.md).

        Returns
        -------
        dict[str, Any]
            Sizes, areas, statistical times, faults of the mesh.
        """
        return self._inner.check()

    @property
    def room(self) -> dict[str, Any]:
        """Sizes, areas and statistical times: the entry `room` of `check`, without a search for faults."""
        return self._inner.room()

    @property
    def name(self) -> str:
        """Its name for people."""
        return self._inner.name

    @property
    def duration(self) -> float:
        """Length of the echograms [s]; without `duration_s` the least, a trace may need more."""
        return self._inner.duration

    @property
    def speed_of_sound(self) -> float:
        """[m/s]."""
        return self._inner.speed_of_sound

    @property
    def center_frequencies(self) -> NDArray[np.float64]:
        """Nominal band centres [Hz], shape [B]."""
        return np.array(self._inner.center_frequencies)

    @property
    def materials(self) -> list[str]:
        """Names of the materials."""
        return self._inner.materials

    @property
    def sources(self) -> dict[str, tuple[float, float, float]]:
        """Positions of the sources by name [m]."""
        return {name: (x, y, z) for name, (x, y, z) in self._inner.sources}

    @property
    def receivers(self) -> dict[str, tuple[float, float, float]]:
        """Positions of the scene's receivers by name [m]."""
        return {name: (x, y, z) for name, (x, y, z) in self._inner.receivers}

    def plot_room(self, ax: Any = None) -> Any:
        """Draws walls, sources and receivers of a scene made in Python in three dimensions, by matplotlib.

        Parameters
        ----------
        ax
            Three-dimensional axes of matplotlib; without them a new figure.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.

        Raises
        ------
        Error
            A scene of a file, or no matplotlib.
        """
        from . import _drawing

        return _drawing.room(self, ax)

    def _repr_html_(self) -> str:
        """A table for notebooks."""
        from . import _drawing

        points = [("source", self.sources), ("receiver", self.receivers)]
        rows = [[kind, name, *(f"{x:g}" for x in place)] for kind, named in points for name, place in named.items()]
        return _drawing.table(["", "name", "x [m]", "y [m]", "z [m]"], rows, f"Scene {self.name}: {', '.join(self.materials)}")

    def __repr__(self) -> str:
        if not self.__dict__:
            return "<sonel.Scene, closed>"
        return f"<sonel.Scene {self.name!r}: {len(self.sources)} sources, {len(self.receivers)} receivers>"


def check(path: _Path) -> dict[str, Any]:
    """The checkup of a scene file (docs/interface.md).

    Parameters
    ----------
    path
        A scene file, which need not be valid.

    Returns
    -------
    dict[str, Any]
        What `sonel-trace check --json` prints.

    Raises
    ------
    Error
        A file that cannot be read; what is wrong in the scene is in the report.
    """
    return _loaded(_sonel.Scene.check_file, os.fspath(path))


def library() -> dict[str, dict[str, Any]]:
    """The shipped materials (docs/materials.md), which scenes call by their names.

    Returns
    -------
    dict[str, dict[str, Any]]
        By name: `group`, `text` and `source` of the numbers; `absorption` and `scattering` in the octaves 63 … 8000 Hz, shape [8], NaN in those
        that the source does not have, where scenes take the nearest one.
    """

    def octaves(found: tuple[float, list[float]] | None) -> NDArray[np.float64]:
        values = np.full(8, np.nan)
        if found is not None:
            first = round(np.log2(found[0] / 62.5))
            values[first : first + len(found[1])] = found[1]
        return values

    return {
        name: {"group": group, "text": text, "source": source, "absorption": octaves(absorption), "scattering": octaves(scattering)}
        for (name, group, text, source), (absorption, scattering) in _sonel.library()
    }


def trace(
    scene: Scene,
    *,
    packets: _Whole | float | None = None,
    until: str | None = None,
    at_most: float | str | None = None,
    memory: float | None = None,
    seed: _Whole | None = None,
    batches: _Whole | None = None,
    survival: float | None = None,
    mode: str | None = None,
    spectral: str | None = None,
    duration: float | None = None,
    effects: str | None = None,
    variants: Mapping[str, Any] | None = None,
    extend: Map | None = None,
    threads: _Whole | None = None,
    progress: _Progress = None,
) -> Map:
    """Traces `scene`; the map is that of sonel-trace with the options of the same names (docs/interface.md).

    Parameters
    ----------
    scene
        A scene with sources.
    packets
        Packets per source (and band with `spectral` per-band); with `extend` of the whole new map, with `until` the
        maximum (default 16 000).
    until
        Add packets until the half-width of every 95 % interval meets its target, such as t30<1%,level<0.1dB,c80<0.2jnd;
        `report["until"]["reached"]` says whether it does. The map is that of `packets` with the final number. Parameters: level, g, edt, t20, t30, c50,
        c80, d50, ts; units: %, s, ms, dB, jnd.
    at_most
        Time limit, such as 60s, 5min, 2h (default 10 min): a run that is predicted to take longer on all cores is refused
        before it starts, `until` ends with what it has.
    memory
        Own memory that the run may take [bytes], such as 8G: one that is predicted to take more is refused before it
        starts. Not with `until`.
    seed
        Seed of every random number (default 1).
    batches
        Batches whose spread gives the intervals, 1 … 4096 (default 32).
    survival
        Survival exponent β of the Russian roulette, 0 (no roulette) … 1 (default 0.15).
    mode
        Method: accurate, or paper: per-band paths, β = 1 and diffraction of the founding paper (default accurate).
    spectral
        Whether bands share their paths: shared or per-band (default shared).
    duration
        Length of the echograms [s], at most 3600 (default of the scene, or as long as the room decays).
    effects
        Simulated effects: auto, all or none, then changes such as auto,-air; auto:1 omits effects below 1
        just-noticeable difference, auto below 0.1 (default auto).
    variants
        Other materials that the map carries besides, for `Map.render(set=…)`: {"materials.ceiling.absorption": [0.02, 0.9]}, values that
        are one number or one per band, or a range "0.02:0.9"; also scattering, diffuse, transmission, sound_reduction_db;
        {"materials.ceiling": ["plaster-painted"]}, entries of the library.
    extend
        A map of the same scene that is continued to `packets` or `until`, with its own settings.
    threads
        Default all cores; the result does not depend on it.
    progress
        True prints the share done to stderr, False nothing, None prints where stderr is a terminal or a notebook. A function is called with
        what is being done and the share done, 0 … 1.

    Returns
    -------
    Map
        The map, in a temporary file. `report["until"]["reached"]` says whether `until` was reached.

    Raises
    ------
    Error
        Bad input, such as a scene without sources.
    """
    keywords = {
        "packets": packets,
        "until": until,
        "at_most": _input.USUAL_TIME if at_most is None else at_most,
        "memory": memory,
        "seed": seed,
        "batches": batches,
        "survival": survival,
        "mode": mode,
        "spectral": spectral,
        "duration": duration,
        "effects": effects,
        "variants": variants,
        "extend": None if extend is None else _input.of_kind(extend, Map, "extend", "a sonel.Map")._inner,
        "threads": threads,
    }
    scene = _input.of_kind(scene, Scene, "scene", "a sonel.Scene, such as Scene.load(path)")
    with _Text(progress) as follower:
        return Map(_worked(_sonel.trace, scene._inner, _log, follower, **keywords))


def random_rooms(
    count: _Whole,
    *,
    seed: _Whole = 1,
    size: ArrayLike = ((3.0, 3.0, 2.4), (8.0, 6.0, 3.5)),
    furniture: tuple[int, int] = (2, 8),
    t60: ArrayLike | None = None,
    from_library: bool = False,
    sources: _Whole = 1,
    receivers: _Whole = 1,
    clearance: float = 0.3,
    people: tuple[int, int] = (0, 0),
    openings: tuple[int, int] = (0, 0),
    **keys: Any,
) -> RandomRooms:
    """Rectangular rooms with boxes as furniture, for `dataset`: a sequence whose rooms are made when they are asked for.

    Parameters
    ----------
    count
        How many rooms.
    seed
        Room i depends on seed and i alone.
    size
        Smallest and largest lengths [x, y, z] [m], shape [2, 3].
    furniture
        Fewest and most boxes on the floor, at most 100; a small room may have fewer.
    t60
        Shortest and longest Eyring time [s], for which the walls get their absorption; without it all materials are entries of the library.
        One range, in which one time is drawn for all bands, or one per band, shape [B, 2], in each of which one is drawn.
    from_library
        With `t60`: the walls, too, are entries of the library, and rooms are drawn anew until their times are within the range of each band.
    sources, receivers
        How many of each, at most 100: 1 to 1.8 m high, 0.5 m from walls, 0.3 m from furniture, 1 m apart.
    clearance
        Least distance of receivers from furniture, and beyond 0.5 m from walls [m], at most 1.2: more than the radius of an array about them.
    people
        Fewest and most people, at most 100, seated or standing: boxes of 0.5 × 0.3 m, 1.25 or 1.7 m high, each with the absorption of one person
        in an audience (`audience-1` of the library). A small room may have fewer.
    openings
        Fewest and most walls with an opening, at most 4: the first a door, the others windows.
    **keys
        Other keys of the scene file: bands, air, …; not those of walls and materials.

    Returns
    -------
    RandomRooms
        A sequence of scenes.

    Raises
    ------
    Error
        Bad input: what is wrong, where, and what is allowed.
    """
    right = "smallest and largest [x, y, z], 2 to 1000 m each"
    extents = _input.numbers(size, "size", right, (2, 3))
    if not np.all((2.0 <= extents[0]) & (extents[0] <= extents[1]) & (extents[1] <= 1000.0)):
        raise Error(f"size is {_input.shown(size)}: give {right}")
    right = "the shortest and the longest time above 0 s, or both for every band"
    times = None if t60 is None else np.atleast_2d(_input.numbers(t60, "t60", right))
    if times is not None and (times.shape[1:] != (2,) or not np.all((0.0 < times[:, 0]) & (times[:, 0] <= times[:, 1]))):
        raise Error(f"t60 is {_input.shown(t60)}: give {right}")
    apart = float(_input.numbers(clearance, "clearance", "0.3 to 1.2 m", ()))
    if not 0.3 <= apart <= 1.2:
        raise Error(f"clearance is {apart:g} m: give 0.3 to 1.2 m")
    for key in {"materials", "shoebox", "mesh", "mesh_unit", "mesh_up"}.intersection(keys):
        raise Error(f"{key} is not a key of random rooms, which have their own walls and materials: leave it out")
    options = {
        "seed": _input.whole(seed, "seed", 0, _input.SEED),
        "size": extents.tolist(),
        "furniture": _input.counts(furniture, "furniture", "the fewest and the most boxes", 100),
        "t60": times if times is None else times.squeeze(0).tolist() if len(times) == 1 else times.tolist(),
        "sources": _input.whole(sources, "sources", 1, 100),
        "receivers": _input.whole(receivers, "receivers", 1, 100),
        "clearance": apart,
    }
    # What is not asked for is not named: folders of earlier data sets stay those of their rooms.
    for name, given, right, most in (("people", people, "people", 100), ("openings", openings, "walls with an opening", 4)):
        if any(counts := _input.counts(given, name, f"the fewest and the most {right}", most)):
            options[name] = counts
    if not isinstance(from_library, (bool, np.bool_)):
        raise Error(f"from_library is {_input.shown(from_library)}: True or False")
    if from_library:
        options["from_library"] = True
    return RandomRooms(_input.whole(count, "count", 1, sys.maxsize), {**options, "keys": keys})


def dataset(
    rooms: Sequence[Scene],
    out: _Path,
    *,
    microphones: _Points | None = None,
    ambix: _Whole | None = None,
    hrtf: _Path | None = None,
    within: Sequence[float] = (),
    workers: _Whole | None = None,
    shard_size: _Whole = 16,
    shards: Iterable[_Whole] | None = None,
    format: str = "npz",  # noqa: A002 - the word for it
    sample_rate: _Whole | float = 16_000,
    seed: _Whole | None = None,
    early: _Whole = 16,
    realisations: _Whole | None = None,
    duration: float | None = None,
    trace: Mapping[str, Any] | None = None,
    render: Mapping[str, Any] | None = None,
    progress: _Progress = None,
) -> list[Path]:
    """Writes impulse responses of many rooms with labels, in shards (docs/python.md#rooms-by-the-thousand).

    The bytes do not depend on `workers`. A shard appears when it is complete: the same call goes on after a run that was killed.

    Parameters
    ----------
    rooms
        Scenes with sources and receivers, all of the same bands, such as those of `random_rooms`.
    out
        A folder, made where there is none. In it `dataset.json` states rooms and options, `README.md` where the data come from; a folder with
        shards of others is refused.
    microphones
        An array about each receiver, as `array` of `Response.impulse_responses`; without it a single omnidirectional one. Where one is
        more than 1 m away, all are receivers of a second rendering, and may stand anywhere in the room.
    ambix, hrtf
        As for `Response.impulse_responses`, instead of `microphones`; directions are rendered.
    within
        Targets beside `ir`: for each time t [s] `ir_within_T`, T in ms, has what comes up to t after direct sound, 0 direct sound alone.
    workers
        Rooms at a time (default all cores).
    shard_size
        Rooms per file.
    shards
        Numbers of the shards to write, from 0 (default all): jobs of a cluster that share a folder write one each.
    format
        npz, tar of WebDataset, h5 (HDF5, needs h5py) or zarr (a group in a ZIP file, needs zarr 3).
    sample_rate
        As for `Response.impulse_responses`.
    seed
        Of the pulses (default that of the map), mixed with the number of the room: room i has the pulses of
        `impulse_responses(seed=int(np.random.SeedSequence([seed, i]).generate_state(1, np.uint64)[0] >> 1))`.
    early
        How many of the strongest listed arrivals are labels.
    realisations
        How many other realisations of late sound are read, 4 or more (default none): then what is read from `ir` has `_low` and `_high`, between
        which the mean of all realisations is in 95 of 100 cases.
    duration
        Length of the impulse responses [s] (default 1.2 times the longest Sabine time of the room).
    trace, render
        Options of these functions but `threads` and `progress` (default packets 4000; order 2, rays 256, effects -diffraction).
    progress
        As for `trace`, in rooms, by tqdm where that is installed.

    Returns
    -------
    list[Path]
        Paths of the shards.

    Raises
    ------
    Error
        Bad input, or a folder of other rooms or options.
    """
    from . import _dataset

    options: dict[str, Any] = {
        "sample_rate": _rate(sample_rate),
        "seed": None if seed is None else _input.whole(seed, "seed", 0, _input.SEED),
        "early": _input.whole(early, "early"),
        "realisations": 0 if realisations is None else _input.whole(realisations, "realisations", 4),
        "duration": duration,
        "channels": {} if microphones is None else {"array": microphones},
        "within": [float(time) for time in _input.numbers(within, "within", "times after direct sound [s]").reshape(-1)],
    }
    for name, value in (("ambix", ambix), ("hrtf", hrtf)):
        if value is not None:
            options["channels"][name] = value
    order, head, _ = _channels(**options["channels"])
    options["head"] = None if head is None else hashlib.sha256(head).hexdigest()
    options["trace"] = {"packets": 4000} if trace is None else dict(trace)
    options["render"] = {"order": 2, "rays": 256, "effects": "-diffraction"} if render is None else dict(render)
    if order is not None or head is not None:
        options["render"].setdefault("directions", True)
    return _dataset.write(
        rooms,
        Path(out),
        workers=None if workers is None else _input.whole(workers, "workers", 1),
        shard_size=_input.whole(shard_size, "shard_size", 1),
        shards=shards,
        form=format,
        options=options,
        progress=progress,
    )


def fit(
    map: Map,  # noqa: A002 - what it is
    measured: Mapping[str, ArrayLike],
    *,
    sigma: Mapping[str, ArrayLike] | None = None,
    receivers: _Points | None = None,
    materials: Sequence[str] | None = None,
    prior_sigma: float = 0.5,
    rays: _Whole | float | None = None,
    threads: _Whole | None = None,
    progress: _Progress = None,
) -> Fit:
    """Absorption of materials with which a room has measured, or wanted, parameters. Needs scipy.

    Least squares of the deviations in standard deviations and of what is believed (docs/what-if.md). Errors of measurement count as independent.

    Parameters
    ----------
    map
        The map of the room; its absorption is what is believed before the measurement.
    measured
        Values by the keys of `Response.parameters`, such as {"t20_s": …, "clarity_c80_db": …}, each one number for all or of a shape that
        broadcasts to [S, R, B]; NaN where nothing was measured.
    sigma
        Their standard deviations, likewise (default half a just-noticeable difference).
    receivers
        Where it was measured, as for `Map.render`.
    materials
        Names of those that may change (default all).
    prior_sigma
        Standard deviation w of what is believed, in y = ln((α − τ)/(1 − α)): 0.5 is ± 65 % of small coefficients and ± 0.12 in the middle.
    rays
        Visibility rays per receiver, as for `Map.render`.
    threads, progress
        As for `trace`.

    Returns
    -------
    Fit
        Absorption with 95 % intervals, and which of it the data determine.

    Raises
    ------
    Error
        scipy is missing; bad input; coefficients that the paths of the map do not carry, with the command that traces those that do.
    """
    map = _input.of_kind(map, Map, "map", "a sonel.Map of the room")  # noqa: A001 - what it is
    options = {"rays": rays, "threads": threads, "progress": progress}
    return _fit.fit(map, measured, sigma, receivers, materials, prior_sigma, options)


class Map(_Managed):
    """Where sound went in a room: paths in a file, from which any receivers are rendered. Made by `trace` or `Map.load`."""

    def __init__(self, inner: _sonel.Map) -> None:
        self._inner = inner
        # Where it may be loaded from.
        self._path = inner.path
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    @classmethod
    def load(cls, path: _Path) -> Map:
        """Opens a map of sonel-trace.

        Parameters
        ----------
        path
            A file `.sonelmap`.

        Returns
        -------
        Map
            The map. It stays on disk and may be larger than memory.

        Raises
        ------
        Error
            A file that is missing (also a FileNotFoundError), damaged or invalid.
        """
        return cls(_loaded(_sonel.Map.load, os.fspath(path)))

    def save(self, path: _Path) -> None:
        """Writes the map as sonel-trace would.

        Parameters
        ----------
        path
            An existing map is replaced, any other file is not.

        Raises
        ------
        Error
            Another file is there, or it cannot be written.
        """
        is_map = lambda begin: begin.startswith(b"SONELMAP")  # noqa: E731
        self._inner.save(_input.output(os.fspath(path), "a sonel map", is_map, self._inner.path))
        self._path = self._path or Path(path).absolute()

    def render(
        self,
        receivers: _Points | None = None,
        *,
        set: Mapping[str, Any] | None = None,  # noqa: A002 - the name of the option
        variant: str | None = None,
        materials: _Path | None = None,
        grid: str | Sequence[ArrayLike] | None = None,
        audience: str | Sequence[str] | None = None,
        spacing: float | None = None,
        height: float | None = None,
        bin: float | None = None,  # noqa: A002 - the name of the option
        estimator: str | None = None,
        effects: str | None = None,
        rays: _Whole | float | None = None,
        radius: float | None = None,
        order: _Whole | None = None,
        batches: _Whole | None = None,
        seed: _Whole | None = None,
        temperature: float | None = None,
        humidity: float | None = None,
        air: bool = True,
        directions: bool = False,
        until: str | None = None,
        at_most: float | str | None = None,
        memory: float | None = None,
        threads: _Whole | None = None,
        progress: _Progress = None,
    ) -> Response:
        """Renders echograms; the response is that of sonel-render with the options of the same names (docs/interface.md).

        `grid` may also be three axes of one number or evenly spaced ones, such as [np.linspace(1, 9, 5), [2, 4, 6], 1.5].

        Parameters
        ----------
        receivers
            Positions [m], shape [3] or [R, 3] (named "receiver 1" …), or a mapping from names to positions or to mappings with the keys of
            [[receivers]], such as {"mic": {"position": [6, 4, 1.2], "directivity": "cardioid", "aim": [1, 0, 0]}}, aim required unless
            omni; None stands for those of the scene, which an empty array or mapping does not.
        set
            Other coefficients on the same map: {"materials.walls.absorption": 0.4}, one number or one per band; also scattering, diffuse,
            transmission, sound_reduction_db, and "sources.NAME.directivity".
        variant
            A variant of the scene file, [variants.NAME]; its materials replace those of the scene before `materials` and `set`.
        materials
            Change materials: a TOML file of [materials.NAME] as in a scene file, applied before `set`; others stay.
        grid
            Grid of receivers: each axis lo:hi:n or one number [m]. Points on surfaces, in solids or outside the room
            are left out.
        audience
            Receivers above every face of this material, or of several, numbered "MATERIAL 1" …
        spacing
            Horizontal distance of the receivers of `audience` [m] (default 1).
        height
            Height of the receivers of `audience` above the faces [m] (default 1.2).
        bin
            Width of a time bin [s]; at most 2²⁰ bins (default 0.001).
        estimator
            Estimator for each path class: auto, connection, gather, sphere or paper. Paper needs even air and excludes
            `order`; maps with a gradient take auto, connection, sphere, without `order` (default auto).
        effects
            Effects of the rendering: auto, or changes such as -diffraction (no sound over edges), -boundary (low frequencies
            as rays have them); other effects are decided by the trace (default auto).
        rays
            Visibility rays per receiver; with `until` the maximum (default a quarter of the packets; 16384 with
            `estimator` paper).
        radius
            Radius of the discs in which sonels are gathered [m] (default from room and number of packets).
        order
            Highest order of image sources (default from the room).
        batches
            Render the first K batches of the map alone: a share of the time, wider intervals. Not with `until` (default
            all).
        seed
            Of the rendering (default of the map).
        temperature, humidity
            Other air [°C], [%].
        air
            False: no attenuation by air.
        directions
            Also store energies by direction of incidence, for LF, LFC and L_J. Receivers must be omnidirectional. The
            lateral axis is horizontal, at right angles to the aim, by default towards the first source.
        until, at_most
            Take more batches, then more rays, until the intervals are narrow enough; `at_most` as for `trace`.
        memory
            Own memory that the rendering may take [bytes], such as 8G: one that is predicted to take more is refused
            before it starts (default three quarters of the machine's).
        threads, progress
            As for `trace`.

        Returns
        -------
        Response
            Echograms of all sources at all receivers.

        Raises
        ------
        Error
            Bad input, such as a receiver in a wall.
        """
        keywords = {
            "set": set,
            "variant": variant,
            "materials": None if materials is None else os.fspath(materials),
            "grid": grid if grid is None or isinstance(grid, str) else _grid(grid),
            "audience": [audience] if isinstance(audience, str) else audience,
            "spacing": spacing,
            "height": height,
            "bin": bin,
            "estimator": estimator,
            "effects": effects,
            "rays": rays,
            "radius": radius,
            "order": order,
            "batches": batches,
            "seed": seed,
            "temperature": temperature,
            "humidity": humidity,
            "air": air,
            "directions": directions,
            "until": until,
            "at_most": _input.USUAL_TIME if at_most is None else at_most,
            "memory": _input.usable_memory() if memory is None else memory,
            "threads": threads,
        }
        with _Text(progress) as follower:
            return Response(_worked(self._inner.render, self._places(receivers), _log, follower, **keywords))

    @staticmethod
    def _places(receivers: _Points | None) -> list[_sonel.Receiver]:
        places = [] if receivers is None else [_receiver(**point) for point in _points(receivers, "receiver")]
        if receivers is not None and not places:
            raise Error("receivers is empty: give positions, or None for the receivers of the scene")
        return places

    def sensitivity(
        self,
        receivers: _Points | None = None,
        *,
        coefficient: str = "absorption",
        set: Mapping[str, Any] | None = None,  # noqa: A002 - the name of the option
        rays: _Whole | float | None = None,
        threads: _Whole | None = None,
        progress: _Progress = None,
    ) -> NDArray[np.void]:
        """Derivatives of parameters by a coefficient of every material, from one rendering: what sonel-analyze sensitivity prints.

        Parameters
        ----------
        receivers
            As for `render`.
        coefficient
            "absorption" or "scattering".
        set, rays
            As for `render`.
        threads, progress
            As for `trace`.

        Returns
        -------
        NDArray[np.void]
            A structured array of shape [S, R, M, B], the materials in the order of `materials`. Fields: each parameter of `Response.parameters`
            that every receiver has, such as t30_s, its derivative per unit of the coefficient, as NAME_low and NAME_high the limits of its
            95 % interval, and as NAME_value the parameter itself in this rendering, the same for all materials. Edges do not diffract. NaN
            where no packet depends on the coefficient.

        Raises
        ------
        Error
            Bad input: what is wrong, where, and what is allowed.
        """
        options = {"rays": rays, "threads": threads, "progress": progress}
        value, *_, slope, half_width = self._derivatives(receivers, coefficient, set, options)
        keys = [key for key, _, _ in _fit.PARAMETERS]
        found = np.empty(slope.shape[1:], dtype=[(key + end, "f8") for key in keys for end in ("", "_low", "_high", "_value")])
        for key, own, middle, half in zip(keys, value, slope, half_width):
            found[key], found[f"{key}_low"], found[f"{key}_high"] = middle, middle - half, middle + half
            found[f"{key}_value"] = own[:, :, None]
        return found

    def _derivatives(
        self, receivers: _Points | None, coefficient: str, set: Mapping[str, Any] | None, options: dict[str, Any]  # noqa: A002
    ) -> list[NDArray[np.float64]]:
        """Values, values without each batch, weights of the batches, derivatives with the material last but one, halves of their intervals."""
        keywords = {"set": set, "rays": options["rays"], "threads": options["threads"]}
        with _Text(options["progress"]) as follower:
            found = _worked(self._inner.sensitivity, self._places(receivers), coefficient, _log, follower, **keywords)
        return [np.asarray(array) for array in found]

    def refine(self, receivers: _Points | None = None, **options: Any) -> Iterator[Response]:
        """Renders as `render` does, again and again, each time with twice the batches.

        Leave the loop when the intervals are narrow enough.

        Parameters
        ----------
        receivers
            As for `render`.
        **options
            Those of `render` but `batches`, `until` and `at_most`.

        Yields
        ------
        Response
            Responses with their intervals, the first after an eighth of the time, the last that of the whole map.

        Raises
        ------
        Error
            Bad input: what is wrong, where, and what is allowed.
        """
        _input.check_keywords(options, Map.render, "refine", {"receivers", "batches", "until", "at_most"})
        for batches in self._inner.refinement_steps:
            yield self.render(receivers, batches=batches, **options)

    def walk(
        self,
        path: ArrayLike,
        signal: ArrayLike,
        *,
        sample_rate: _Whole | float = 48_000,
        spacing: float = 0.25,
        ambix: _Whole | None = None,
        hrtf: _Path | None = None,
        array: _Points | None = None,
        aim: ArrayLike | None = None,
        seed: _Whole | None = None,
        **options: Any,
    ) -> NDArray[np.float32]:
        """What a moving listener hears of a signal: the samples of `sonel-render --path` (docs/formats/sound.md).

        Parameters
        ----------
        path
            Times [s] and positions [m] of the listener, rows of t, x, y, z, shape [P, 4]; straight lines between them, at most 100 m/s. The
            listener stays at the last one.
        signal
            What every source sends from the first time on, shape [n]; N is n and the length of the echogram together.
        sample_rate
            Samples per second of signal and result, 8000 to 192000.
        spacing
            Longest distance between the places that are rendered [m], 0.01 to 10. Delays of direct sound and listed reflections are exact
            at every sample whatever it is, so that tones are shifted by 1 + v/c.
        ambix, hrtf, array
            As for `impulse_responses`. Ambisonics and arrays have the axes of the scene, which do not turn.
        aim
            Direction in which the head of `hrtf` looks all along the path, horizontally, shape [3]; by default it looks towards the first source, as
            in `impulse_responses`.
        seed
            Of the waves of late sound (default that of the rendering).
        **options
            Those of `render` but `grid`; `ambix`, `hrtf` and directional microphones render directions.

        Returns
        -------
        NDArray[np.float32]
            Pressure, shape [S, C, N] for S sources and C channels.

        Raises
        ------
        Error
            Bad input: what is wrong, where, and what is allowed.
        """
        try:
            points = np.asarray(path, dtype=float)
            samples = np.asarray(signal, dtype="<f8")
        except (TypeError, ValueError) as problem:
            raise Error(f"path and signal are numbers: {_input.shown(str(problem))}") from None
        if points.ndim != 2 or points.shape[1] != 4:
            raise Error(f"path has the shape {list(points.shape)}: give rows of t, x, y, z, shape [P, 4]")
        if samples.ndim != 1 or not np.all(np.isfinite(samples)):
            raise Error(f"signal has the shape {list(samples.shape)}: give the finite samples of one channel, shape [n]")
        order, head, microphones = _channels(ambix=ambix, hrtf=hrtf, array=array)
        if aim is not None and head is None:
            raise Error("aim turns the head of hrtf: give hrtf, or leave aim out")
        looking = {} if aim is None else {"aim": _input.numbers(aim, "aim", "a direction, shape [3]", (3,)).tolist()}
        sounds = (None if seed is None else _input.whole(seed, "seed", 0, _input.SEED), _rate(sample_rate))
        if (ambix, hrtf, array) != (None, None, None):
            options.setdefault("directions", True)
        places = {name: {"position": position, **looking} for name, position in _sonel.places(points.tolist(), spacing)}
        response = self.render(places, **options)
        channels = (None if order is None else (order, False), head, microphones)
        return np.array(response._inner.walk((points.tolist(), spacing), samples.tobytes(), channels, *sounds))

    def __reduce__(self) -> tuple[Any, ...]:
        """For other processes: the path of a map that was loaded or saved, the bytes of another one."""
        if self._path is None:
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "map.sonelmap"
                self._inner.save(path)
                return Map._of_bytes, (path.read_bytes(),)
        return Map.load, (os.path.abspath(self._path),)

    @classmethod
    def _of_bytes(cls, data: bytes) -> Map:
        # The folder is removed with the map.
        folder = tempfile.TemporaryDirectory()
        path = Path(folder.name) / "map.sonelmap"
        path.write_bytes(data)
        loaded = cls.load(path)
        loaded._path, loaded._folder = None, folder
        return loaded

    @property
    def report(self) -> dict[str, Any] | None:
        """What `sonel-trace --json` prints: counts, fates, energy ledger, effects. None for a map that was loaded."""
        return self._inner.report

    @property
    def digest(self) -> str:
        """Identity of the map: BLAKE3 of its header, which holds the digests of everything else."""
        return self._inner.digest

    @property
    def materials(self) -> dict[str, dict[str, NDArray[np.float64]]]:
        """Absorption, scattering and transmission of each material by its name, [B]."""
        keys = ("absorption", "scattering", "transmission")
        return {name: dict(zip(keys, map(np.array, numbers))) for name, numbers in self._inner.materials}

    @property
    def center_frequencies(self) -> NDArray[np.float64]:
        """Nominal band centres [Hz], shape [B]."""
        return np.array(self._inner.center_frequencies)

    @property
    def packets(self) -> int:
        """Emissions per source."""
        return self._inner.packets

    @property
    def seed(self) -> int:
        """Seed of the trace."""
        return self._inner.seed

    def __repr__(self) -> str:
        if not self.__dict__:
            return "<sonel.Map, closed>"
        return f"<sonel.Map of {self._inner.scene_name!r}: {self.packets} packets per source, seed {self.seed}>"


class Response(_Managed):
    """Echograms of S sources at R receivers in B bands and T time bins. Made by `Map.render` or `Response.load`.

    Arrays are read-only views of the response's own memory. `response[key]` is the array that docs/formats/response.md calls so;
    only files have `format_version` and `digest`.
    """

    def __init__(self, inner: _sonel.Response) -> None:
        self._inner = inner

    def __reduce__(self) -> tuple[Callable[..., Response], Any]:
        """What is unpickled is as if it had been saved and loaded."""
        return (Response._of_bytes, (self._inner.to_bytes(),))

    @classmethod
    def _of_bytes(cls, data: bytes) -> Response:
        return cls(_sonel.Response.from_bytes(data))

    @classmethod
    def load(cls, path: _Path) -> Response:
        """Reads a response of sonel-render.

        Parameters
        ----------
        path
            A file `.npz`.

        Returns
        -------
        Response
            The response.

        Raises
        ------
        Error
            A file that is missing (also a FileNotFoundError), damaged or invalid.
        """
        return cls(_loaded(_sonel.Response.load, os.fspath(path)))

    @classmethod
    def of_impulse_response(cls, samples: ArrayLike, sample_rate: _Whole | float = 48_000) -> Response:
        """An impulse response, measured or of `impulse_responses`, as a response of one source at one receiver.

        Its `parameters` are what a measurement finds (docs/formats/sound.md), without intervals.

        Parameters
        ----------
        samples
            Pressure, shape [N].
        sample_rate
            Samples per second.

        Returns
        -------
        Response
            Energies in the octaves that the rate holds.

        Raises
        ------
        Error
            Bad input: what is wrong, and what is allowed.
        """
        values = _input.numbers(samples, "samples", "the finite pressure of one channel, shape [N]").astype("<f4")
        if values.ndim != 1:
            raise Error(f"samples has the shape {list(values.shape)}: give those of one channel, shape [N]")
        rate = _input.whole(sample_rate, "sample_rate", 180, 768_000, " Hz")
        # A WAV file of 32-bit float.
        head = struct.pack("<4sIHHIIHH4sI", b"fmt ", 16, 3, 1, rate, 4 * rate, 4, 32, b"data", values.nbytes)
        return cls._of_bytes(struct.pack("<4sI4s", b"RIFF", 4 + len(head) + values.nbytes, b"WAVE") + head + values.tobytes())

    def save(self, path: _Path) -> None:
        """Writes the response as sonel-render would.

        Parameters
        ----------
        path
            A file `.npz`. An existing response is replaced, any other file is not.

        Raises
        ------
        Error
            Another file is there, or it cannot be written.
        """
        # A local header of 30 bytes precedes the name of the first array.
        is_response = lambda begin: begin.startswith(b"PK\x03\x04") and begin[30:].startswith(b"format_version.npy")  # noqa: E731
        self._inner.save(_input.output(os.fspath(path), "a response", is_response))

    def __getitem__(self, key: str) -> NDArray[Any]:
        """One of the arrays in docs/formats/response.md; KeyError where the response has no such array."""
        texts = {
            "source_name": self.sources,
            "receiver_name": self.receivers,
            "receiver_directivity": self._inner.receiver_directivities,
            "metadata_json": self._inner.metadata_json,
        }
        if texts.get(key):
            return np.array(texts[key])
        return np.asarray(self._inner.array(key))

    def __contains__(self, key: object) -> bool:
        return key in self.keys()

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def keys(self) -> list[str]:
        """Names of the arrays that `response[key]` has.

        Returns
        -------
        list[str]
            Names as in docs/formats/response.md.
        """

        def has(key: str) -> bool:
            try:
                self[key]
            except KeyError:
                return False
            return True

        return list(filter(has, _KEYS))

    @property
    def energy(self) -> NDArray[np.float64]:
        """Fluence per unit emitted energy in each time bin [1/m²], shape [S, R, B, T], everything included."""
        return self["energy"]

    @property
    def time_edges(self) -> NDArray[np.float64]:
        """Borders of the time bins from the emission [s], shape [T + 1]."""
        return self["time_edges_s"]

    @property
    def center_frequencies(self) -> NDArray[np.float64]:
        """Nominal band centres [Hz], shape [B]."""
        return self["center_frequency_hz"]

    @property
    def sources(self) -> list[str]:
        """Names of the sources, [S]."""
        return self._inner.sources

    @property
    def receivers(self) -> list[str]:
        """Names of the receivers, [R]."""
        return self._inner.receivers

    @property
    def receiver_positions(self) -> NDArray[np.float64]:
        """Positions of the receivers [m], shape [R, 3]."""
        return self["receiver_position_m"]

    @property
    def source_positions(self) -> NDArray[np.float64]:
        """Positions of the sources [m], shape [S, 3]."""
        return self["source_position_m"]

    @property
    def speed_of_sound(self) -> float:
        """[m/s]."""
        return self._inner.speed_of_sound

    @property
    def metadata(self) -> dict[str, Any]:
        """Provenance: versions, digests, options, shares per path class (docs/formats/response.md)."""
        return self._inner.metadata

    @property
    def report(self) -> dict[str, Any] | None:
        """What `sonel-render --json` prints. None for a response that was loaded."""
        return self._inner.report

    def together(
        self, *, gain_db: Mapping[str, float] | None = None, delay_s: Mapping[str, float] | None = None
    ) -> Response:
        """All sources as one system, as `sonel-analyze parameters --together`: energies are added, without lateral ones.

        Parameters
        ----------
        gain_db
            Gains of sources by name [dB], -100 ... 100. Other sources have that of the scene, else 0.
        delay_s
            Delays of sources by name [s], 0 ... 1. Other sources have that of the scene, else 0.

        Returns
        -------
        Response
            A response of one source, whose power is the sum of all, W = Σ W_s. `energy` is per unit of all energy emitted, the mean of
            the sources weighted by W_s; levels are those of the sum. Impulse responses are relative to the pressure of a source of the power W at
            1 m: for that of source s multiply them with √(W/W_s), √2 or 3 dB for two equal loudspeakers fed with one signal.

        Raises
        ------
        Error
            A name that no source has, or a value that is out of range.
        """
        gains, delays = (list((given or {}).items()) for given in (gain_db, delay_s))
        return Response(self._inner.together(gains, delays))

    def impulse_responses(
        self,
        *,
        ambix: _Whole | None = None,
        aim: bool = False,
        hrtf: _Path | None = None,
        array: _Points | None = None,
        within: float | None = None,
        seed: _Whole | None = None,
        sample_rate: _Whole | float = 48_000,
    ) -> NDArray[np.float32]:
        """Pressure impulse responses: the samples of `sonel-render --wav` (docs/formats/sound.md).

        At most one of `ambix`, `hrtf` and `array` is given.

        Parameters
        ----------
        ambix
            Order 1 … 7: C = (order + 1)² channels in ACN order with SN3D (AmbiX), for a response with directions. Axes are those of the scene:
            front is x, left is y.
        aim
            Turn the axes of `ambix` to the receiver: front is the horizontal part of its aim (default towards the first source).
        hrtf
            A SOFA file of the convention SimpleFreeFieldHRIR or GeneralFIR: C = 2, left and right ear of a head that looks along the receiver's
            aim (default towards the first source), for a response with directions. Of an array that was measured as heads are, such as one on a
            rigid sphere or a hearing aid: C microphones in the order of the file.
        array
            Microphones about each receiver: positions relative to it in the axes of the scene [m], at most 1 m away and nearer than any
            surface, shape [M, 3], or a mapping as for `Map.render`, such as {"left": {"position": [0, 0.05, 0], "directivity": "cardioid", "aim": [0, 1, 0]}}: C = M,
            in their order, from one rendering. Directional ones need a response with directions; late sound has them where the response
            has.
        within
            Keep what comes up to so long after direct sound [s]: 0 is direct sound alone (default all).
        seed
            Of the waves of late sound (default that of the rendering).
        sample_rate
            Samples per second, 8000 to 192000. Responses are made at this rate; do not convert them like recordings.

        Returns
        -------
        NDArray[np.float32]
            Pressure relative to that of the source at 1 m in a free field, shape [S, R, C, N]. Without `ambix`, `hrtf` and `array` C is 1.

        Raises
        ------
        Error
            Bad input, or a response without directions that are needed.
        """
        order, head, microphones = _channels(ambix=ambix, hrtf=hrtf, array=array)
        if not isinstance(aim, (bool, np.bool_)):
            raise Error(f"aim is {_input.shown(aim)}: True or False")
        if aim and order is None:
            raise Error("aim turns the axes of ambisonics: give ambix, or leave it out")
        seconds = None if within is None else float(_input.numbers(within, "within", "seconds after direct sound, 0 or more", ()))
        number = None if seed is None else _input.whole(seed, "seed", 0, _input.SEED)
        channels = (None if order is None else (order, bool(aim)), head, microphones)
        return np.array(self._inner.impulse_responses(channels, number, _rate(sample_rate), seconds))

    def to_sofa(
        self,
        path: _Path,
        *,
        ambix: _Whole | None = None,
        aim: bool = False,
        hrtf: _Path | None = None,
        array: _Points | None = None,
        within: float | None = None,
        seed: _Whole | None = None,
        sample_rate: _Whole | float = 48_000,
    ) -> None:
        """Writes `impulse_responses` as SOFA of the convention SingleRoomSRIR (AES69), a measurement for every source and receiver.

        Needs the package sofar.

        Parameters
        ----------
        path
            A file `.sofa`. Files that are there are not replaced.
        ambix, aim, hrtf, array, within, seed, sample_rate
            As for `impulse_responses`.

        Raises
        ------
        Error
            As `impulse_responses`; a file that is there; no sofar.
        """
        from . import _sofa

        options = {"aim": aim, "hrtf": hrtf, "within": within, "seed": seed}
        microphones = None if array is None else _points(array, "microphone")
        order = None if ambix is None else _input.whole(ambix, "ambix", 1, 7)
        _sofa.write(self, Path(path), ambix=order, array=array, microphones=microphones, sample_rate=_rate(sample_rate), **options)

    def parameter_report(
        self,
        *,
        noise: str | ArrayLike | None = None,
        speech: str | ArrayLike | None = None,
        material_uncertainty: ArrayLike | Mapping[str, ArrayLike] | None = None,
        map: Map | None = None,
    ) -> dict[str, Any]:
        """Every parameter with its interval, warnings and reasons.

        Parameters
        ----------
        noise
            Background noise at every receiver: a curve such as "NR-35" or "NC-30", or levels in the octaves 125 ... 8000 Hz [dB re 20 uPa].
            Adds U50 and signal-to-noise ratio; the speech transmission index includes noise, masking and the reception threshold.
        speech
            "normal", "raised", "loud", "shouted", "iec", or power levels in these octaves [dB re 1 pW] (default those of the source). Needs `noise`.
        material_uncertainty
            Standard uncertainty of absorption coefficients, 0 ... 0.5: of all materials, or by the name of the material; one number or one for
            each band. Gives every parameter a second interval, that of the materials. Needs `map`. Materials are independent, bands of one
            material deviate together.
        map
            The map that the response was rendered from.

        Returns
        -------
        dict[str, Any]
            What `sonel-analyze parameters --format json` prints.

        Raises
        ------
        Error
            Levels or uncertainties that are out of range, no such material, or another map.
        """
        if (material_uncertainty is None) != (map is None):
            raise Error("material_uncertainty needs the map that the response was rendered from, as map: give both or neither")
        if map is None:
            return self._inner.parameters(_log, noise, speech)
        map = _input.of_kind(map, Map, "map", "the sonel.Map that the response was rendered from")
        return map._inner.parameters(self._inner, material_uncertainty, _log, noise, speech)

    def parameters(self, **options: Any) -> NDArray[np.void]:
        """Parameters of ISO 3382-1 with the limits of their 95 % intervals.

        One metre from a source they include the support. `parameter_report` has the reason of a value that is missing.

        Parameters
        ----------
        **options
            Those of `parameter_report`.

        Returns
        -------
        NDArray[np.void]
            A structured array of shape [S, R, B]. Fields: source, receiver, center_frequency_hz, and for each of level_db, strength_g_db,
            early_decay_time_s, t20_s, t30_s, clarity_c50_db, clarity_c80_db, definition_d50, center_time_s and, with directions,
            lateral_fraction, lateral_fraction_cosine and late_lateral_level_db, one metre from a source support_early_db and
            support_late_db, with noise useful_to_detrimental_u50_db and signal_to_noise_db its value and, as NAME_low and NAME_high, the limits
            of its interval; with `material_uncertainty` also those of the materials, NAME_materials_low and NAME_materials_high. NaN where
            the response does not support a value.

        Raises
        ------
        Error
            As `parameter_report`.
        """
        return self._parameters(self.parameter_report(**options))

    def _parameters(self, report: Mapping[str, Any]) -> NDArray[np.void]:
        rows = report["receivers"]
        shape = (len(self.sources), len(self.receivers), len(self.center_frequencies))
        text = f"U{max(map(len, self.sources + self.receivers))}"
        keys = list(dict.fromkeys(key for row in rows for band in row["bands"] for key in band if key != "center_frequency_hz"))
        is_uncertain = any("ci95_materials" in (band.get(key) or {}) for row in rows for band in row["bands"] for key in keys)
        ends = ("", "_low", "_high", *(("_materials_low", "_materials_high") if is_uncertain else ()))
        numbers = [key + end for key in keys for end in ends]
        fields = [("source", text), ("receiver", text), ("center_frequency_hz", "f8"), *((name, "f8") for name in numbers)]
        values = [
            (row["source"], row["name"], band["center_frequency_hz"], *(x for key in keys for x in _value(band.get(key))[: len(ends)]))
            for row in rows
            for band in row["bands"]
        ]
        return np.array(values, dtype=fields).reshape(shape)

    def speech_transmission_index(self, **options: Any) -> NDArray[np.float64]:
        """Speech transmission index, without `noise` that of the room alone.

        Parameters
        ----------
        **options
            Those of `parameter_report`.

        Returns
        -------
        NDArray[np.float64]
            0 … 1, shape [S, R]; NaN where octaves of speech are missing.

        Raises
        ------
        Error
            As `parameter_report`.
        """
        return self._speech(self.parameter_report(**options))

    def _speech(self, report: Mapping[str, Any]) -> NDArray[np.float64]:
        values = [_value(row["speech_transmission_index"])[0] for row in report["receivers"]]
        return np.array(values).reshape(len(self.sources), len(self.receivers))

    def to_pandas(self) -> pandas.DataFrame:
        """`parameters` as a DataFrame. Needs pandas.

        Returns
        -------
        pandas.DataFrame
            A row for every source, receiver and band.
        """
        import pandas

        return pandas.DataFrame(self.parameters().reshape(-1))

    def to_xarray(self) -> xarray.Dataset:
        """Energies and `parameters` as an xarray.Dataset. Needs xarray.

        Returns
        -------
        xarray.Dataset
            A dataset with the dimensions source, receiver, band and time.
        """
        from . import _drawing

        return _drawing.xarray_of(self)

    def to_pyfar(self, **options: Any) -> pyfar.Signal:
        """`impulse_responses` as a pyfar.Signal. Needs pyfar.

        Parameters
        ----------
        **options
            Those of `impulse_responses`.

        Returns
        -------
        pyfar.Signal
            A signal of the shape [S, R, C].

        Raises
        ------
        Error
            As `impulse_responses`; no pyfar.
        """
        try:
            import pyfar
        except ImportError:
            raise Error("to_pyfar needs the package pyfar: pip install pyfar") from None
        samples = self.impulse_responses(**options).astype(float)
        return pyfar.Signal(samples, _rate(options.get("sample_rate", 48_000)), comment=f"sonel: {self.metadata['scene']}")

    def plot_decay(self, source: _Whole = 0, receiver: _Whole = 0, ax: Any = None) -> Any:
        """Draws the Schroeder decay curve of every band, by matplotlib.

        Parameters
        ----------
        source, receiver
            Their numbers from 0.
        ax
            Axes of matplotlib; without them a new figure.

        Returns
        -------
        matplotlib.axes.Axes
            The axes.

        Raises
        ------
        Error
            No such source or receiver, or no matplotlib.
        """
        from . import _drawing

        source = _input.whole(source, "source", 0, len(self.sources) - 1)
        return _drawing.decay(self, source, _input.whole(receiver, "receiver", 0, len(self.receivers) - 1), ax)

    def _repr_html_(self) -> str:
        """A table for notebooks: levels, T30 and clarity with their intervals at the middle band."""
        from . import _drawing

        band = len(self.center_frequencies) // 2
        head = ["source", "receiver", "level [dB]", "T30 [s]", "C50 [dB]", "C80 [dB]"]

        def text(row: Any, name: str) -> str:
            width = 0.5 * (row[name + "_high"] - row[name + "_low"])
            return "–" if np.isnan(row[name]) else f"{row[name]:.2f}" + ("" if np.isnan(width) else f" ± {width:.2f}")

        keys = ["level_db", "t30_s", "clarity_c50_db", "clarity_c80_db"]
        found = self.parameters()[..., band].reshape(-1)
        rows = [[row["source"], row["receiver"], *(text(row, key) for key in keys)] for row in found]
        return _drawing.table(head, rows, f"{self!r} at {self.center_frequencies[band]:g} Hz"[1:].replace(">", "", 1))

    def __repr__(self) -> str:
        if not self.__dict__:
            return "<sonel.Response, closed>"
        s, r, b, t = self.energy.shape
        return f"<sonel.Response: {s} sources, {r} receivers, {b} bands, {t} time bins>"


def _rate(sample_rate: _Whole | float) -> int:
    """Samples per second."""
    return _input.whole(sample_rate, "sample_rate", 8000, 192_000, " Hz")


def _channels(
    *, ambix: _Whole | None = None, hrtf: _Path | None = None, array: _Points | None = None
) -> tuple[int | None, bytes | None, list[_sonel.Receiver] | None]:
    """Order, bytes of the SOFA file and microphones, at most one of which is given."""
    given = [name for name, value in (("ambix", ambix), ("hrtf", hrtf), ("array", array)) if value is not None]
    if len(given) > 1:
        raise Error(f"{given[0]} and {given[1]} exclude each other: ask for one after the other")
    order = None if ambix is None else _input.whole(ambix, "ambix", 1, 7)
    try:
        head = None if hrtf is None else _sonel.read(hrtf)
    except OSError as problem:
        kind = _Missing if isinstance(problem, FileNotFoundError) else Error
        raise kind(f"cannot read {_input.cut(os.fspath(hrtf or ''))}: {problem.strerror or problem}") from None
    return order, head, None if array is None else [_receiver(**point) for point in _points(array, "microphone")]


def _value(parameter: Mapping[str, Any] | None) -> tuple[float, ...]:
    """Value and limits of the intervals of simulation and materials of a parameter in JSON; NaN for what is null or not there."""
    parameter = {"value": None} if parameter is None else parameter
    ends = [parameter.get(key) or (None, None) for key in ("ci95", "ci95_materials")]
    return tuple(np.nan if number is None else number for number in (parameter["value"], *ends[0], *ends[1]))


def _in_notebook() -> bool:
    """Whether a notebook shows what goes to stderr."""
    return "ipykernel" in sys.modules


class _Text:
    """Progress as text on stderr or in a notebook, while the work goes on; or the function that was given."""

    def __init__(self, progress: _Progress) -> None:
        shows = sys.stderr.isatty() or _in_notebook() if progress is None else progress
        self._follower = progress if callable(progress) else self._show if shows else None
        self._shown = ""
        self._cell: Any = None

    def __enter__(self) -> Callable[[str, float], object] | None:
        return self._follower

    def __exit__(self, *_: object) -> None:
        # A cell keeps the last text: an output cannot be taken back.
        if self._cell is None and self._shown:
            sys.stderr.write("\r" + " " * len(self._shown) + "\r")

    def _show(self, what: str, share: float) -> None:
        text = f"{what} {share:4.0%}"
        if text == self._shown:
            return
        self._shown = text
        if _in_notebook():
            display: Any = importlib.import_module("IPython.display").display
            # One output of the cell, which is replaced.
            if self._cell is None:
                self._cell = display({"text/plain": text}, raw=True, display_id=True)
            else:
                self._cell.update({"text/plain": text}, raw=True)
        else:
            sys.stderr.write("\r" + text)
            sys.stderr.flush()


def _materials(materials: _Materials) -> dict[str, Any]:
    """Tables of materials by name; a single material is that of the walls."""
    if not isinstance(materials, Mapping) or "absorption" in materials or "library" in materials:
        materials = {"walls": materials}

    def table(value: Any) -> Any:
        if isinstance(value, Mapping):
            return value
        return {"library" if isinstance(value, str) else "absorption": value}

    return {str(name): table(value) for name, value in materials.items()}


def _grid(axes: Sequence[ArrayLike]) -> str:
    """A grid of arrays as the option has it."""
    right = "three axes, each one number or evenly spaced numbers"
    if not isinstance(axes, (Sequence, np.ndarray)) or len(axes) != 3:
        raise Error(f"grid is {_input.shown(axes)}: give {right}")
    given = [np.atleast_1d(_input.numbers(axis, "an axis of grid", right)) for axis in axes]

    def text(axis: NDArray[np.float64]) -> str:
        if axis.size == 1:
            return repr(float(axis.item()))
        if axis.ndim != 1 or axis.size == 0 or not np.allclose(np.diff(axis), (axis[-1] - axis[0]) / (axis.size - 1), rtol=1e-6, atol=0):
            raise Error(f"grid: the axis {axis.tolist()} is not evenly spaced: give its points as receivers")
        return f"{float(axis[0])!r}:{float(axis[-1])!r}:{axis.size}"

    return ",".join(map(text, given))


def _points(points: _Points, kind: str) -> list[dict[str, Any]]:
    """Sources or receivers as the tables of a scene file."""
    if isinstance(points, Mapping):
        tables = {name: value if isinstance(value, Mapping) else {"position": value} for name, value in points.items()}
        return [{"name": str(name), **table} for name, table in tables.items()]
    try:
        positions = np.asarray(points, dtype=float)
    except (TypeError, ValueError):
        positions = np.empty(0)
    positions = np.atleast_2d(positions)
    if positions.shape[1:] != (3,):
        raise Error(f"the {kind}s are not positions: give an array of shape [3] or [N, 3] in metres, or a mapping from names")
    return [{"name": f"{kind} {i}", "position": row} for i, row in enumerate(positions.tolist(), 1)]


def _receiver(
    name: str, position: Any = None, directivity: str = "omni", aim: Any = None, **others: Any
) -> tuple[str, list[float], str, list[float] | None]:
    """Name, position, directivity and aim of a receiver."""
    if others:
        raise Error(f"receiver {_input.shown(name)}: unknown key {_input.shown(next(iter(others)))}; known: position, directivity, aim")
    if position is None:
        raise Error(f"receiver {_input.shown(name)}: position is missing; give three numbers [x, y, z] in metres")
    if aim is None and directivity != "omni":
        raise Error(f"receiver {_input.shown(name)}: aim is missing; a {directivity} receiver needs aim = [x, y, z]")

    def triple(given: Any, what: str) -> list[float]:
        found: list[float] = _input.numbers(given, f"receiver {_input.shown(name)}: {what}", "three finite numbers [x, y, z]", (3,)).tolist()
        return found

    return name, triple(position, "position"), str(directivity), None if aim is None else triple(aim, "aim")


def _face_materials(count: int, names: list[str], face_materials: Sequence[str] | None) -> list[str]:
    """The name of the material of each face."""
    if face_materials is None:
        if len(names) != 1:
            raise Error(f"there are {len(names)} materials: give the name of the material of each face in face_materials")
        return names * count
    if len(face_materials) != count:
        raise Error(f"face_materials has {len(face_materials)} names and faces has {count} rows: give one for each")
    return [str(name) for name in face_materials]
