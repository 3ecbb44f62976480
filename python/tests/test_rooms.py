"""Furnished rooms and data sets of them: exact sizes, the same bytes for any number of workers, and after a run that was killed.

`cargo xtask python-package` runs this.
"""

import io
import json
import os
import pickle
import re
import subprocess
import sys
import tarfile
import time
import types
from pathlib import Path

import numpy as np
import pytest
import sonel
from sonel import _dataset

ROOMS = {"seed": 3, "size": [[3, 3, 2.4], [4, 4, 2.6]], "t60": (0.2, 0.4)}
QUICK = {"trace": {"packets": 300}, "render": {"order": 1, "rays": 64, "effects": "-diffraction"}, "progress": False}
ARRAY = [[0.0, 0.03, 0.0], [0.0, -0.03, 0.0]]
# Loads data without workers and then with two that are forked after sonel has worked; both must be the same.
LOADER = """
import pathlib
import numpy as np, sonel, torch

{dataset}

data = {made}
loaders = [
    torch.utils.data.DataLoader(data, batch_size=4),
    torch.utils.data.DataLoader(data, batch_size=4, num_workers=2, multiprocessing_context="fork"),
]
alone, forked = [[[part.numpy() for part in batch] for batch in loader] for loader in loaders]
assert len(alone) == 2
for own, other in zip(alone, forked):
    for left, right in zip(own, other):
        np.testing.assert_array_equal(left, right)
"""
SIMULATED = """
class Simulated(torch.utils.data.Dataset):
    def __len__(self):
        return 6
    def __getitem__(self, index):
        scene = sonel.Scene.shoebox([5, 4, 3], 0.3, sources=[1, 1, 1.5], receivers=[4, 3, 1.2], duration_s=0.3)
        response = sonel.trace(scene, packets=300, seed=index + 1).render(rays=64)
        return torch.tensor(response.energy), torch.tensor(response.parameters()["clarity_c50_db"])
"""


def shoebox(**keys):
    return sonel.Scene.shoebox([5, 4, 3], {"walls": 0.2, "z0": "carpet-thin"}, sources=[1, 1, 1.5], receivers=[4, 3, 1.2], **keys)


def areas(scene):
    return {material["name"]: material["area_m2"] for material in scene.room["materials"]}


def test_boxes_and_objects_take_their_volume_and_have_their_materials():
    corners = [[x, y, z] for x in (-0.5, 0.5) for y in (-0.25, 0.25) for z in (0, 1)]
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    plain = shoebox()
    room = plain.add_box([2, 1.8, 0.7], [2.5, 1, 0], "wood-50mm").add_object((corners, faces), {"absorption": 0.5}, at=[4, 1, 0], turn=90)
    found = room.room
    assert found == room.check()["room"] and found["volume_m3"] == pytest.approx(60 - 0.5 * 0.8 * 0.7 - 0.5)
    expected = {"walls": 54 + 20, "z0": 20 - 0.4 - 0.5, "wood-50mm": 0.4 + 2.6 * 0.7, "object 1": 0.5 + 3.0}
    assert areas(room) == pytest.approx(expected)
    # Turned by 90° it is 1 m long in y: beside a source that a box of the other sense would hold.
    assert sonel.trace(room, packets=50).render([4.4, 1.0, 0.5]).energy.sum() > 0
    with pytest.raises(sonel.Error, match="inside a closed object"):
        sonel.trace(room, packets=50).render([4.0, 1.4, 0.5])
    assert areas(plain) == pytest.approx({"walls": 74, "z0": 20}), "a scene stays as it is"
    for work, message in [
        (lambda: room.add_box([1, 1], [2, 2, 1]), "low is"),
        (lambda: room.add_box([1, 1, 0], [2, 2, 1], "no-such-wood"), "no-such-wood"),
        (lambda: room.add_object(([[0, 0, 0]], [[0, 1, 2]])), "1 vertices, counted from 0"),
        (lambda: room.add_object((corners, [[0, 1.5, 2]])), r"faces\[0\] of the mesh is"),
        (lambda: room.add_object((corners, faces), at=[5, 3, 0]), "the mesh from .* leaves the room"),
        (lambda: room.add_box([2.2, 1.1, 0], [3, 1.2, 1]), r"overlaps another from \[2, 1, 0\] to \[2.5, 1.8, 0.7\] m"),
        (lambda: room.add_box([6, 1, 0], [7, 2, 1]), "has no volume in the room"),
    ]:
        with pytest.raises(sonel.Error, match=message):
            work()


def test_a_box_through_a_wall_of_a_shoebox_ends_there():
    assert shoebox().add_box([-1, 1, -1], [0.5, 2, 1]).room == shoebox().add_box([0, 1, 0], [0.5, 2, 1]).room


def test_sides_of_a_shoebox_keep_their_names_with_furniture_in_it():
    changed, furniture = {"x0": 0.9, "walls": 0.3}, ([2, 1, 0], [3, 2, 0.8], 0.1)
    room = shoebox().add_box(*furniture).with_materials(changed)
    assert areas(room) == areas(shoebox().with_materials(changed).add_box(*furniture))
    assert areas(room)["x0"] == pytest.approx(12.0)
    with pytest.raises(sonel.Error, match="no face is of the material 'x9'"):
        room.with_materials({"x9": 0.5})


def test_objects_are_placed_in_metres_whatever_the_unit_of_the_mesh():
    box = types.SimpleNamespace(
        vertices=[[x, y, z] for x in (0, 6) for y in (0, 4) for z in (0, 3)],
        faces=[[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]],
    )
    in_metres = sonel.Scene.from_mesh(box, materials=0.2, sources=[1, 1, 1.5])
    room = sonel.Scene.from_mesh(1000 * np.array(box.vertices), box.faces, 0.2, sources=[1, 1, 1.5], mesh_unit="mm")
    for scene in (in_metres, room):
        assert scene.add_box([3, 1, 0], [4, 2, 1]).room["volume_m3"] == pytest.approx(71.0)
        with pytest.raises(sonel.Error, match="the box from .* leaves the room"):
            scene.add_box([3, 1, -1], [4, 2, 1])
    ground = sonel.Scene.from_mesh(box.vertices, box.faces[4:5], 0.2, sources=[1, 1, 1.5], duration_s=0.2)
    assert "wood-50mm" in ground.add_box([3, 1, 0], [4, 2, 1], "wood-50mm").materials, "in the open nothing ends"


@pytest.mark.parametrize(
    ("work", "message"),
    [
        (lambda: sonel.random_rooms(2.5), "count is 2.5"),
        (lambda: sonel.random_rooms(1, seed=None), "seed is None"),
        (lambda: sonel.random_rooms(1, t60=0.5), "t60 is 0.5: give the shortest and the longest"),
        (lambda: sonel.random_rooms(1, t60=(0.8, 0.2)), "t60 is"),
        (lambda: sonel.random_rooms(1, t60=(np.nan, 1)), "t60 is"),
        (lambda: sonel.random_rooms(1, size=[[3, 3, 3], [4, 4, np.inf]]), "size is"),
        (lambda: sonel.random_rooms(1, furniture=3), "furniture is 3"),
        (lambda: sonel.random_rooms(1, materials=0.3), "materials is not a key"),
        (lambda: shoebox().absorption_for("x"), "t60 is 'x'"),
        (lambda: shoebox().absorption_for([0.5] * 7), "one for each of 8 bands"),
        (lambda: sonel.dataset(shoebox(), "."), "rooms is <sonel.Scene"),
        (lambda: sonel.dataset([shoebox()], ".", early=-1), "early is -1"),
        (lambda: sonel.dataset([shoebox()], ".", workers=-1), "workers is -1"),
        (lambda: sonel.dataset([shoebox()], ".", shards=1), "shards is 1"),
        (lambda: sonel.dataset([shoebox()], ".", seed=2**64), "seed is"),
        (lambda: sonel.dataset([shoebox()], ".", trace={"threads": 2}), "trace has no option 'threads'"),
    ],
)
def test_bad_input_names_its_argument(work, message):
    with pytest.raises(sonel.Error, match=message):
        work()


def test_absorption_is_found_for_a_reverberation_time():
    room = shoebox().add_box([2, 1, 0], [3, 2, 0.8], 0.1)
    wanted = np.linspace(0.5, 0.4, 8)
    changed = room.with_materials({"walls": {"absorption": room.absorption_for(wanted)}})
    eyring = [band["eyring_s"] for band in changed.room["bands"]]
    np.testing.assert_allclose(eyring, wanted, rtol=1e-3)
    assert changed.materials == room.materials
    with pytest.raises(sonel.Error, match=r"t60 of 9 s at 250 Hz .* s are possible"):
        room.absorption_for(9.0)
    with pytest.raises(sonel.Error, match="no material 'roof'"):
        room.absorption_for(0.5, "roof")


def test_random_rooms_depend_on_their_seed_and_number_alone():
    rooms = sonel.random_rooms(3, **ROOMS, receivers=2)
    assert len(rooms) == 3 and rooms[1].toml == sonel.random_rooms(2, **ROOMS, receivers=2)[-1].toml
    assert len({room.toml for room in rooms}) == 3
    for room in rooms:
        assert len(room.receivers) == 2 and 0.19 < room.room["bands"][4]["eyring_s"] < 0.41
        assert len(room.materials) > 3, "there is furniture"
    with pytest.raises(IndexError):
        rooms[3]
    with pytest.raises(sonel.Error, match="room 0: no place"):
        sonel.random_rooms(1, size=[[2, 2, 2], [2, 2, 2]], sources=5)[0]


def test_rooms_for_arrays_keep_surfaces_off_them():
    """A circle of 0.6 m about the receivers of 40 rooms: with the clearance no microphone is refused, without it some are inside furniture."""
    angles = np.arange(8) * np.pi / 4
    circle = 0.6 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)

    def refused(room):
        response = sonel.trace(room, packets=50, duration=0.05).render(order=0, rays=16, effects="-diffraction")
        try:
            return len(response.impulse_responses(array=circle, sample_rate=8000)) == 0
        except sonel.Error as problem:
            assert "nearer" in str(problem)
            return True

    assert not any(map(refused, sonel.random_rooms(40, seed=7, clearance=0.6)))
    assert any(map(refused, sonel.random_rooms(40, seed=7)))
    for wrong in (0.1, 2.0, "wide"):
        with pytest.raises(sonel.Error, match="clearance is"):
            sonel.random_rooms(1, clearance=wrong)


def test_times_of_random_rooms_are_drawn_for_every_band():
    ranges = [[0.5, 0.6]] * 4 + [[0.3, 0.4]] * 4
    for room in sonel.random_rooms(3, seed=2, t60=ranges):
        times = [band["eyring_s"] for band in room.room["bands"]]
        assert all(low - 0.01 < time < high + 0.01 for time, (low, high) in zip(times, ranges))
        assert len({round(time, 4) for time in times}) > 2
    for wrong in ((0.5, 0.2), (0, 1), [[0.2, 0.3, 0.4]]):
        with pytest.raises(sonel.Error, match="t60 is"):
            sonel.random_rooms(1, t60=wrong)


def test_walls_of_the_library_have_times_within_the_range_of_each_band():
    ranges = [[0.3, 1.5]] * 4 + [[0.2, 0.9]] * 4
    for room in sonel.random_rooms(3, seed=4, t60=ranges, from_library=True):
        times = [band["eyring_s"] for band in room.room["bands"]]
        assert all(low <= time <= high for time, (low, high) in zip(times, ranges))
        assert "library" in room.toml.partition("[materials.walls]")[2].partition("[")[0]
    with pytest.raises(sonel.Error, match="or other times"):
        sonel.random_rooms(1, t60=(8, 9), from_library=True)[0]
    assert "from_library" not in repr(sonel.random_rooms(1)), "folders of data sets stay theirs"


def test_people_and_openings_are_in_the_room_and_absorb_as_tables_say():
    """A person has the absorption of 1 m² with one person per m²; walls with openings are closed, and as large as those without."""
    of_one = sonel.library()["audience-1"]["absorption"][3]
    kinds = set()
    for room in sonel.random_rooms(12, seed=5, size=[[4, 4, 2.4], [6, 5, 3]], people=(1, 4), openings=(0, 4)):
        materials, (x, y, z) = {one["name"]: one for one in room.room["materials"]}, room._parts()[1] and sonel._rooms.space(room)[1]
        people = [one for name, one in materials.items() if name.startswith("person")]
        assert 1 <= len(people) <= 4 and all(one["absorption"][3] * one["area_m2"] == pytest.approx(of_one, rel=1e-6) for one in people)
        on_walls = [name for name in ("walls", "door", "window") if name in materials]
        upright, furniture = sum(materials[name]["area_m2"] for name in on_walls), len(materials) - len(people) - len(on_walls) - 2
        assert upright <= 2 * z * (x + y) + 1e-6 and (furniture > 0 or upright == pytest.approx(2 * z * (x + y)))
        boxes = x * y * z - room.room["volume_m3"]
        assert boxes > sum(0.15 * height for height in [1.25] * len(people)) - 1e-6
        kinds.update(on_walls)
    assert kinds == {"walls", "door", "window"}
    assert "people" not in repr(sonel.random_rooms(1)), "folders of data sets stay theirs"
    for wrong, message in ({"people": 3}, "people is 3: give the fewest and the most"), ({"openings": (0, 5)}, "openings is 5"):
        with pytest.raises(sonel.Error, match=message):
            sonel.random_rooms(1, **wrong)


def test_targets_and_labels_of_the_response_stand_beside_those_of_energies(tmp_path):
    rooms = sonel.random_rooms(2, **ROOMS)
    [path] = sonel.dataset(rooms, tmp_path / "npz", within=(0, 0.05), **QUICK)
    rows = np.load(path)
    assert rows["ir"].shape == rows["ir_within_0"].shape == rows["ir_within_50"].shape
    sums = [np.sum(rows[name].astype(float) ** 2, axis=(1, 2)) for name in ("ir_within_0", "ir_within_50", "ir")]
    assert np.all(sums[0] < sums[1]) and np.all(sums[1] < 1.05 * sums[2])
    for row in range(2):
        read = sonel.Response.of_impulse_response(rows["ir"][row, 0, : rows["samples"][row]], 16_000).parameters()[0, 0]
        np.testing.assert_array_equal(rows["t30_ir_s"][row, :7], read["t30_s"])
        assert np.isnan(rows["t30_ir_s"][row, 7]), "16 kHz hold no octave of 8 kHz"
        assert np.isfinite(rows["t30_ir_s"][row]).any()
    [path] = sonel.dataset(rooms, tmp_path / "tar", format="tar", within=[0.05], **QUICK)
    with tarfile.open(path) as archive:
        assert archive.getnames()[:3] == ["000000-0-0.ir.npy", "000000-0-0.ir_within_50.npy", "000000-0-0.json"]
    with pytest.raises(sonel.Error, match="exclude each other"):
        sonel.dataset(rooms, tmp_path / "both", microphones=ARRAY, ambix=1, **QUICK)
    (tmp_path / "file").write_text("")
    with pytest.raises(sonel.Error, match="cannot be made one"):
        sonel.dataset(rooms, tmp_path / "file" / "set", **QUICK)


def test_readings_scatter_about_the_energies_as_the_standard_says():
    """ISO 3382-2, 7.2: T30 of an integrated impulse response has σ = 0.55 T √(1.152/(B T)), B = 0.71 f. The standard deviation of 12 values
    is within a factor of 2 of σ in 99.9 of 100 cases; the mean of three octaves has a third of the variance."""
    room = shoebox()
    response = sonel.trace(room, packets=2000, duration=1.2).render(order=1, rays=64, effects="-diffraction")
    read = [sonel.Response.of_impulse_response(response.impulse_responses(sample_rate=8000, seed=seed)[0, 0, 0], 8000) for seed in range(12)]
    rows = np.array([one.parameters()[0, 0] for one in read])[:, 3:6]
    assert rows["center_frequency_hz"][0].tolist() == [500, 1000, 2000]
    expected = 0.55 * rows["t30_s"].mean(axis=0) * np.sqrt(1.152 / (0.71 * rows["center_frequency_hz"][0] * rows["t30_s"].mean(axis=0)))
    assert 0.5 < np.mean(rows["t30_s"].std(axis=0, ddof=1) / expected) < 2


def test_readings_have_intervals_from_other_realisations(tmp_path):
    """Between the limits is the mean over realisations, here of eight others, as 95 % intervals say: of 12 values 3 are outside once in 50 runs."""
    assert _dataset._half_width(np.arange(5.0)) == pytest.approx(2.7764 * np.sqrt(2.5 * 1.2), rel=0.003)
    rooms = sonel.random_rooms(2, **ROOMS)
    [path] = sonel.dataset(rooms, tmp_path / "a", realisations=4, **QUICK)
    rows, plain = np.load(path), np.load(sonel.dataset(rooms, tmp_path / "b", **QUICK)[0])
    np.testing.assert_array_equal(rows["ir"], plain["ir"])
    assert set(rows.files) - set(plain.files) == {f"{name}_{end}" for name in _dataset.READ for end in ("low", "high")}
    outside = 0
    for index, room in enumerate(rooms):
        duration = 1.2 * max(band["sabine_s"] for band in room.room["bands"])
        response = sonel.trace(room, duration=duration, **QUICK["trace"]).render(**QUICK["render"])
        others = [response.impulse_responses(sample_rate=16_000, seed=seed) for seed in range(8)]
        read = _dataset._read(np.array(others)[:, 0, :, 0], 16_000, response.center_frequencies)["t30_ir_s"]
        mean = np.nanmean(read[:, 0, 1:7], axis=0)
        outside += np.sum((mean < rows["t30_ir_s_low"][index, 1:7]) | (mean > rows["t30_ir_s_high"][index, 1:7]))
    assert outside <= 2 and np.nanmedian((rows["t30_ir_s_high"] - rows["t30_ir_s_low"]) / rows["t30_ir_s"]) < 0.6
    with pytest.raises(sonel.Error, match="realisations is 2: give a whole number of at least 4"):
        sonel.dataset(rooms, tmp_path / "c", realisations=2, **QUICK)


@pytest.mark.skipif("SONEL_LONG" not in os.environ, reason="long: cargo xtask accept python")
def test_intervals_of_readings_hold_the_values_of_energies(tmp_path):
    """The numbers of docs/python.md: 94, 96 and 94 of 100 in 24 rooms, whose bands and parameters are no independent cases."""
    shards = sonel.dataset(sonel.random_rooms(24, seed=11, t60=(0.2, 1.2)), tmp_path, realisations=8, progress=False)
    rows = [np.load(path) for path in shards]
    for reading, energies in _dataset.READ.items():
        value, low, high = (np.concatenate([row[name] for row in rows]) for name in (energies, f"{reading}_low", f"{reading}_high"))
        known = np.isfinite(value + low)
        assert known.sum() > 100 and 0.88 < np.mean(((low < value) & (value < high))[known]) < 0.99


def test_a_pickled_map_renders_and_its_impulse_responses_may_be_written_to():
    copy = pickle.loads(pickle.dumps(pickle.loads(pickle.dumps(sonel.trace(shoebox(), packets=100)))))
    samples = copy.render(rays=16).impulse_responses(sample_rate=8000)
    samples *= 0.5
    assert samples.flags.owndata and samples.flags.writeable


def read(paths):
    return [path.read_bytes() for path in paths]


def test_a_data_set_has_the_same_bytes_for_any_number_of_workers_and_goes_on(tmp_path):
    rooms = sonel.random_rooms(4, **ROOMS)
    shares = []
    options = {"microphones": ARRAY, "shard_size": 2, **QUICK}
    paths = sonel.dataset(rooms, tmp_path / "a", workers=1, **{**options, "progress": lambda _, share: shares.append(share)})
    assert [path.name for path in paths] == ["shard-00000.npz", "shard-00001.npz"] and shares == [0.25, 0.5, 0.75, 1.0]

    def killed(_, share):
        if share > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sonel.dataset(rooms, tmp_path / "b", workers=1, **{**options, "progress": killed})
    assert [path.name for path in sorted((tmp_path / "b").iterdir())] == ["README.md", "dataset.json", "shard-00000.npz"]
    assert read(sonel.dataset(rooms, tmp_path / "b", workers=3, **options)) == read(paths)
    assert read(sonel.dataset(rooms, tmp_path / "c", shards=[1], **options)) == read(paths[1:])
    with pytest.raises(sonel.Error, match="no shard 2: 4 rooms make 2"):
        sonel.dataset(rooms, tmp_path / "c", shards=[2], **options)
    with pytest.raises(sonel.Error, match="of other rooms, options"):
        sonel.dataset(rooms, tmp_path / "b", **{**options, "microphones": None})


def opened(path):
    """Arrays of a shard of HDF5 or zarr."""
    if path.suffix == ".h5":
        with pytest.importorskip("h5py").File(path) as file:
            return {name: values[...] for name, values in file.items()}
    zarr = pytest.importorskip("zarr")
    return {name: values[...] for name, values in zarr.open_group(zarr.storage.ZipStore(path, mode="r"), mode="r").arrays()}


@pytest.mark.parametrize(("form", "package"), [("h5", "h5py"), ("zarr", "zarr")])
def test_hdf5_and_zarr_have_the_arrays_of_npz_and_the_same_bytes_later(tmp_path, monkeypatch, form, package):
    pytest.importorskip(package)
    rooms = sonel.random_rooms(2, **ROOMS)
    options = {"microphones": ARRAY, "early": 0, "within": [0], **QUICK}
    rows = np.load(sonel.dataset(rooms, tmp_path / "npz", **options)[0])
    [path] = sonel.dataset(rooms, tmp_path / form, format=form, **options)
    found = opened(path)
    assert found.keys() == set(rows.files)
    for name in rows.files:
        np.testing.assert_array_equal(found[name], rows[name])
    # Times in files have seconds, those of ZIP two.
    time.sleep(2.0)
    assert read(sonel.dataset(rooms, tmp_path / "later", format=form, workers=1, **options)) == [path.read_bytes()]
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(sonel.Error, match=f"needs the package {package}"):
        sonel.dataset(rooms, tmp_path / "without", format=form, **options)
    with pytest.raises(sonel.Error, match="format is 'flac': give one of npz, tar, h5, zarr"):
        sonel.dataset(rooms, tmp_path / "without", format="flac", **options)


def test_a_data_set_has_a_card(tmp_path):
    pytest.importorskip("h5py")
    head = Path(__file__).parents[2] / "crates" / "sonel-sound" / "tests" / "cardioid-head.sofa"
    sonel.dataset(sonel.random_rooms(1, **ROOMS), tmp_path, hrtf=head, **QUICK)
    card = (tmp_path / "README.md").read_text()
    for stated in ("licence: No license provided, ask", f"sonel {sonel.__version__}", "sonel.random_rooms(1, seed=3", "16000 Hz", "dataset.json", "not valid below"):
        assert stated in card


def test_microphones_beyond_the_far_field_are_receivers(tmp_path):
    """Two pairs, the second 1.2 m from its receiver: responses are those of receivers there, and coherent where they are near."""
    places = [[0.0, 0.02, 0.0], [0.0, -0.02, 0.0], [1.2, 0.0, 0.0], [1.2, 0.02, 0.0]]
    room = sonel.Scene.shoebox([8, 6, 3], 0.2, sources=[1, 1, 1.5], receivers=[[4, 3, 1.2], [5, 3, 1.2]])
    [path] = sonel.dataset([room], tmp_path / "a", microphones=places, **QUICK)
    rows = np.load(path)
    assert rows["ir"].shape[:2] == (2, 4)
    map = sonel.trace(room, duration=1.2 * max(b["sabine_s"] for b in room.room["bands"]), **QUICK["trace"])
    seed = int(np.random.SeedSequence([map.seed, 0]).generate_state(1, np.uint64)[0] >> 1)
    heard = map.render(rows["microphone_position_m"].reshape(-1, 3), **QUICK["render"]).impulse_responses(sample_rate=16_000, seed=seed)
    np.testing.assert_array_equal(rows["ir"].reshape(8, -1), heard[0, :, 0])
    with pytest.raises(sonel.Error, match=r'rooms\[0\]: receiver "receiver 1, microphone 1" .* outside the room'):
        sonel.dataset([room], tmp_path / "b", microphones=[[5.0, 0.0, 0.0]], **QUICK)


# Writes the data set of two rooms in the folder of the first argument.
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="a system with pipes")
def test_a_pipe_in_the_place_of_a_file_of_a_data_set_stops_no_run(tmp_path):
    os.mkfifo(tmp_path / "dataset.json")
    assert len(sonel.dataset([shoebox()], tmp_path, **QUICK)) == 1
    (tmp_path / "dataset.json").unlink()
    os.mkfifo(tmp_path / "dataset.json")
    with pytest.raises(sonel.Error, match="of other rooms, options"):
        sonel.dataset([shoebox()], tmp_path, **QUICK)


def test_rooms_are_checked_before_the_work(tmp_path):
    silent = sonel.Scene.shoebox([5, 4, 3], 0.2, sources=[1, 1, 1.5])
    octave = shoebox(bands={"center_frequencies_hz": [500, 1000]})
    for strange, message in ((silent, r"rooms\[1\] has no receivers"), (octave, r"rooms\[1\] has the bands \[500.0, 1000.0\] Hz")):
        with pytest.raises(sonel.Error, match=message):
            sonel.dataset([shoebox(), strange], tmp_path / "a", **QUICK)
        assert not (tmp_path / "a").exists()
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / "dataset.json").write_text("of a run that has written no shard")
    assert len(sonel.dataset([shoebox()], tmp_path / "a", **QUICK)) == 1


def test_a_data_set_that_is_stopped_ends_at_the_next_room(tmp_path):
    steps = []

    def stopped(*_):
        steps.append(1)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sonel.dataset(sonel.random_rooms(12, **ROOMS), tmp_path, workers=2, shard_size=6, **{**QUICK, "progress": stopped})
    assert len(steps) <= 2, "the other worker ends at its next room"


def test_labels_are_those_of_the_response(tmp_path):
    rooms = [room for room in sonel.random_rooms(2, **ROOMS)]
    [path] = sonel.dataset(rooms, tmp_path / "npz", microphones=ARRAY, **QUICK)
    rows = np.load(path)
    map = sonel.trace(rooms[1], duration=1.2 * max(b["sabine_s"] for b in rooms[1].room["bands"]), **QUICK["trace"])
    response = map.render(**QUICK["render"])
    assert rows["ir"].shape[:2] == (2, 2) and rows["ir"].dtype == np.float32
    seed = int(np.random.SeedSequence([map.seed, 1]).generate_state(1, np.uint64)[0] >> 1)
    samples = response.impulse_responses(array=ARRAY, sample_rate=16_000, seed=seed)[0, 0]
    np.testing.assert_array_equal(rows["ir"][1, :, : rows["samples"][1]], samples)
    np.testing.assert_array_equal(rows["t30_s_low"][1], response.parameters()["t30_s_low"][0, 0])
    np.testing.assert_array_equal(rows["speech_transmission_index"][1], response.speech_transmission_index()[0, 0])
    np.testing.assert_array_equal(rows["microphone_position_m"][1], response.receiver_positions[0] + ARRAY)
    towards = response.source_positions[0] - response.receiver_positions[0]
    distance = np.linalg.norm(towards)
    if rows["early_order"][1, 0] == 0:
        np.testing.assert_allclose(rows["early_direction"][1, 0], towards / distance, atol=1e-6)
        expected = 10 * np.log10(response["arrival_energy"][0] / (response.energy[0, 0].sum(-1) - response["arrival_energy"][0]))
        np.testing.assert_allclose(rows["direct_to_reverberant_db"][1], expected)
    assert np.all(np.diff(rows["early_time_s"][1][rows["early_order"][1] >= 0]) >= 0)
    [path] = sonel.dataset(rooms, tmp_path / "tar", format="tar", microphones=ARRAY, **QUICK)
    with tarfile.open(path) as archive:
        assert archive.getnames() == [f"00000{i}-0-0.{end}" for i in (0, 1) for end in ("ir.npy", "json")]
        np.testing.assert_array_equal(np.load(io.BytesIO(archive.extractfile("000001-0-0.ir.npy").read())), samples)
        assert json.load(archive.extractfile("000001-0-0.json"))["samples"] == samples.shape[-1]


def load_in_torch(tmp_path, dataset, made):
    """Runs LOADER in the interpreter that has torch, with this package and the packages of that interpreter."""
    interpreter = os.environ.get("SONEL_TORCH_PYTHON", sys.executable)
    if not hasattr(os, "fork") or subprocess.run([interpreter, "-c", "import torch"], capture_output=True).returncode:
        pytest.skip(f"{interpreter} has no torch, or processes are not forked here")
    package = tmp_path / "package"
    package.mkdir()
    (package / "sonel").symlink_to(Path(sonel.__file__).parent)
    command = [interpreter, "-c", LOADER.format(dataset=dataset, made=made)]
    subprocess.run(command, env={**os.environ, "PYTHONPATH": str(package)}, timeout=120, check=True)


def test_the_documented_data_set_of_torch_has_the_same_rows_in_forked_workers(tmp_path):
    text = (Path(__file__).parents[2] / "docs" / "python.md").read_text(encoding="utf-8")
    [documented] = re.findall(r"```python\n(class Responses.*?)```", text, re.DOTALL)
    paths = sonel.dataset(sonel.random_rooms(6, **ROOMS), tmp_path / "rooms", microphones=ARRAY, shard_size=2, **QUICK)
    assert len({np.load(path)["ir"].shape for path in paths}) == 3, "lengths differ between shards"
    load_in_torch(tmp_path, documented, f"Responses({str(tmp_path / 'rooms')!r})")


def test_sonel_works_in_forked_workers_of_torch_after_it_has_worked_before(tmp_path):
    load_in_torch(tmp_path, SIMULATED, "Simulated()")
