"""CPU time and T30 of impulse responses by sonel and by pyroomacoustics in the same rooms: `cargo xtask bench peers [ROOMS]`.

Both have the same walls, absorption and scattering in octaves, air and speed of sound. Settings of pyroomacoustics are those of its
documentation: image sources to order 3, then the rays that it chooses, receivers of 0.5 m. In the last table it has one absorption for all
octaves and no air, which is faster. T30 is read from the responses of both by the same filters and backward integration.
"""

import os
import sys
import tempfile
import time
from functools import partial

import numpy
import pyroomacoustics
import sonel
from scipy.signal import butter, sosfiltfilt
from sonel import _rooms

RATE = 16_000
# T30 is read in 125 Hz to 4 kHz: sonel has 63 Hz below, both have 8 kHz above, where the spectrum ends.
FILTERS = [butter(4, [125 * 2 ** (i - 0.5), 125 * 2 ** (i + 0.5)], "bandpass", fs=RATE, output="sos") for i in range(6)]
CIRCLE = 0.05 * numpy.array([[numpy.cos(angle), numpy.sin(angle), 0] for angle in numpy.arange(8) * numpy.pi / 4])
FAST = {"trace": {"packets": 5000}, "render": {"order": 2, "estimator": "sphere", "effects": "-diffraction,-boundary"}}
FINE = {"trace": {"packets": 40_000}, "render": {"order": 2, "effects": "-diffraction,-boundary"}}
MORE = 20


def by_sonel(scenes, microphones=CIRCLE, **options):
    """CPU seconds, responses of each room, and T30 of their energies with the ends of its 95 % interval [3, room, octave]."""
    with tempfile.TemporaryDirectory() as folder:
        begin = time.process_time()
        paths = sonel.dataset(scenes, folder, microphones=microphones, progress=False, **options)
        seconds = time.process_time() - begin
        shards = [dict(numpy.load(path)) for path in paths]
    responses = [ir[:, :end] for shard in shards for ir, end in zip(shard["ir"], shard["samples"])]
    labels = [numpy.concatenate([shard["t30_s" + end] for shard in shards]) for end in ("", "_low", "_high")]
    return seconds, responses, numpy.array(labels)[..., 1:7]


def by_peer(rooms):
    """CPU seconds and responses of each room; rooms are made in that time."""
    begin = time.process_time()
    responses = []
    for room in rooms:
        room.compute_rir()
        responses.append([response for [response] in room.rir])
    return time.process_time() - begin, responses


def peer(scene, more=1):
    """A room of rectangles in pyroomacoustics, with `more` times the rays that it chooses."""
    document, polygons, objects = scene._parts()
    parts = _rooms.joined([_rooms.walls(document, polygons), *map(_rooms.decoded, objects)])
    size = scene.room
    absorption = {material["name"]: material["absorption"][1:] for material in size["materials"]}
    walls = []
    for name, corners in zip(parts.names, parts.points[parts.corners.reshape(-1, 4)]):
        # Normals point out of the air: into furniture.
        outwards = corners[::-1] if name.startswith("furniture") else corners
        scattering = [document["materials"][name]["scattering"]] * len(absorption[name])
        walls.append(pyroomacoustics.wall_factory(outwards.T, absorption[name], scattering))
    room = pyroomacoustics.Room(walls, fs=RATE, max_order=3, ray_tracing=True, air_absorption=True)
    # Attenuation by the air of sonel [1/m]: what Eyring's time has beyond the walls.
    mean, eyring = numpy.array([[band["mean_absorption"], band["eyring_s"]] for band in size["bands"][1:]]).T
    walls_alone = -size["area_m2"] * numpy.log1p(-mean) / (4 * size["volume_m3"])
    room.set_air_absorption(6 * numpy.log(10) / (scene.speed_of_sound * eyring) - walls_alone)
    room.set_ray_tracing(n_rays=more * room.rt_args["n_rays"])
    return placed(room, scene)


def placed(room, scene, microphones=CIRCLE):
    room.set_sound_speed(scene.speed_of_sound)
    room.add_source(*scene.sources.values())
    room.add_microphone_array((numpy.array(*scene.receivers.values()) + microphones).T)
    return room


def t30(response):
    """T30 in each octave [s]."""
    times = []
    for octave in FILTERS:
        energy = numpy.cumsum(sosfiltfilt(octave, response)[::-1] ** 2)[::-1]
        level = 10 * numpy.log10(energy[energy > 0] / energy[0])
        begin, end = numpy.argmax(level < -5), numpy.argmax(level < -35)
        times.append(-60 / RATE / numpy.polyfit(numpy.arange(begin, end), level[begin:end], 1)[0])
    return times


def furnished(count):
    scenes = list(sonel.random_rooms(count, seed=7, t60=(0.2, 0.8)))
    made = {
        "sonel, default of dataset": by_sonel(scenes),
        "sonel, 5000 packets, estimator sphere": by_sonel(scenes, **FAST),
        "sonel, 40 000 packets, all rays": by_sonel(scenes, **FINE),
        "pyroomacoustics, rays by its choice": by_peer(peer(scene) for scene in scenes),
        f"pyroomacoustics, {MORE} times the rays": by_peer(peer(scene, MORE) for scene in scenes),
    }
    rows = {name: (run[0], numpy.array([[t30(one) for one in room] for room in run[1]])) for name, run in made.items()}
    seconds, _, [labels, _, _] = made["sonel, default of dataset"]
    rows["sonel, default, T30 of energies (labels)"] = seconds, labels[:, None]
    _, _, [truth, low, high] = made["sonel, 40 000 packets, all rays"]
    references = truth[:, None], rows[f"pyroomacoustics, {MORE} times the rays"][1].mean(axis=1, keepdims=True)
    print(f"{f'{count} furnished rooms, 8 microphones each':48} CPU-s per    T30 against S      T30 against P")
    print(f"{'':48}  response    rms %   mean %     rms %   mean %")
    for name, (seconds, times) in rows.items():
        errors = (100 * (times / reference - 1) for reference in references)
        shown = [f"{numpy.nanmean(error**2) ** 0.5:8.1f} {numpy.nanmean(error):8.1f}" for error in errors]
        print(f"{name:48} {seconds / count / 8:9.4f} {'  '.join(shown)}")
    width = 50 * numpy.nanmean(((high - low) / truth) ** 2) ** 0.5
    print(f"S: energies of sonel, 40 000 packets, 95 % interval +-{width:.1f} % (rms); P: pyroomacoustics, {MORE} times the rays, mean of a room")


def scattered():
    print(f"\n{'one empty room, 6 x 5 x 3 m, T30 at 1 kHz':48} Eyring s  sonel s  pyroomacoustics s")
    for walls, floor, scattering in [(0.2, 0.2, 0.1), (0.2, 0.2, 0.5), (0.4, 0.05, 0.1), (0.4, 0.05, 0.5)]:
        coefficients = {"walls": walls, "z0": floor, "z1": floor}.items()
        materials = {name: {"absorption": absorption, "scattering": scattering} for name, absorption in coefficients}
        scene = sonel.Scene.shoebox([6, 5, 3], materials, sources=[1.5, 1.2, 1.5], receivers=[4, 3.5, 1.2])
        _, _, labels = by_sonel([scene], **FINE)
        _, [responses] = by_peer([peer(scene, MORE)])
        times = scene.room["bands"][4]["eyring_s"], labels[0, 0, 3], numpy.mean([t30(one)[3] for one in responses])
        print(f"{f'walls {walls}, floor, ceiling {floor}, scattering {scattering}':48} {times[0]:8.3f} {times[1]:8.3f} {times[2]:18.3f}")


def empty(count=20):
    draw, places = numpy.random.default_rng(7), CIRCLE[::2]
    rooms = []
    for size in draw.uniform([3, 3, 2.4], [8, 6, 3.5], (count, 3)):
        absorption, order = pyroomacoustics.inverse_sabine(draw.uniform(0.2, 0.8), size)
        source, receiver = draw.uniform(0.5, size - 0.5, (2, 3))
        scene = sonel.Scene.shoebox(size, {"absorption": absorption, "scattering": 0.1}, sources=source, receivers=receiver)
        box = partial(pyroomacoustics.ShoeBox, size, fs=RATE, materials=pyroomacoustics.Material(absorption, 0.1))
        rooms.append((scene, box, order))
    rows = {
        "sonel, default of dataset": by_sonel([scene for scene, _, _ in rooms], places),
        "pyroomacoustics, order 3 and rays": by_peer(placed(box(max_order=3, ray_tracing=True), scene, places) for scene, box, _ in rooms),
        "pyroomacoustics, image sources alone": by_peer(placed(box(max_order=order), scene, places) for scene, box, order in rooms),
    }
    print(f"\n{f'{count} empty rooms, 4 microphones each':48} CPU-s per response")
    for name, (seconds, *_) in rows.items():
        print(f"{name:48} {seconds / count / len(places):9.4f}")


if __name__ == "__main__":
    pyroomacoustics.random.seed(1)
    furnished(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
    scattered()
    empty()
    print(f"\nload of the machine: {os.getloadavg()[1]:.1f} processes on {os.cpu_count()} cores")
