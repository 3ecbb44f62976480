"""The package under attack: hostile arguments, pipes, a full disk, runs that are killed. Whatever is asked ends by itself with a result or an
exception that says what is wrong; under the name of an output there is the old file or the new one, complete.

`cargo xtask python-package` runs this.
"""

import itertools
import os
import random
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import sonel

ROOMS = {"seed": 3, "size": [[3, 3, 2.4], [4, 4, 2.6]], "t60": (0.2, 0.4)}
QUICK = {"trace": {"packets": 300}, "render": {"order": 1, "rays": 64, "effects": "-diffraction"}, "progress": False}
# What is no argument at all, or is far out of any range.
HOSTILE = [
    float("nan"), float("inf"), -float("inf"), -1, 0, 1e-320, 1e308, 2**63, 2**64, 10**40, True, "", "nan", "\0", "a\x9b\u202e\ufeff" * 50, b"\xff",
    [], [[]], {}, {"": None}, [float("nan")] * 3, [1e308] * 3, [[1, 2], [3]], ["a", 1], object(), np.zeros((0, 3)), np.full((4, 4), np.nan), range(3), "/dev/zero",
    "x" * 1_000_000,
]  # fmt: skip
# The package says so; a wrong type may also be told as Python does.
REFUSALS = (sonel.Error, TypeError, OSError, KeyError, OverflowError)
LONGEST_MESSAGE = 20_000


@pytest.fixture(scope="module")
def scene():
    return sonel.Scene.shoebox([5, 4, 3], 0.3, sources=[1, 1, 1.5], receivers=[3, 2, 1.2], duration_s=0.05, bands={"center_frequencies_hz": [1000]})


@pytest.fixture(scope="module")
def room(scene):
    return sonel.trace(scene, packets=64, progress=False)


@pytest.fixture(scope="module")
def response(room):
    return room.render(directions=True, progress=False)


def keywords(function):
    import inspect

    found = inspect.signature(function).parameters.values()
    return [one.name for one in found if one.default is not one.empty and one.name not in ("threads", "progress", "workers", "extend", "map")]


def calls(scene, room, response):
    """A call for every keyword of every function, with a value for it."""
    few = {"packets": 64, "duration": 0.05}
    functions = {
        "trace": (sonel.trace, lambda **k: sonel.trace(scene, progress=False, **{**few, **k})),
        "render": (sonel.Map.render, lambda **k: room.render(progress=False, **{"bin": 0.05, "rays": 16, **k})),
        "impulse_responses": (sonel.Response.impulse_responses, lambda **k: response.impulse_responses(**k)),
        "parameters": (sonel.Response.parameters, lambda **k: response.parameters(**k)),
        "shoebox": (sonel.Scene.shoebox, lambda **k: sonel.Scene.shoebox([5, 4, 3], **{"materials": 0.3, "sources": [1, 1, 1], **k})),
        "random_rooms": (sonel.random_rooms, lambda **k: sonel.random_rooms(2, **k)[1]),
    }
    for name, (function, call) in functions.items():
        for key in keywords(function):
            yield f"{name}({key}=…)", key, call


def is_told(work):
    """Whether `work` ends with a result, or with a refusal that can be read."""
    try:
        work()
    except REFUSALS as error:
        return len(str(error)) < LONGEST_MESSAGE
    return True


def test_hostile_arguments_are_refused_or_used(scene, room, response):
    found, begun = [], time.process_time()
    for place, key, call in calls(scene, room, response):
        for value in HOSTILE:
            before = time.process_time()
            try:
                if not is_told(lambda: call(**{key: value})):
                    found.append((place, repr(value)[:60], "the message is long"))
            except BaseException as error:  # noqa: BLE001 - a panic is no Exception
                found.append((place, repr(value)[:60], f"{type(error).__name__}: {str(error)[:200]}"))
            if time.process_time() - before > 5:
                found.append((place, repr(value)[:60], f"{time.process_time() - before:.1f} CPU seconds"))
    assert not found, "\n".join(map(str, found))
    assert time.process_time() - begun < 300


def test_positions_and_arrays_of_any_kind_are_refused_or_used(room, response):
    found = []
    for value in HOSTILE:
        for name, work in {
            "receivers": lambda: room.render(value, bin=0.05, rays=16, progress=False),
            "walk": lambda: room.walk(value, np.zeros(100), sample_rate=8000),
            "signal": lambda: room.walk([[0, 2, 3, 1.5], [0.01, 2.1, 3, 1.5]], value, sample_rate=8000),
            "mesh": lambda: sonel.Scene.from_mesh(value, [[0, 1, 2]], 0.1, sources=[1, 1, 1]),
            "load": lambda: sonel.Scene.load(value),
            "map": lambda: sonel.Map.load(value),
            "response": lambda: sonel.Response.load(value),
            "dataset": lambda: sonel.dataset(value, "never-made"),
        }.items():
            try:
                if not is_told(work):
                    found.append((name, repr(value)[:60], "the message is long"))
            except BaseException as error:  # noqa: BLE001 - a panic is no Exception
                found.append((name, repr(value)[:60], f"{type(error).__name__}: {str(error)[:200]}"))
    assert not found, "\n".join(map(str, found))


def test_pipes_and_devices_are_refused_at_once(tmp_path, room, response):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (pipe, "/dev/zero", tmp_path):
        for work in (
            lambda: sonel.Scene.load(path),
            lambda: sonel.Map.load(path),
            lambda: sonel.Response.load(path),
            lambda: sonel.check(path),
            lambda: room.render(materials=path, progress=False),
            lambda: response.impulse_responses(hrtf=path),
            lambda: room.save(path),
            lambda: response.save(path),
        ):
            with pytest.raises((sonel.Error, OSError)):
                work()


def run(text, folder, before=""):
    """Starts `text` with the package in `folder`, after `before` in a shell."""
    return subprocess.Popen(["sh", "-c", f'{before} exec "$0" -c "$1"', sys.executable, text], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def work(form):
    """A data set of four shards."""
    return f"""
import sonel
rooms = sonel.random_rooms(4, **{ROOMS})
sonel.dataset(rooms, "data", shard_size=1, workers=2, format={form!r}, **{QUICK})
"""


def shards(folder):
    return {path.name: path.read_bytes() for path in folder.glob("shard-*") if not path.name.endswith(".part")}


@pytest.mark.parametrize("form", ["npz", "tar"])
def test_a_data_set_that_is_killed_is_whole_in_the_end(tmp_path, form):
    begun = time.monotonic()
    assert run(work(form), tmp_path).wait() == 0
    took, right = time.monotonic() - begun, shards(tmp_path / "data")
    assert len(right) == 4
    draw = random.Random(1)
    for number in range(24 if "SONEL_LONG" in os.environ else 3):
        folder = tmp_path / str(number)
        folder.mkdir()
        child = run(work(form), folder)
        time.sleep(took * draw.random())
        child.send_signal([signal.SIGKILL, signal.SIGINT, signal.SIGTERM][number % 3])
        child.communicate()
        partly = shards(folder / "data")
        assert all(right[name] == content for name, content in partly.items()), partly.keys()
        assert run(work(form), folder).wait() == 0
        assert shards(folder / "data") == right


def test_a_full_disk_leaves_the_old_file_or_the_new_one(tmp_path):
    text = f"""
import sonel
scene = sonel.Scene.shoebox([5, 4, 3], 0.3, sources=[1, 1, 1.5], receivers=[3, 2, 1.2], duration_s=0.2)
room = sonel.trace(scene, packets=400, progress=False)
room.save("a.sonelmap")
room.render(progress=False).save("a.npz")
sonel.dataset(sonel.random_rooms(1, **{ROOMS}), "data", **{QUICK})
"""
    assert run(text, tmp_path).wait() == 0
    names = ["a.sonelmap", "a.npz", "data/shard-00000.npz"]
    right = {name: (tmp_path / name).read_bytes() for name in names}
    largest = max(map(len, right.values()))
    for number, share in enumerate(itertools.islice(itertools.cycle([0, 0.001, 0.01, 0.1, 0.3, 0.9]), 6)):
        folder = tmp_path / f"full-{number}"
        folder.mkdir()
        child = run(text, folder, f"trap '' XFSZ; ulimit -f {int(share * largest / 512)};")
        _, told = child.communicate()
        assert child.returncode == 1 and b"panic" not in told and (b"OSError" in told or b"Error" in told), told.decode()
        for path in folder.rglob("*"):
            name = str(path.relative_to(folder))
            assert path.is_dir() or name == "data/dataset.json" or path.read_bytes() == right.get(name), name


def test_what_stands_in_the_place_of_a_shard_is_told(tmp_path):
    rooms = sonel.random_rooms(1, **ROOMS)
    (tmp_path / "file").write_text("text")
    with pytest.raises(sonel.Error, match="not a folder"):
        sonel.dataset(rooms, tmp_path / "file", **QUICK)
    (tmp_path / "data").mkdir()
    os.mkfifo(tmp_path / "data" / "shard-00000.npz")
    with pytest.raises(sonel.Error, match="not a regular file"):
        sonel.dataset(rooms, tmp_path / "data", **QUICK)
    os.unlink(tmp_path / "data" / "shard-00000.npz")
    (tmp_path / "data" / "shard-00000.npz").touch()
    (path,) = sonel.dataset(rooms, tmp_path / "data", **QUICK)
    assert path.stat().st_size > 0
