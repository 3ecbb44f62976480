#!/usr/bin/env python3
"""Compares pictures that sonel-analyze image writes of an empty box with counts of the sonels that it exports, read by OpenEXR."""

import argparse
import json
from pathlib import Path

import numpy as np
import OpenEXR

from read_sonelmap import SonelMap

# Positions are stored in f32: nearer to the border of a disc a sonel may be in or out.
BORDER = 1e-4
# Relative: pixels are f32.
SINGLE = 1e-5
# Metres from the plane of a wall.
ON_WALL = 1e-4
# Every so many pixels are compared.
STRIDE = 7
# Whole discs with sonels that have to be among them.
LEAST = 200


def directions(camera, width, height):
    """Unit vectors through the middles of the pixels, from docs/formats/image.md."""
    forward = np.subtract(camera["look_m"], camera["eye_m"])
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    half = np.tan(np.radians(camera["fov_degrees"]) / 2)
    x = (2 * np.arange(width) + 1) / width - 1
    y = (1 - (2 * np.arange(height) + 1) / height) * height / width
    rays = forward + half * (x[None, :, None] * right + y[:, None, None] * np.cross(right, forward))
    return rays / np.linalg.norm(rays, axis=2, keepdims=True)


def hit(eye, direction, size):
    """Axis and place where a ray from inside meets a wall of the box."""
    far = np.where(direction > 0, size, 0)
    ways = np.divide(far - eye, direction, out=np.full(3, np.inf), where=direction != 0)
    axis = int(np.argmin(ways))
    return axis, eye + ways[axis] * direction


def differences(pictures, archive, sonelmap, size):
    """Descriptions of the pixels that are not what the sonels say, and how many were compared."""
    scene, wrong, compared = sonelmap.header["scene"], [], 0
    for number, part in enumerate(pictures.parts):
        camera = json.loads(part.header["comments"])
        height, width = part.channels["A"].pixels.shape
        first, last = np.array(camera["windows_s"][number]) * scene["speed_of_sound"]
        length, radius = archive["path_length_m"], camera["radius_m"]
        here = (archive["source_name"][archive["source"]] == camera["source"]) & (length >= first) & (length < last)
        place, length = archive["position_m"][here], length[here]
        energy = archive["energy"][here] * np.exp(-np.outer(length, scene["air_attenuation"]))
        eye, rays = np.array(camera["eye_m"]), directions(camera, width, height)
        for row, column in np.ndindex(height, width):
            axis, at = hit(eye, rays[row, column], size)
            whole = sum(radius < at[i] < size[i] - radius for i in range(3)) == 2
            if (row * width + column) % STRIDE or not whole:
                continue
            distance = np.where(abs(place[:, axis] - at[axis]) < ON_WALL, np.linalg.norm(place - at, axis=1), np.inf)
            least, most = (energy[distance < border].sum(0) / (np.pi * radius**2) for border in (radius - BORDER, radius + BORDER))
            compared += least.sum() > 0
            for band, frequency in enumerate(archive["center_frequency_hz"]):
                value = part.channels[f"band.{frequency:05.0f}Hz"].pixels[row, column]
                if not least[band] * (1 - SINGLE) <= value <= most[band] * (1 + SINGLE):
                    wrong.append(f"{part.name()}, {frequency:g} Hz, pixel {column},{row}: {value}, not {least[band]} … {most[band]}")
    return wrong, compared


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("map", type=Path, metavar="MAP.sonelmap")
    parser.add_argument("archive", type=Path, metavar="SONELS.npz")
    parser.add_argument("pictures", metavar="ENERGY.exr")
    parser.add_argument("size", metavar="X,Y,Z", help="extents of the box from the origin [m]")
    arguments = parser.parse_args()
    archive = dict(np.load(arguments.archive))
    size = np.array([float(extent) for extent in arguments.size.split(",")])
    with OpenEXR.File(arguments.pictures, separate_channels=True) as pictures:
        wrong, compared = differences(pictures, archive, SonelMap(arguments.map), size)
    if wrong or compared < LEAST:
        raise SystemExit(f"error: {len(wrong)} values are wrong, {compared} pixels were compared: {wrong[:3]}")
    print(f"{compared} pixels are what the sonels say")


if __name__ == "__main__":
    main()
