"""The package against the programs: same bytes, same messages; and what is Python's own: views, interruption, threads.

`cargo xtask python-package` runs this with the folder of the programs in SONEL_PROGRAMS.
"""

import ast
import copy
import gc
import inspect
import json
import logging
import multiprocessing
import os
import pickle
import signal
import subprocess
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import sonel
from sonel import _sonel

ROOT = Path(__file__).resolve().parents[2]
SHOEBOX = ROOT / "scenes/shoebox/scene.toml"
PROGRAMS = Path(os.environ["SONEL_PROGRAMS"])
PACKETS = 1000
SEATS = {"near": [6.0, 4.0, 1.2], "far": [8.5, 5.5, 1.25]}


def run(name, *words, code=0):
    """Runs a program; returns what it wrote to stdout and stderr."""
    done = subprocess.run([PROGRAMS / name, *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == code, done.stderr
    return done.stdout, done.stderr


@pytest.fixture(scope="module")
def scene():
    return sonel.Scene.load(SHOEBOX)


@pytest.fixture(scope="module")
def room(scene):
    return sonel.trace(scene, packets=PACKETS)


@pytest.fixture
def response(room):
    return room.render(SEATS)


def test_sources_become_one_system_with_gains_and_delays_of_the_scene():
    sources = {"front": {"position": [2, 2, 1.5]}, "rear": {"position": [8, 5, 1.5], "gain_db": -6, "delay_s": 0.012}}
    room = sonel.trace(sonel.Scene.shoebox([10, 7, 3], 0.2, sources=sources, duration_s=0.4), packets=200)
    response = room.render([5.0, 3.0, 1.2])
    system = response.together()
    stated = [{"source": "front", "gain_db": 0, "delay_s": 0}, {"source": "rear", "gain_db": -6, "delay_s": 0.012}]
    assert system.sources == ["front + rear"]
    assert system.metadata["together"] == stated
    louder = response.together(gain_db={"rear": 3}, delay_s={"rear": 0})
    assert louder["source_power_level_db"][0, 0] == pytest.approx(90 + 10 * np.log10(1 + 10**0.3))
    for wrong in ({"gain_db": {"side": 3}}, {"delay_s": {"rear": 1.1}}, {"delay_s": {"rear": -0.1}}):
        with pytest.raises(sonel.Error, match="side|rear"):
            response.together(**wrong)


@pytest.fixture(scope="module")
def mapped(tmp_path_factory):
    """A map of the program."""
    path = tmp_path_factory.mktemp("program") / "room.sonelmap"
    run("sonel-trace", SHOEBOX, "-o", path, "--packets", PACKETS, "--quiet")
    return path


def cube(side=4.0, **options):
    """A cube of quadrilaterals, one of them carpeted."""
    corners = [[x, y, z] for x in (0, side) for y in (0, side) for z in (0, side)]
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    materials = {"plaster": 0.1, "carpet": {"absorption": 0.4, "scattering": 0.3}}
    names = ["plaster"] * 4 + ["carpet", "plaster"]
    given = {"sources": [1, 1, 1.5], "receivers": [3, 3, 1.2], "face_materials": names, **options}
    return sonel.Scene.from_mesh(np.array(corners), faces, materials, **given)


def test_a_map_has_the_bytes_of_the_programs(scene, room, mapped, tmp_path):
    room.save(tmp_path / "room.sonelmap")
    assert (tmp_path / "room.sonelmap").read_bytes() == mapped.read_bytes()
    assert sonel.Map.load(mapped).digest == room.digest
    assert sonel.trace(scene, packets=PACKETS, seed=2).digest != room.digest


def test_options_mean_what_they_mean_to_the_programs(scene, tmp_path):
    options = {"batches": 8, "survival": 0.5, "spectral": "per-band", "duration": 0.4, "effects": "auto,-air", "seed": 7}
    words = [word for name, value in options.items() for word in (f"--{name}", value)]
    run("sonel-trace", SHOEBOX, "-o", tmp_path / "a.sonelmap", "--packets", 300, "--quiet", *words)
    sonel.trace(scene, packets=300.0, threads=1, **options).save(tmp_path / "b.sonelmap")
    assert (tmp_path / "a.sonelmap").read_bytes() == (tmp_path / "b.sonelmap").read_bytes()


def test_a_map_is_extended_and_keeps_its_bytes(scene, room):
    longer = sonel.trace(scene, packets=2 * PACKETS, extend=room)
    assert longer.digest == sonel.trace(scene, packets=2 * PACKETS).digest
    with pytest.raises(sonel.Error, match="give the number of the whole new map"):
        sonel.trace(scene, packets=PACKETS, extend=room)


def test_targets_are_pursued_and_reported(scene):
    found = sonel.trace(scene, until="level<3dB", packets=4000)
    assert found.report["until"]["reached"] is True and found.report["until"]["packets"] == found.packets
    assert sonel.trace(scene, until="t30<0.001%", packets=2000).report["until"]["reached"] is False


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({}, []),
        ({"set": {"materials.walls.absorption": 0.3}}, ["--set", "materials.walls.absorption=0.3"]),
        ({"bin": 0.002, "estimator": "gather", "rays": 2048, "seed": 5, "air": False},
         ["--bin", 0.002, "--estimator", "gather", "--rays", 2048, "--seed", 5, "--no-air"]),
        ({"temperature": -5, "humidity": 20.0, "order": 3, "grid": "2:8:2,3,1.5", "directions": True},
         ["--temperature", -5, "--humidity", 20, "--order", 3, "--grid", "2:8:2,3,1.5", "--directions"]),
    ],
)  # fmt: skip
def test_a_response_has_the_bytes_of_the_programs(room, mapped, tmp_path, options, words):
    seats = [f"--receiver={name}={x},{y},{z}" for name, (x, y, z) in SEATS.items()]
    run("sonel-render", mapped, "-o", tmp_path / "a.npz", "--quiet", *seats, *words)
    response = room.render(SEATS, **options)
    response.save(tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    with np.load(tmp_path / "a.npz") as arrays:
        assert set(response.keys()) == set(arrays.files) - {"format_version", "digest"}
        for key in response:
            np.testing.assert_array_equal(response[key], arrays[key], strict=True)
    assert response.metadata == sonel.Response.load(tmp_path / "a.npz").metadata


def test_a_grid_of_arrays_is_that_of_its_text(room):
    given = [np.linspace(2, 8, 3), [3.0], 1.5]
    assert room.render(grid=given, rays=64).receivers == room.render(grid="2:8:3,3,1.5", rays=64).receivers
    for grid, message in [([1, 2], "three axes"), ([["a"], 1, 1], "an axis of grid is"), ([[1, 2, 4], 3, 1], "not evenly spaced")]:
        with pytest.raises(sonel.Error, match=message):
            room.render(grid=grid)


def test_errors_are_those_that_python_knows(room):
    with pytest.raises(ValueError, match="`bin`"):
        room.render(bin=-1)
    with pytest.raises(sonel.Error, match="cannot read"):
        sonel.Response.load("missing.npz")
    assert sonel.__version__ == room.render(SEATS, rays=64).metadata["tool_version"].split()[0].split("+")[0]


def test_notebooks_see_tables_and_pictures(room, response):
    pyplot = pytest.importorskip("matplotlib.pyplot")
    pyplot.switch_backend("agg")
    axes = response.plot_decay(receiver=1)
    assert len(axes.lines) == 8 and all(line.get_ydata()[0] == pytest.approx(0.0) for line in axes.lines)
    walls = cube().add_box([1, 2, 0], [2, 3, 1]).plot_room()
    assert len(walls.lines) == 12 and walls.get_xlabel() == "x [m]"
    level = response.parameters()["level_db"][0, 0, 4]
    assert f"<td>near</td><td>{level:.2f} ± " in response._repr_html_() and "<td>receiver</td>" in cube()._repr_html_()


def test_other_packages_get_arrays_with_their_coordinates(response):
    xarray = pytest.importorskip("xarray")
    data = response.to_xarray()
    assert isinstance(data, xarray.Dataset) and dict(data.sizes)["receiver"] == 2
    one = data.sel(receiver="far", source=response.sources[0], band=1000)
    assert float(one.t30_s) == response.parameters()["t30_s"][0, 1, 4] and one.energy.sum() == response.energy[0, 1, 4].sum()


def test_renderings_are_refined(room, mapped, tmp_path):
    refined = list(room.refine(SEATS))
    # A quarter of the map has not packets enough for intervals that hold.
    assert len(refined) == 2
    np.testing.assert_array_equal(refined[-1].energy, room.render(SEATS).energy)
    seats = [f"--receiver={name}={x},{y},{z}" for name, (x, y, z) in SEATS.items()]
    run("sonel-render", mapped, "-o", tmp_path / "a.npz", "--quiet", *seats, "--batches", 16)
    refined[0].save(tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    with pytest.raises(sonel.Error, match="has 32 batches"):
        room.render(SEATS, batches=33)


def _rendered(room):
    return room.render(SEATS, rays=64).energy, room.render(SEATS, rays=64).parameters()["t20_s"].shape


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork here")
def test_a_forked_process_has_threads_of_its_own(mapped):
    room = sonel.Map.load(mapped)
    expected, shape = _rendered(room)
    with multiprocessing.get_context("fork").Pool(1) as workers:
        energy, found = workers.apply_async(_rendered, (room,)).get(timeout=120)
    np.testing.assert_array_equal(energy, expected)
    assert found == shape


def test_maps_travel_by_their_path(mapped, tmp_path):
    loaded = sonel.Map.load(mapped)
    assert pickle.loads(pickle.dumps(loaded)).digest == copy.deepcopy(loaded).digest == loaded.digest
    fresh = sonel.trace(sonel.Scene.load(SHOEBOX), packets=50)
    by_bytes = pickle.dumps(fresh)
    fresh.save(tmp_path / "fresh.sonelmap")
    assert pickle.loads(pickle.dumps(fresh)).digest == pickle.loads(by_bytes).digest == fresh.digest
    assert len(pickle.dumps(fresh)) < 1000 < len(by_bytes)


def test_receivers_with_directivity_are_those_of_the_programs(room, mapped, tmp_path):
    mics = {
        "mic": {"position": [6, 4, 1.2], "directivity": "cardioid", "aim": [1, 0, 0]},
        "head": {"position": [6, 5, 1.2], "aim": [0, 1, 0]},
        "seat": [6, 3, 1.2],
    }
    words = ["mic=6,4,1.2,cardioid,1,0,0", "head=6,5,1.2,omni,0,1,0", "seat=6,3,1.2"]
    run("sonel-render", mapped, "-o", tmp_path / "a.npz", "--quiet", *(f"--receiver={word}" for word in words))
    response = room.render(mics)
    with np.load(tmp_path / "a.npz") as arrays:
        for key in arrays.files:
            if key not in ("format_version", "digest"):
                np.testing.assert_array_equal(response[key], arrays[key], strict=True)
    assert response["receiver_directivity"].tolist() == ["cardioid", "omni", "omni"]
    omni = room.render({"mic": [6, 4, 1.2]})
    assert response.energy[0, 0].sum() < 0.6 * omni.energy.sum()
    for table, message in [
        ({"position": [6, 4, 1.2], "nonsense": 1}, "unknown key 'nonsense'"),
        ({"position": [6, 4, 1.2], "directivity": "cardioid"}, "aim is missing"),
        ({"position": [6, 4, 1.2], "directivity": "cardiod", "aim": [1, 0, 0]}, "unknown directivity"),
        ({"directivity": "omni"}, "position is missing"),
    ]:
        with pytest.raises(sonel.Error, match=message):
            room.render({"mic": table})


def test_other_coefficients_one_per_band_change_the_response(room, response):
    felt = room.render(SEATS, set={"materials.walls.absorption": np.linspace(0.1, 0.8, 8)})
    assert np.all(felt.energy.sum(-1)[..., -1] < response.energy.sum(-1)[..., -1])
    assert np.all(felt.energy.sum(-1)[..., 0] > response.energy.sum(-1)[..., 0])


def test_a_map_carries_variants(tmp_path):
    walls = {"absorption": 0.9, "scattering": 0.0}
    scene = sonel.Scene.shoebox([10, 7, 3], {"walls": walls}, sources=[2, 2, 1.5], receivers=SEATS)
    change = {"materials.walls.absorption": 0.2, "materials.walls.scattering": 0.4}
    with pytest.raises(sonel.Error) as refused:
        sonel.trace(scene, packets=300).render(rays=64, set=change)
    # The remedy is a call of this package, which does it.
    remedy = str(refused.value).rpartition("trace the scene for them: ")[2]
    assert "variants={'materials.walls.absorption': [0.2], 'materials.walls.scattering': [0.4]}" in remedy
    assert eval(remedy, {"sonel": sonel, "scene": scene}).render(rays=64, set=change).energy.sum() > 0
    lists = {"materials.walls.absorption": [0.2, np.linspace(0.1, 0.3, 8)], "materials.walls.scattering": 0.4}
    room = sonel.trace(scene, packets=300, variants=lists)
    assert np.all(room.render(rays=64, set=change).energy.sum(-1) > room.render(rays=64).energy.sum(-1))
    with pytest.raises(sonel.Error, match="no material `felty`"):
        sonel.trace(scene, packets=300, variants={"materials.walls": "felty"})


def test_messages_name_functions_of_the_package_in_place_of_commands():
    command = "for more: sonel-trace SCENE.toml -o a.sonelmap --spectral per-band --packets 300 --for 'materials.a b.absorption=[0.1,0.2],0.3'\nnext"
    expected = "for more: sonel.trace(scene, spectral='per-band', packets=300, variants={'materials.a b.absorption': [[0.1, 0.2], 0.3]})\nnext"
    assert sonel._input.in_python(command) == expected
    longer = "sonel-trace SCENE.toml -o 'my map' --extend 'my map' --packets 70000"
    assert sonel._input.in_python(longer) == "sonel.trace(scene, extend=map, packets=70000)"
    cut = "sonel-trace SCENE.toml -o a --for 'materials.a [… 900 characters …]"
    assert sonel._input.in_python(cut) == cut
    with pytest.raises(sonel.Error, match=r"no material `felty`.*sonel\.library\(\)"):
        sonel.Scene.shoebox([5, 4, 3], "felty", sources=[1, 1, 1])


def test_the_library_has_what_scenes_take_from_it():
    library = sonel.library()
    assert len(library) > 200 and len({entry["source"] for entry in library.values()}) > 2
    scene = sonel.Scene.shoebox([5, 4, 3], {"walls": "carpet-heavy-on-concrete"}, sources=[1, 1, 1])
    entry = library["carpet-heavy-on-concrete"]
    used = sonel.trace(scene, packets=10, duration=0.1).materials["walls"]["absorption"]
    known = np.isfinite(entry["absorption"])
    assert known.sum() >= 6 and not known[0]
    np.testing.assert_allclose(used[known], entry["absorption"][known], rtol=1e-6)
    assert np.isnan(library["scattering-theatre-audience"]["absorption"]).all()


def test_parameters_are_those_of_the_program(response, tmp_path):
    response.save(tmp_path / "room.npz")
    printed, _ = run("sonel-analyze", "parameters", tmp_path / "room.npz", "--format", "json")
    rows = response.parameters()
    assert rows.shape == response.energy.shape[:3] and response.parameter_report() == json.loads(printed)
    for receiver, expected in enumerate(json.loads(printed)["receivers"]):
        for band, figures in enumerate(expected["bands"]):
            row, t30 = rows[0, receiver, band], figures["t30_s"]
            assert (row["receiver"], row["center_frequency_hz"]) == (expected["name"], figures["center_frequency_hz"])
            assert row["level_db"] == figures["level_db"]["value"]
            if t30["value"] is None:
                assert np.isnan(row["t30_s"])
            else:
                assert [row["t30_s"], row["t30_s_low"], row["t30_s_high"]] == [t30["value"], *t30["ci95"]]
        speech = expected["speech_transmission_index"]["value"]
        assert response.speech_transmission_index()[0, receiver] == speech


def test_noise_and_uncertain_materials_are_those_of_the_program(room, response, tmp_path):
    response.save(tmp_path / "a.npz")
    room.save(tmp_path / "a.sonelmap")
    words = ["--noise", "NR-35", "--speech", "raised", "--material-uncertainty", "0.05", "--map", tmp_path / "a.sonelmap"]
    printed = json.loads(run("sonel-analyze", "parameters", tmp_path / "a.npz", "--format", "json", *words)[0])
    options = {"noise": "NR-35", "speech": "raised", "material_uncertainty": 0.05, "map": room}
    assert response.parameter_report(**options)["receivers"] == printed["receivers"]
    rows, band = response.parameters(**options)[0, 0], 4
    t30 = printed["receivers"][0]["bands"][band]["t30_s"]
    assert [rows["t30_s_materials_low"][band], rows["t30_s_materials_high"][band]] == t30["ci95_materials"]
    assert np.isnan(rows["useful_to_detrimental_u50_db"][0]) and np.isfinite(rows["useful_to_detrimental_u50_db"][band])
    assert response.speech_transmission_index(noise=np.full(7, 60.0))[0, 0] < response.speech_transmission_index()[0, 0] - 0.02
    for wrong, message in [
        ({"noise": "NR-900"}, "no curve"),
        ({"noise": [40, 40]}, "seven levels"),
        ({"speech": "loud"}, "speech needs noise"),
        ({"material_uncertainty": 0.1}, "needs the map"),
        ({"material_uncertainty": {"roof": 0.1}, "map": room}, "no material"),
    ]:
        with pytest.raises(sonel.Error, match=message):
            response.parameter_report(**wrong)


def test_a_data_frame_has_a_row_for_every_receiver_and_band(response):
    pytest.importorskip("pandas")
    frame = response.to_pandas()
    assert len(frame) == 2 * 8 and set(frame["receiver"]) == set(SEATS)
    assert frame["t30_s"].tolist() == response.parameters()["t30_s"].ravel().tolist()


def test_arrays_are_views_that_outlive_the_response(response):
    energy = response.energy
    assert energy.ctypes.data == response.energy.ctypes.data and energy.dtype == np.float64
    with pytest.raises(ValueError, match="read-only"):
        energy[0] = 0.0
    expected, view = energy.copy(), response["arrival_direction"]
    assert view.shape == (len(response["arrival_kind"]), 3)
    with pytest.raises(KeyError, match="pressure"):
        response["pressure"]
    del response
    gc.collect()
    np.testing.assert_array_equal(energy, expected)


@pytest.mark.parametrize(
    "made",
    [
        lambda: cube(name='a "room" of Çelik', duration_s=0.5),
        lambda: sonel.Scene.shoebox(
            np.array([5, 4, 3]),
            {"walls": "floor-concrete", "z0": {"absorption": np.full(2, 0.3), "scattering": 0.2}},
            sources={"left": [1, 1, 1], "right": {"position": [4, 1, 1], "directivity": "cardioid", "aim": [0, 1, 0]}},
            receivers=[[2, 3, 1.2], [3, 3, 1.2]],
            bands={"center_frequencies_hz": [500, 1000]},
            duration_s=0.5,
        ),
    ],
)
def test_a_scene_of_python_is_a_scene_of_the_programs(made, tmp_path):
    scene = made()
    path = scene.save(tmp_path / "room")
    run("sonel-trace", path, "-o", tmp_path / "room.sonelmap", "--packets", 200, "--quiet")
    assert sonel.Map.load(tmp_path / "room.sonelmap").digest == sonel.trace(scene, packets=200).digest
    assert sonel.Scene.load(path).sources == scene.sources
    printed, _ = run("sonel-trace", "check", path, "--json")
    assert json.loads(printed)["room"] == scene.check()["room"] == sonel.check(path)["room"]
    with pytest.raises(sonel.Error, match="exists"):
        scene.save(tmp_path / "room")


def test_a_mesh_has_the_sizes_of_its_polygons():
    room = cube(4.0).check()["room"]
    assert room["volume_m3"] == pytest.approx(64.0) and room["area_m2"] == pytest.approx(96.0)
    areas = {material["name"]: material["area_m2"] for material in room["materials"]}
    assert areas == {"plaster": pytest.approx(80.0), "carpet": pytest.approx(16.0)}
    absorption = 80 * 0.1 + 16 * 0.4
    dry = cube(4.0, air={"attenuation": False, "speed_of_sound": 343.0}).check()["room"]["bands"][0]
    assert dry["sabine_s"] == pytest.approx(24 * np.log(10) / 343.0 * 64 / absorption)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"packets": 0}, ["--packets", 0]),
        ({"survival": 2.0, "packets": 0}, ["--survival", 2, "--packets", 0]),
        ({"until": "t31<1%"}, ["--until", "t31<1%"]),
        ({"effects": "auto,-airs"}, ["--effects", "auto,-airs"]),
        ({"mode": "paper", "survival": 0.5}, ["--mode", "paper", "--survival", 0.5]),
    ],
)
def test_bad_options_get_the_message_of_the_program(scene, tmp_path, options, words):
    _, said = run("sonel-trace", SHOEBOX, "-o", tmp_path / "a.sonelmap", "--quiet", *words, code=2)
    with pytest.raises(sonel.Error) as raised:
        sonel.trace(scene, **options)
    message = str(raised.value)
    assert "--" not in message.replace("sonel-render --effects", "") and f"`{list(options)[-1]}`" in message
    assert message.rpartition("`: ")[2].replace("`", "") in said.replace("--", "")


@pytest.mark.parametrize(
    ("work", "message"),
    [
        (lambda scene, _: sonel.trace(scene, mode="precise"), "`mode` is \"precise\": choose among accurate, paper"),
        (lambda scene, _: sonel.trace(scene, spectral="all"), "`spectral` is \"all\""),
        (lambda scene, _: sonel.trace(scene, batches=-1), "`batches` is -1: give a whole number"),
        (lambda scene, _: sonel.trace(scene, batches=5000), "`batches` 5000 is outside 1 … 4096"),
        (lambda scene, _: sonel.trace(scene, packets=1.5), "`packets` is 1.5"),
        (lambda scene, _: sonel.trace(scene, packets=10**9), "CPU time .*but `at_most` allows 10 min on .*allow more, or give fewer packets"),
        (lambda _, room: room.render(rays=4 * 10**9), "but `at_most` allows 10 min on .*give .*fewer rays"),
        (lambda scene, _: sonel.trace(scene, survival="high"), "`survival` is high: give a number"),
        (lambda _, room: room.render(bin=-1), "`bin` -1 s is no width"),
        (lambda _, room: room.render(rays=0), "`rays` 0"),
        (lambda _, room: room.render(estimator="best"), "`estimator` is \"best\": choose among auto"),
        (lambda _, room: room.render(effects="-air"), "`effects`: .*-diffraction"),
        (lambda _, room: room.render(grid="1:2"), "`grid`: .*lo:hi:n"),
        (lambda _, room: room.render(air=False, humidity=50), "`air` is False"),
        (lambda _, room: room.render(set=[1]), "`set` is .*give a mapping"),
    ],
)
def test_bad_options_are_named_as_in_python(scene, room, work, message):
    with pytest.raises(sonel.Error, match=message):
        work(scene, room)


def test_a_name_may_hold_what_separates_others():
    scene = sonel.Scene.shoebox([10, 7, 3], {"walls": 0.2, "z1": 0.2}, sources=[2, 2, 1.5], receivers=SEATS)
    corners = [[x, y, z] for x in (0, 10) for y in (0, 7) for z in (0, 3)]
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    odd = {"absorption": 0.2, "scattering": 0.1}
    points = {"sources": [2, 2, 1.5], "receivers": SEATS}
    named = sonel.Scene.from_mesh(corners, faces, {'wall.a="b': odd}, **points)
    assert named.materials == ['wall.a="b'] and named.check()["room"]["volume_m3"] == scene.check()["room"]["volume_m3"]
    room = sonel.trace(named, packets=300)
    felt = room.render(rays=64, set={'materials.wall.a="b.absorption': 0.3})
    assert np.all(felt.energy.sum(-1) < room.render(rays=64).energy.sum(-1))


def test_bad_files_get_the_message_of_the_program(mapped, tmp_path):
    wrong = tmp_path / "scene.toml"
    wrong.write_text("shoebox = [1, 2, -3]\nwals = 1\n[[sources]]\nposition = [0, 0, 0]\n")
    _, said = run("sonel-trace", wrong, "-o", tmp_path / "a.sonelmap", code=2)
    with pytest.raises(sonel.Error) as raised:
        sonel.Scene.load(wrong)
    assert str(raised.value) in said and "wals: unknown key" in str(raised.value)
    assert any("wals" in problem for problem in sonel.check(wrong)["errors"])
    damaged = tmp_path / "damaged.sonelmap"
    damaged.write_bytes(mapped.read_bytes()[:5000])
    _, said = run("sonel-render", damaged, "-o", tmp_path / "a.npz", code=2)
    with pytest.raises(sonel.Error) as raised:
        sonel.Map.load(damaged)
    assert str(raised.value) in said
    for load in (sonel.Map.load, sonel.Response.load, sonel.Scene.load):
        with pytest.raises(FileNotFoundError, match=r"cannot read .*missing"):
            load(tmp_path / "missing")


@pytest.mark.parametrize(
    ("work", "message"),
    [
        (lambda room: room.render([0, 0, 0]), "0 m from a surface"),
        (lambda room: room.render([[1, 2]]), "shape"),
        (lambda room: room.render({"a": [1, 2, "x"]}), "three finite numbers"),
        (lambda room: room.render(np.empty((0, 3))), "receivers is empty"),
        (lambda room: room.render({}), "receivers is empty"),
        (lambda room: room.render(SEATS, threads=-1), "`threads` is -1"),
        (lambda room: next(room.refine(SEATS, until="t30<1%")), "refine has no option 'until'"),
        (lambda room: room.walk([[0, 1, 1, 1]], [1.0], sample_rate="16000"), "sample_rate is '16000': .* from 8000 to 192000 Hz"),
        (lambda _: sonel.trace("scene.toml"), "scene is 'scene.toml': give a sonel.Scene"),
        (lambda room: room.render({"": [1, 2, 1]}), "empty name"),
        (lambda room: room.render([1, 2, np.nan]), "finite numbers"),
        (lambda room: room.render(SEATS, set={"materials.roof.absorption": 0.1}), "it has"),
        (lambda room: room.render(SEATS, set={"materials.walls.absorption": 2}), "outside 0 … 1"),
        (lambda _: cube(face_materials=["plaster"]), "1 names and faces has 6"),
        (lambda _: cube(face_materials=["velvet"] * 6), "no table"),
        (lambda _: cube(sources=[9, 9, 9]), "outside the room"),
        (lambda _: cube(pitch=3), "pitch: unknown key"),
        (lambda _: cube(name=object()), "texts, numbers"),
        (lambda _: sonel.Scene.from_mesh([[0, 0, 0]] * 3, [[0, 1, -1]], 0.1, sources=[1, 1, 1]), "vertices, counted from 0"),
        (lambda _: sonel.Scene.from_mesh([[0, 0]], [[0, 0, 0]], 0.1, sources=[1, 1, 1]), "shape"),
        (lambda _: sonel.Scene.from_mesh([[0, 0, 0]], [[0.5, 1, 2]], 0.1, sources=[1, 1, 1]), "indices"),
        (lambda _: sonel.Scene.from_mesh([[0, 0, 0]], [], 0.1, sources=[1, 1, 1]), "faces are none"),
        (lambda _: sonel.Scene.from_mesh([[0, 0, 0]] * 3, [[0, 1, 2], []], 0.1, sources=[1, 1, 1]), r"faces\[1\] is \[\]"),
        (lambda _: sonel.Scene.from_mesh([[0, 0, 0]], [[0, 0, np.nan]], 0.1, sources=[1, 1, 1]), r"faces\[0\]"),
        (lambda _: sonel.Scene.from_mesh([[0, 0, 0]], [[0, 0, 0]], {"a\nb": 0.1}, sources=[1, 1, 1]), "rename"),
    ],
)  # fmt: skip
def test_bad_input_is_named(room, work, message):
    with pytest.raises(sonel.Error, match=message):
        work(room)


def test_nothing_foreign_is_overwritten(room, response, mapped, tmp_path):
    notes = tmp_path / "notes"
    notes.write_text("mine")
    for save in (room.save, response.save):
        with pytest.raises(sonel.Error, match="exists and is not"):
            save(notes)
    loaded = sonel.Map.load(mapped)
    with pytest.raises(sonel.Error, match="is an input"):
        loaded.save(mapped)
    assert notes.read_text() == "mine"


def test_a_loaded_map_stays_what_it_was(scene, room, tmp_path):
    path = tmp_path / "room.sonelmap"
    room.save(path)
    loaded = sonel.Map.load(path)
    sonel.trace(scene, packets=50).save(path)
    assert loaded.packets == PACKETS and sonel.Map.load(path).packets == 50
    np.testing.assert_array_equal(loaded.render(SEATS).energy, room.render(SEATS).energy)


def test_progress_rises_to_one_and_the_log_has_warnings_and_notes(scene, caplog):
    heard = []
    with caplog.at_level(logging.INFO, logger="sonel"):
        sonel.trace(scene, packets=20, progress=lambda what, share: heard.append((what, share)))
    assert {what for what, _ in heard} == {"tracing"} and heard[-1][1] == 1.0
    assert [share for _, share in heard] == sorted(share for _, share in heard)
    levels = {record.levelno for record in caplog.records}
    assert levels == {logging.INFO, logging.WARNING}, "20 packets in 32 batches are warned of"


def stops(work):
    """Whether `work`, which would take far longer, was left and soon nothing goes on computing."""
    end = time.monotonic() + 20.0
    work()
    while time.monotonic() < end:
        before = time.process_time()
        time.sleep(0.5)
        if time.process_time() - before < 0.2:
            return True
    return False


def test_what_progress_raises_ends_the_work(scene, tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))

    def fail(what, share):
        raise RuntimeError(what)

    def work():
        with pytest.raises(RuntimeError, match="tracing"):
            sonel.trace(scene, packets=3_000_000, progress=fail)

    assert stops(work)
    assert list(tmp_path.iterdir()) == [], "a map that is not finished leaves no file"


@pytest.mark.parametrize("stage", ["trace", "render", "impulse_responses", "walk"])
def test_an_interruption_ends_the_work(scene, room, stage, monkeypatch):
    def interrupted(*_):
        signal.raise_signal(signal.SIGINT)

    def interrupted_soon(*_):
        threading.Timer(0.2, interrupted).start()

    if stage == "impulse_responses":
        many = room.render(grid="1:9:8,1:6:8,1.5", rays=64)
    if stage == "walk":
        path = [[0, 1, 1, 1.5], [10, 9, 6, 1.5]]
        places = room.render(dict(_sonel.places(path, 0.25)), rays=64)
        monkeypatch.setattr(room, "render", lambda *_, **__: places)

    def work():
        with pytest.raises(KeyboardInterrupt):
            if stage == "trace":
                sonel.trace(scene, packets=3_000_000, progress=interrupted)
            elif stage == "render":
                room.render(SEATS, grid="1:9:10,1:6:10,1.5", progress=interrupted)
            elif stage == "impulse_responses":
                interrupted_soon()
                many.impulse_responses(sample_rate=192_000)
            else:
                interrupted_soon()
                room.walk(path, np.ones(1_000_000), sample_rate=192_000)

    # Where a shell starts this in the background, interruptions are ignored.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        assert stops(work)
    finally:
        signal.signal(signal.SIGINT, before)


def test_other_threads_of_python_run_meanwhile(scene):
    counted, done = [0], threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    threading.Thread(target=count, daemon=True).start()
    before = counted[0]
    sonel.trace(scene, packets=40_000)
    during = counted[0] - before
    done.set()
    assert during > 20


def test_two_renderings_at_once_do_not_disturb_each_other(room):
    responses = {}

    def render(absorption):
        change = {"materials.walls.absorption": absorption}
        responses[absorption] = room.render(SEATS, set=change).energy.sum()

    workers = [threading.Thread(target=render, args=(absorption,)) for absorption in (0.1, 0.5)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    both = responses.copy()
    render(0.1)
    render(0.5)
    assert both == responses and both[0.1] > both[0.5]


def test_scenes_and_responses_are_pickled_and_copied(scene, room):
    made = sonel.Scene.shoebox([4, 3, 2.5], 0.2, sources=[1, 1, 1], receivers=[3, 2, 1])
    for one in (scene, made):
        again = pickle.loads(pickle.dumps(one))
        assert again.toml == one.toml and again.sources == one.sources
    response = room.render(SEATS)
    again = pickle.loads(pickle.dumps(response))
    assert again.energy.tobytes() == response.energy.tobytes() and again.receivers == response.receivers
    for one in (scene, made, room, response):
        assert copy.deepcopy(one) is one and copy.copy(one) is one


def test_a_with_statement_closes_what_it_opened(mapped, tmp_path):
    path = tmp_path / "own.sonelmap"
    path.write_bytes(mapped.read_bytes())

    def is_open():
        return str(path) in Path("/proc/self/maps").read_text()

    with sonel.Scene.load(SHOEBOX) as scene, sonel.Map.load(path) as room:
        assert is_open() and scene.sources
        with room.render(SEATS) as response:
            energy = response.energy
            total = energy.sum()
    assert not is_open()
    assert energy.sum() == total
    made = sonel.Scene.shoebox([4, 3, 2.5], 0.2, sources=[1, 1, 1])
    made.close()
    made.close()
    uses = [
        lambda: scene.toml,
        lambda: scene.sources,
        lambda: sonel.trace(scene, packets=1),
        lambda: made.with_materials(0.3),
        lambda: room.digest,
        lambda: room.render(SEATS),
        lambda: response.keys(),
        lambda: response.parameters(),
        lambda: response.energy,
        lambda: pickle.dumps(room),
        lambda: pickle.dumps(made),
        lambda: response.__enter__(),
    ]
    for use in uses:
        with pytest.raises(sonel.Error, match=r"this sonel\.(Scene|Map|Response) is closed: use it within"):
            use()
    assert [repr(one) for one in (scene, room, response)] == [f"<sonel.{kind}, closed>" for kind in ("Scene", "Map", "Response")]
    with pytest.raises(AttributeError, match="'Scene' object has no attribute 'size'"):
        _ = sonel.Scene.load(SHOEBOX).size
    with pytest.raises(RuntimeError), sonel.Map.load(path) as room:
        raise RuntimeError
    assert not is_open()


def _sections(text):
    """Sections of a docstring of numpydoc: names and types at the margin, in order."""
    lines = inspect.cleandoc(text).splitlines()
    titles = [at - 1 for at, line in enumerate(lines) if line and not line.strip("-") and len(line) == len(lines[at - 1])]
    ends = [*titles[1:], len(lines)]
    sections = {lines[at]: lines[at + 2 : end] for at, end in zip(titles, ends)}
    for title, body in sections.items():
        margin = [at for at, line in enumerate(body) if line and not line.startswith(" ")]
        assert margin and all(body[at + 1].startswith("    ") for at in margin), (title, body)
        sections[title] = [name for at in margin for name in body[at].split(", ")] if title == "Parameters" else [body[at] for at in margin]
    return sections


def test_docstrings_have_the_sections_of_numpydoc():
    functions = {name: getattr(sonel, name) for name in sonel.__all__ if inspect.isfunction(getattr(sonel, name))}
    for kind in (sonel.Scene, sonel.Map, sonel.Response):
        members = inspect.getmembers(kind, lambda member: inspect.isfunction(member) or inspect.ismethod(member))
        functions |= {f"{kind.__name__}.{name}": member for name, member in members if not name.startswith("_")}
    assert len(functions) > 30
    stars = {inspect.Parameter.VAR_KEYWORD: "**", inspect.Parameter.VAR_POSITIONAL: "*"}
    for name, function in functions.items():
        signature = inspect.signature(function)
        parameters = [stars.get(one.kind, "") + one.name for one in signature.parameters.values() if one.name != "self"]
        sections = _sections(function.__doc__)
        assert sections.pop("Parameters", []) == parameters, name
        assert sections.pop("Raises", []) == (["Error"] if parameters else []), name
        returned = [kind for title in ("Returns", "Yields") for kind in sections.pop(title, [])]
        assert len(returned) == (signature.return_annotation not in (None, "None")), name
        assert not sections, name
    with pytest.raises(AssertionError):
        _sections("Text.\n\nParameters\n----------\none\ntwo\n    Of two.")


def test_the_stubs_name_what_is_compiled():
    stubs = ast.parse((Path(sonel.__file__).parent / "_sonel.pyi").read_text())
    named = {}
    for node in stubs.body:
        if isinstance(node, ast.ClassDef):
            named[node.name] = {item.name for item in node.body if isinstance(item, ast.FunctionDef)}
        elif isinstance(node, ast.FunctionDef):
            named[node.name] = set()
    compiled = {name for name in dir(_sonel) if not name.startswith("__")}
    assert compiled == set(named)
    for name in ("Scene", "Map", "Array", "Response"):
        own = {member for member in vars(getattr(_sonel, name)) if not member.startswith("__")}
        assert own == {member for member in named[name] if not member.startswith("__")}
