"""Pictures by matplotlib, tables for notebooks, and arrays of other packages."""

from __future__ import annotations

import html
from typing import TYPE_CHECKING, Any

import numpy as np

from ._sonel import Error

if TYPE_CHECKING:
    import xarray

    from . import Response, Scene


def _axes(ax: Any, **options: Any) -> Any:
    """The axes that were given, or those of a new figure."""
    if ax is not None:
        return ax
    try:
        from matplotlib import pyplot
    except ImportError:
        raise Error("pictures need the package matplotlib: pip install matplotlib") from None
    return pyplot.subplots(**options)[1]


def decay(response: Response, source: int, receiver: int, ax: Any) -> Any:
    """Schroeder decay curves of all bands."""
    axes = _axes(ax)
    edges = response.time_edges
    energy = response.energy[source, receiver]
    remaining = np.cumsum(energy[:, ::-1], axis=1)[:, ::-1]
    for center, curve in zip(response.center_frequencies, remaining):
        if curve[0] > 0:
            audible = curve > 0
            axes.plot(edges[:-1][audible], 10 * np.log10(curve[audible] / curve[0]), label=f"{center:g} Hz")
    axes.set(xlabel="time since emission [s]", ylabel="Schroeder decay curve [dB]", ylim=(-65, 2))
    axes.set_title(f"{response.sources[source]} at {response.receivers[receiver]}")
    axes.legend(fontsize="small", ncols=2)
    return axes


def room(scene: Scene, ax: Any) -> Any:
    """Edges of the walls, sources and receivers in three dimensions."""
    from . import _rooms

    document, polygons, objects = scene._parts()
    parts = _rooms.joined([_rooms.walls(document, polygons), *map(_rooms.decoded, objects)])
    axes = _axes(ax, subplot_kw={"projection": "3d"})
    begin = 0
    for size in parts.sizes:
        ring = parts.points[parts.corners[begin : begin + size]]
        ring = np.vstack([ring, ring[:1]])
        axes.plot(*ring.T, color="0.6", linewidth=0.8)
        begin += size
    for points, marker, label in ((scene.sources, "^", "sources"), (scene.receivers, "o", "receivers")):
        if points:
            axes.scatter(*np.array(list(points.values())).T, marker=marker, label=label)
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]", title=scene.name)
    axes.set_aspect("equal")
    axes.legend()
    return axes


def table(head: list[str], rows: list[list[str]], caption: str) -> str:
    """A table in HTML."""
    cells = ["".join(f"<{tag}>{html.escape(cell)}</{tag}>" for cell in row) for tag, row in [("th", head), *(("td", row) for row in rows)]]
    return f"<table><caption>{html.escape(caption)}</caption>" + "".join(f"<tr>{row}</tr>" for row in cells) + "</table>"


def xarray_of(response: Response) -> xarray.Dataset:
    """Energies and parameters with their coordinates."""
    try:
        import xarray
    except ImportError:
        raise Error("to_xarray needs the package xarray: pip install xarray") from None
    rows = response.parameters()
    pairs, times = ("source", "receiver", "band"), 0.5 * (response.time_edges[1:] + response.time_edges[:-1])
    variables: dict[str, Any] = {"energy": ((*pairs, "time"), response.energy, {"units": "1/m2"})}
    for name in rows.dtype.names or ():
        if name not in ("source", "receiver", "center_frequency_hz"):
            variables[name] = (pairs, rows[name])
    coordinates = {
        "source": response.sources,
        "receiver": response.receivers,
        "band": ("band", response.center_frequencies, {"units": "Hz"}),
        "time": ("time", times, {"units": "s"}),
        "source_position": (("source", "axis"), response.source_positions, {"units": "m"}),
        "receiver_position": (("receiver", "axis"), response.receiver_positions, {"units": "m"}),
        "axis": ["x", "y", "z"],
    }
    return xarray.Dataset(variables, coordinates, {"scene": str(response.metadata["scene"])})
