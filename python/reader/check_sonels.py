#!/usr/bin/env python3
"""Compares what sonel-analyze exports from a map, as an archive and as CSV, with what read_sonelmap.py reads off the paths."""

import argparse
import csv
from pathlib import Path

import numpy as np

from read_sonelmap import (ABSORBED, DIFFRACTED, DIFFUSE, EMERGED, ESCAPED, EXPIRED, LEFT, LOST, REFRACTED, RETURNED, SPECULAR,
                           SonelMap, arriving, packets, sonels)

# Events at which a path goes on without leaving a sonel.
NO_SONEL = (DIFFRACTED, EMERGED, REFRACTED, RETURNED)

# Relative: both multiply the same factors in another order.
ROUNDING = 1e-9
# What is written in f32.
SINGLE = 1e-6
# Directions of arcs are those of their last chords, whose begin is rounded to f32: 16 µm within 300 m, in chords of 2 m.
JOINTS = 2e-5
# Relative: first directions are computed in f32, which a small directivity factor makes larger.
DIRECTED = 1e-4


def histories(map, source):
    """(emission, leading band, order, specular run, diffused, event) of every sonel of a source."""
    bands = len(map.header["scene"]["nominal_frequencies"])
    for emission, path in map.paths(source):
        for vertices, _, own in packets(path):
            order, run, diffused = 0, 0, False
            for step, event in enumerate(vertices["tag"] & 15):
                if event in (ESCAPED, EXPIRED, LOST, LEFT):
                    break
                if event in NO_SONEL:
                    continue
                if step >= own:
                    yield emission, emission % bands, order, run, diffused, event
                if event >= ABSORBED:
                    break
                if event in (SPECULAR, DIFFUSE):
                    order, run, diffused = order + 1, run + 1 if event == SPECULAR else 0, diffused or event == DIFFUSE


def directions(map, source):
    """Unit vectors between the stored points; that of a first segment errs by the rounding of its end."""
    origin = map.header["scene"]["sources"][source]["position"] - map.header["center"]
    for vertices, own in ((vertices, own) for _, path in map.paths(source) for vertices, _, own in packets(path)):
        points = vertices["position"].astype(float)
        steps = np.diff(points, axis=0, prepend=origin[None])
        lengths = np.linalg.norm(steps, axis=1, keepdims=True)
        if map.gradient:
            ends = zip(np.vstack([origin, points[:-1]]), points)
            steps, lengths = np.array([arriving(map, *pair) for pair in ends]), 1 + 0 * lengths
        for vertex, step in list(zip(vertices, steps / np.where(lengths > 0, lengths, 1)))[own:]:
            if vertex["tag"] & 15 not in (*NO_SONEL, ESCAPED, EXPIRED, LOST, LEFT):
                yield step


def differences(map, archive):
    """Names of the arrays that are not what the paths say."""
    sources = range(len(map.header["scene"]["sources"]))
    read = [row for source in sources for row in sonels(map, source)]
    surface, back, point, length, energy, _ = (np.array(column) for column in zip(*read))
    history = np.array([row for source in sources for row in histories(map, source)])
    direction = np.array([row for source in sources for row in directions(map, source)])
    counts = [sum(1 for _ in sonels(map, source)) for source in sources]
    exact = {"source": np.repeat(sources, counts), "surface": surface, "side": back}
    exact |= dict(zip(["emission", "leading_band", "order", "specular_run", "diffused", "event"], history.T))
    directed = np.array([emitter["directivity"] != "omni" for emitter in map.header["scene"]["sources"]])
    relative = np.where(directed[exact["source"]], DIRECTED, ROUNDING)[:, None]
    near = {"position_m": (point + map.header["center"], 0, SINGLE), "path_length_m": (length, ROUNDING, 0),
            "direction": (direction, 0, SINGLE + (JOINTS if map.gradient else 0)), "energy": (energy, relative, 0)}
    yield from (key for key, column in exact.items() if not np.array_equal(archive[key], column))
    for key, (column, relative, absolute) in near.items():
        if archive[key].shape != column.shape or not np.allclose(archive[key], column, relative, absolute):
            yield key


def differences_of_rows(archive, rows):
    """Names of the columns of the CSV that are not the arrays of the archive."""
    text = {"source": archive["source_name"][archive["source"]], "side": np.array(["front", "back"])[archive["side"]],
            "event": np.array([dict(zip(archive["event_code"], archive["event_name"]))[code] for code in archive["event"]])}
    number = {key: archive[key] for key in ("emission", "order", "specular_run", "diffused", "path_length_m", "surface")}
    number["leading_band_hz"] = archive["center_frequency_hz"][archive["leading_band"]]
    number |= {f"{axis}_m": archive["position_m"][:, i] for i, axis in enumerate("xyz")}
    number |= {f"direction_{axis}": archive["direction"][:, i] for i, axis in enumerate("xyz")}
    number |= {f"energy_{f:g}_hz": archive["energy"][:, i] for i, f in enumerate(archive["center_frequency_hz"])}
    yield from (key for key, column in text.items() if [row[key] for row in rows] != column.tolist())
    for key, column in number.items():
        if not np.array_equal(np.array([row[key] for row in rows]).astype(column.dtype if column.dtype != bool else int), column):
            yield key
    if set(rows[0]) != set(text) | set(number):
        yield "the header"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("map", type=Path, metavar="MAP.sonelmap")
    parser.add_argument("archive", type=Path, metavar="SONELS.npz")
    parser.add_argument("rows", type=Path, metavar="SONELS.csv")
    arguments = parser.parse_args()
    archive = np.load(arguments.archive)
    archive = {key: archive[key] for key in archive}
    with open(arguments.rows, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    wrong = [*differences(SonelMap(arguments.map), archive), *differences_of_rows(archive, rows)]
    if wrong:
        raise SystemExit(f"error: these columns are not what the map says: {', '.join(wrong)}")
    print(f"{len(rows)} sonels, {len(archive)} arrays and {len(rows[0])} columns are what the paths say")


if __name__ == "__main__":
    main()
