"""CPU time to an accuracy of level and T30 by sonel and by two unbiased programs, acoustic_spaces and misuka, in the same rooms:
`cargo xtask bench unbiased [SEEDS]`.

All have the coefficients at 1 kHz, specular and Lambert's reflections, no attenuation by air, no diffraction. Level and T30 are read from
energies in steps of 1 ms by the same lines. The cost is seconds of a run × (standard deviation / target)².

- sonel: default packets and estimators, all octaves of the scene.
- acoustic_spaces: image sources to order 3, then rays, shared by all octaves, with diffuse rain, splitting, a sphere of its choice (0.5 m).
- misuka: one frequency, emitter sampling with MIS, a sphere for a source, which sound passes through. It needs the LLVM of
  DRJIT_LIBLLVM_PATH or of rustc (15 and 16 fail on AVX-512). Compilation and reading of meshes are left out of its seconds.
"""

import os
import pathlib
import subprocess
import sys
import time
import tomllib

import numpy
import scipy.stats
import sonel

if "DRJIT_LIBLLVM_PATH" not in os.environ:
    sysroot = subprocess.run(["rustc", "--print", "sysroot"], capture_output=True, text=True, check=True).stdout.strip()
    os.environ["DRJIT_LIBLLVM_PATH"] = str(max(pathlib.Path(sysroot, "lib").glob("libLLVM*so*"), key=lambda path: path.stat().st_size))

import misuka  # noqa: E402, it looks for LLVM
from acoustic_spaces import Room, Scene, simulate  # noqa: E402

SCENES = pathlib.Path(__file__).parents[2] / "scenes"
BAND, STEP, LEVEL, T30, OFF = 1000, 1e-3, 0.1, 0.01, "-diffraction,-boundary"
# Scene, receiver, radius of misuka's source [m], rays of acoustic_spaces, paths of misuka. Radii are as large as surfaces and the bias of
# levels allow, rays and paths those of some seconds. The office is symmetric: at its own receivers mirror images end at edges.
ROOMS = [
    ("shoebox/scene.toml", (7.0, 5.0, 1.2), 0.5, 50_000, 200_000),
    ("office/screens-1.4.toml", (8.3, 4.7, 1.25), 0.4, 200_000, 800_000),
    ("hall/scene.toml", (-7.0, 19.6, 2.4), 1.0, 50_000, 200_000),
]


def by_sonel(scene, receiver, seed):
    response = sonel.trace(scene, seed=seed, threads=2).render(receiver, effects=OFF, air=False, threads=2)
    return response.energy[0, 0, list(response["center_frequency_hz"]).index(BAND)]


def peer_scene(scene, path, receiver, materials):
    keys = tomllib.loads(path.read_text())
    box = "shoebox" in keys
    return {
        "name": path.stem,
        "geometry": {"box": keys["shoebox"]} if box else {"file": path.parent / keys["mesh"], "units": "m", "up_axis": "z"},
        "materials": {name: {"absorption": [absorption] * 8, "scattering": scattering} for name, (absorption, scattering) in materials.items()},
        "assignments": dict.fromkeys(["walls", "floor", "ceiling"], "walls") if box else {name: name for name in materials},
        "sources": [{"name": "source", "position": list(*scene.sources.values())}],
        "listeners": [{"name": "receiver", "position": list(receiver)}],
        "air": {"temperature_c": keys.get("air", {}).get("temperature_celsius", 20), "pressure_kpa": 1e9},  # which attenuates nothing
    }


def by_spaces(document, seconds, rays, seed):
    early = {"method": "image_sources" if "box" in document["geometry"] else "ray_tracing", "diffraction": "none"}
    stages = {"early": early, "late": {"rays": rays, "directions": 0, "device": "cpu"}}
    keys = {**stages, "scattering": {"method": "random", "from_size": False}, "ir_length_s": seconds, "seed": seed}
    [response] = simulate(Room.from_scene(Scene(**document, simulation=keys)), threads=2).responses.values()
    return response.energy(STEP)[list(response.band_hz).index(BAND)]


def by_misuka(scene, receiver, materials, room, seconds, radius, paths):
    misuka.set_variant("llvm_ad_acoustic")
    document = {"type": "scene"}
    for name, (absorption, scattering) in materials.items():
        faces = room.mesh.faces[room.face_materials == room.material_names.index(name)]
        values = {"absorption": {"type": "uniform", "value": absorption}, "scattering": {"type": "uniform", "value": scattering}}
        properties = misuka.Properties()
        properties["bsdf"] = misuka.load_dict({"type": "twosided", "bsdf": {"type": "acousticbsdf", **values}})
        document[name] = misuka.Mesh(name, 3 * len(faces), len(faces), props=properties)
        values = misuka.traverse(document[name])
        values["vertex_positions"], values["faces"] = room.mesh.vertices[faces].ravel(), numpy.arange(faces.size)
        values.update()
    # Power 1: radiance times π times the surface of the sphere.
    light = {"type": "area", "radiance": {"type": "uniform", "value": 1 / (2 * numpy.pi * radius) ** 2}}
    document["source"] = {"type": "sphere", "radius": radius, "center": list(*scene.sources.values()), "emitter": light, "bsdf": {"type": "null"}}
    film = {"type": "tape", "time_bins": round(seconds / STEP), "frequencies": str(BAND), "rfilter": {"type": "box"}, "sample_border": False}
    document["microphone"] = {"type": "microphone", "origin": list(receiver), "direction": [1, 0, 0], "kappa": 0, "film": film}
    loaded = misuka.load_dict(document)
    integrator = misuka.load_dict({"type": "acoustic_path", "max_time": seconds, "speed_of_sound": scene.speed_of_sound})
    return lambda seed: 4 * numpy.pi * numpy.array(integrator.render(loaded, seed=seed, spp=paths), float)[:, 0, 0]  # of means over directions


def measured(run, seed):
    """Level [dB] of energy for source power 1, T30 [s], CPU time [s]."""
    begin = time.process_time()
    energy = run(seed)
    seconds = time.process_time() - begin
    level = 10 * numpy.log10(numpy.maximum(numpy.cumsum(energy[::-1])[::-1], 1e-30))
    first, last = numpy.argmax(level < level[0] - 5), numpy.argmax(level < level[0] - 35)
    return level[0], -60 * STEP / numpy.polyfit(numpy.arange(first, last), level[first:last], 1)[0], seconds


def compare(name, receiver, radius, rays, paths, seeds):
    path = SCENES / name
    scene = sonel.Scene.load(str(path))
    index = [band["center_frequency_hz"] for band in scene.room["bands"]].index(BAND)
    probe = sonel.trace(scene, packets=1000)
    materials = {key: (float(entry["absorption"][index]), float(entry["scattering"][index])) for key, entry in probe.materials.items()}
    seconds = float(probe.render(receiver, effects=OFF)["time_edges_s"][-1])
    document = peer_scene(scene, path, receiver, materials)
    runs = {
        "sonel": lambda seed: by_sonel(scene, receiver, seed),
        "acoustic_spaces": lambda seed: by_spaces(document, seconds, rays, seed),
        "misuka": by_misuka(scene, receiver, materials, Room.from_scene(Scene(**document)), seconds, radius, paths),
    }
    found = numpy.array([[measured(run, seed) for run in runs.values()] for seed in range(seeds + 1)])[1:]  # seed 0 compiles
    mean, deviation = found.mean(axis=0), found.std(axis=0, ddof=1)
    costs = mean[:, 2:] * (deviation[:, :2] / [LEVEL, T30] / [[1, time] for time in mean[:, 1]]) ** 2
    for program, values, errors, cost in zip(runs, mean, deviation / seeds**0.5, costs):
        shown = f"{values[0]:8.3f} ± {errors[0]:.3f}  {values[1]:.4f} ± {errors[1]:.4f} {values[2]:7.2f} {cost[0]:9.3f} {cost[1]:9.3f}"
        print(f"{name:24} {program:16} {shown} {cost[0] / costs[0, 0]:9.1f} {cost[1] / costs[0, 1]:7.1f}", flush=True)


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 32
    print(f"{'means ± standard errors, CPU seconds':41} {'level [dB]':>16}  {'T30 [s]':15} {'a run':>7}  to 0.1 dB to 1 % T30 ratios to sonel")
    for room in ROOMS:
        compare(*room, count)
    factor = scipy.stats.f.ppf(0.975, count - 1, count - 1)
    print(f"\n95 % intervals of ratios: a factor of {factor:.1f} down and up; load: {os.getloadavg()[1]:.1f} processes on {os.cpu_count()} cores")
