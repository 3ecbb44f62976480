"""Casts the rays of `target/rays` with Embree and prints both rates: `cargo xtask bench rays`."""

import csv
import sys
import time
from pathlib import Path

import numpy
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

REPEATS = 3


def read(path):
    """Corners of triangles, and starts, directions and targets of rays."""
    data = path.read_bytes()
    triangles, rays = numpy.frombuffer(data, "<u4", 2)
    triples = numpy.frombuffer(data, "<f4", offset=8).reshape(-1, 3)
    ends = numpy.cumsum([3 * triangles, rays, rays, rays])
    corners, starts, directions, targets = numpy.split(triples, ends[:-1])
    return corners.reshape(-1, 3, 3).copy(), starts.copy(), directions.copy(), targets.copy()


def per_second(scene, starts, directions, **query):
    """Rays per CPU second, and how many hit."""
    seconds = []
    for _ in range(REPEATS):
        begin = time.thread_time()
        hits = scene.run(starts, directions, **query)
        seconds.append(time.thread_time() - begin)
    return len(starts) / min(seconds), numpy.count_nonzero(hits >= 0)


def main(folder):
    print("million rays per CPU-s      sonel   Embree   ratio")
    for name, closest, shadow in csv.reader((folder / "rates.csv").open()):
        corners, starts, directions, targets = read(folder / f"{name}.bin")
        scene = EmbreeScene(robust=True)
        TriangleMesh(scene, corners)
        nearest = per_second(scene, starts, directions, query="INTERSECT")
        blocked = per_second(
            scene, starts, targets - starts, dists=numpy.ones(len(starts), "f4"), query="OCCLUDED"
        )
        for what, own, (other, hits) in [("closest", closest, nearest), ("shadow", shadow, blocked)]:
            own = float(own)
            print(
                f"{name + ', ' + what:24} {own / 1e6:8.2f} {other / 1e6:8.2f} {own / other:7.2f}"
                f"   (Embree: {hits / len(starts):.1%} hit)"
            )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
