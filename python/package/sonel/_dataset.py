"""Impulse responses by the thousand: rooms in, shards of arrays with labels out.

A shard is a file that depends on its rooms and the options alone, so that any number of workers writes the same bytes. It appears when it is
complete; a run that was killed goes on with the shards that are missing.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import secrets
import sys
import tarfile
import threading
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _input
from ._sonel import Error

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from . import Map, Response, Scene

PARAMETERS = ["t30_s", "early_decay_time_s", "clarity_c50_db", "strength_g_db"]
# What a measurement would read from the first channel.
READ = {"t30_ir_s": "t30_s", "early_decay_time_ir_s": "early_decay_time_s", "clarity_c50_ir_db": "clarity_c50_db"}
# Formats and the endings of their files.
ENDINGS = {"npz": "npz", "tar": "tar", "h5": "h5", "zarr": "zarr.zip"}
# Farther away a microphone is a receiver of its own [m] (docs/formats/sound.md).
FAR_FIELD_M = 1.0


def write(
    rooms: Sequence[Scene],
    out: Path,
    *,
    workers: int | None,
    shard_size: int,
    shards: Iterable[Any] | None,
    form: str,
    options: dict[str, Any],
    progress: Any,
) -> list[Path]:
    """Writes the shards that are missing; returns the paths of all that are wanted."""
    from . import Map, trace

    for name, function in (("trace", trace), ("render", Map.render)):
        _input.check_keywords(options[name], function, name, {"threads", "progress"})
    if form not in ENDINGS:
        raise Error(f"format is {_input.shown(form)}: give one of {', '.join(ENDINGS)}")
    content = {"npz": lambda: _npz, "tar": lambda: _tar, "h5": _hdf5, "zarr": _zarr}[form]()
    if not (hasattr(rooms, "__len__") and hasattr(rooms, "__getitem__") and len(rooms)):
        raise Error(f"rooms is {_input.shown(rooms)}: give a sequence of scenes, at least one")
    ranges = [range(begin, min(begin + shard_size, len(rooms))) for begin in range(0, len(rooms), shard_size)]
    wanted = range(len(ranges)) if shards is None else _wanted(shards, len(ranges), len(rooms))
    named = _checked(rooms, options["render"])
    if "array" in options["channels"]:
        _positions(options["channels"]["array"])
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise Error(f"{out} is not a folder and cannot be made one: {problem.strerror or problem}; choose another one") from None
    _manifest(out, named, {**options, "shard_size": shard_size, "format": form})
    ranges = [ranges[number] for number in wanted]
    paths = [out / f"shard-{number:05d}.{ENDINGS[form]}" for number in wanted]
    for path in paths:
        if os.path.lexists(path) and not path.is_file():
            raise Error(f"{path} is not a regular file: remove it")
    missing = [(path, indices) for path, indices in zip(paths, ranges) if not (path.exists() and path.stat().st_size)]
    total = sum(map(len, ranges))
    stopped = threading.Event()

    def going_on(*_: object) -> None:
        if stopped.is_set():
            raise CancelledError

    with _Progress(progress, total - sum(len(indices) for _, indices in missing), total) as step:

        def shard(job: tuple[Path, range]) -> None:
            path, indices = job
            rows = []
            for index in indices:
                going_on()
                rows += list(_rows(index, rooms[index], options, going_on))
                step(1)
            _publish(path, content(rows))

        with ThreadPoolExecutor(workers or os.cpu_count()) as pool:
            jobs = [pool.submit(shard, job) for job in missing]
            try:
                for job in as_completed(jobs):
                    job.result()
            except BaseException:
                stopped.set()
                for job in jobs:
                    job.cancel()
                raise
    return paths


def _wanted(shards: Iterable[Any], count: int, rooms: int) -> list[int]:
    """Numbers of the shards to write."""
    if not isinstance(shards, Iterable):
        raise Error(f"shards is {_input.shown(shards)}: give a list of numbers")
    numbers = sorted({_input.whole(number, "a number in shards") for number in shards})
    if numbers and numbers[-1] >= count:
        raise Error(f"there is no shard {numbers[-1]}: {rooms} rooms make {count}, counted from 0")
    return numbers


def _checked(rooms: Sequence[Scene], render: Mapping[str, Any]) -> str:
    """Identity of the rooms, each of which gives rows of the same form."""
    from . import RandomRooms, Scene

    if isinstance(rooms, RandomRooms):
        return repr(rooms)
    texts = hashlib.sha256()
    needs_receivers = not {"receivers", "grid", "audience"}.intersection(render)
    first = None
    for number in range(len(rooms)):
        room = rooms[number]
        bands = _input.of_kind(room, Scene, f"rooms[{number}]", "a sonel.Scene").center_frequencies.tolist()
        first = bands if first is None else first
        if needs_receivers and not room.receivers:
            raise Error(f"rooms[{number}] has no receivers: give them to the scene, or to all rooms as render={{'receivers': …}}")
        if bands != first:
            raise Error(f"rooms[{number}] has the bands {bands} Hz, rooms[0] {first} Hz: give all rooms the same")
        texts.update(repr(room._origin[1:]).encode() + room.toml.encode())
    return f"{len(rooms)} scenes, sha256 {texts.hexdigest()}"


def _manifest(out: Path, named: str, options: dict[str, Any]) -> None:
    """States what the folder holds; refuses to go on where it holds shards of other rooms or options."""
    from . import __version__

    # As text: what is read again is compared.
    state = json.dumps({"sonel": __version__, "rooms": named, "options": options}, indent=1, default=_plain, sort_keys=True)
    path = out / "dataset.json"
    if not path.exists() or not any(path for end in ENDINGS.values() for path in out.glob(f"shard-*.{end}")):
        _publish(out / "README.md", _card(named, options).encode())
        _publish(path, state.encode())
    elif not path.is_file() or path.read_text() != state:
        raise Error(f"{path} is of other rooms, options or another version: choose another folder, or delete this one to begin anew")


def _card(named: str, options: Mapping[str, Any]) -> str:
    """What whoever finds the folder has to know."""
    from . import __version__

    channels = options["channels"]
    lines = [
        f"made by: sonel {__version__}; the same call of `sonel.dataset` gives the same energies, impulse responses up to the last bits of the processor",
        f"rooms: {named}",
        f"seed of late sound: {'that of each trace' if options['seed'] is None else options['seed']}, mixed with the number of the room",
        f"impulse responses: {options['sample_rate']} Hz, channels: {', '.join(channels) or 'one omnidirectional microphone'}",
        f"files: {options['format']}, {options['shard_size']} rooms each; `dataset.json` has all options",
        "labels: page \"Python\" of the documentation of sonel, *Rooms by the thousand*",
        "limits: energies are simulated, neither modes nor phases of reflections; not valid below the Schroeder frequency of a room",
    ]
    if "hrtf" in channels:
        lines.append(f"HRTF: {os.path.basename(os.fspath(channels['hrtf']))}, sha256 {options['head']}, licence: {_licence(channels['hrtf'])}")
    return "# Simulated room impulse responses\n\n" + "".join(f"- {line}\n" for line in lines)


def _licence(sofa: Any) -> str:
    """What a SOFA file says of its licence."""
    try:
        import h5py  # type: ignore[import-untyped]

        with h5py.File(sofa) as file:
            stated = file.attrs.get("License", b"")
    except (ImportError, OSError):
        stated = b""
    text = stated.decode(errors="replace") if isinstance(stated, bytes) else str(stated)
    return " ".join(text.split()) or "not known, see the file"


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else str(value)


def _publish(path: Path, content: bytes) -> None:
    # Other processes, also of other machines, may write the same file with the same bytes.
    unfinished = path.with_name(f"{path.name}.{secrets.token_hex(8)}.part")
    try:
        with open(unfinished, "xb") as file:
            file.write(content)
        os.replace(unfinished, path)
    except BaseException:
        unfinished.unlink(missing_ok=True)
        raise


def _rows(
    index: int, scene: Scene, options: dict[str, Any], going_on: Callable[[str, float], object]
) -> Iterator[dict[str, Any]]:
    """Impulse responses and labels of every source and receiver of a room; an exception of `going_on` ends the work."""
    from . import trace

    tracing, rendering = options["trace"], options["render"]
    if "duration" not in tracing and "until" not in tracing:
        bands = scene.room["bands"]
        statistical = 1.2 * max(band["sabine_s"] for band in bands)
        tracing = {**tracing, "duration": options["duration"] or statistical}
    room = trace(scene, threads=1, progress=going_on, **tracing)
    response = room.render(threads=1, progress=going_on, **rendering)
    # Copies of a room in other materials would otherwise share the pulses of their late sound.
    seed = room.seed if options["seed"] is None else options["seed"]
    mixed, *others = (int(state >> 1) for state in np.random.SeedSequence([seed, index]).generate_state(1 + options["realisations"], np.uint64))
    array = options["channels"].get("array")
    places = np.zeros((1, 3)) if array is None else _positions(array)
    try:
        heard = _hearing(room, response, options, places, going_on)
        responses = heard(seed=mixed)
        targets = {f"ir_within_{1000 * time:g}": heard(seed=mixed, within=time) for time in options["within"]}
    except Error as problem:
        raise Error(f"rooms[{index}]: {problem}") from None
    labels = _labels(response, options["early"])

    def read(samples: NDArray[np.float32]) -> dict[str, NDArray[Any]]:
        return _read(samples[:, :, 0], options["sample_rate"], response.center_frequencies)

    readings = read(responses)
    labels.update(readings)
    if others:
        found = [read(response.impulse_responses(seed=other, sample_rate=options["sample_rate"])) for other in others]
        for name, reading in readings.items():
            half = _half_width(np.array([one[name] for one in found]))
            labels[f"{name}_low"], labels[f"{name}_high"] = reading - half, reading + half
    for s, source in enumerate(response.source_positions):
        for r, receiver in enumerate(response.receiver_positions):
            yield {
                "ir": responses[s, r],
                **{name: samples[s, r] for name, samples in targets.items()},
                "samples": np.int64(responses.shape[-1]),
                "sample_rate_hz": np.int64(options["sample_rate"]),
                "room": np.int64(index),
                "source": np.int64(s),
                "receiver": np.int64(r),
                "source_position_m": source,
                "receiver_position_m": receiver,
                "microphone_position_m": receiver + places,
                "center_frequency_hz": response.center_frequencies,
                "speed_of_sound": np.float64(response.speed_of_sound),
                **{name: values[s, r] for name, values in labels.items()},
            }


def _hearing(
    room: Map, response: Response, options: dict[str, Any], places: NDArray[np.float64], going_on: Callable[[str, float], object]
) -> Callable[..., NDArray[np.float32]]:
    """Makes impulse responses of the channels at every receiver, [S, R, C, N]. Microphones beyond the far field are receivers of one rendering."""
    from . import _points

    channels = {**options["channels"], "sample_rate": options["sample_rate"]}
    if np.linalg.norm(places, axis=1).max() <= FAR_FIELD_M:
        return lambda **keywords: response.impulse_responses(**channels, **keywords)
    microphones = _points(channels.pop("array"), "microphone")
    pairs = [(r, m) for r in range(len(response.receivers)) for m in range(len(places))]
    receivers = {
        name: {**microphones[m], "name": name, "position": response.receiver_positions[r] + places[m]}
        for r, m in pairs
        for name in [f"{response.receivers[r]}, {microphones[m]['name']}"]
    }
    own = {"receivers", "grid", "audience", "spacing", "height", "directions"}
    rendering = {name: value for name, value in options["render"].items() if name not in own}
    apart = room.render(receivers, threads=1, progress=going_on, **rendering)

    def heard(**keywords: Any) -> NDArray[np.float32]:
        samples = apart.impulse_responses(**channels, **keywords)
        return samples.reshape(len(samples), -1, len(places), samples.shape[-1])

    return heard


def _positions(microphones: Any) -> NDArray[np.float64]:
    from . import _points

    return np.array([point["position"] for point in _points(microphones, "microphone")], dtype=float)


def _labels(response: Response, early: int) -> dict[str, NDArray[Any]]:
    """Labels of every source and receiver, [S, R, …]."""
    report = response.parameter_report()
    rows = response._parameters(report)
    labels = {}
    for name in PARAMETERS:
        for end in ("", "_low", "_high"):
            labels[name + end] = np.asarray(rows[name + end])
    labels["speech_transmission_index"] = response._speech(report)
    energy = response.energy.sum(axis=-1)
    s, r, kind = response["arrival_source"], response["arrival_receiver"], response["arrival_kind"]
    energies = response["arrival_energy"]
    direct = np.zeros(energy.shape)
    np.add.at(direct, (s[kind == 0], r[kind == 0]), energies[kind == 0])
    with np.errstate(divide="ignore"):
        labels["direct_to_reverberant_db"] = 10 * np.log10(direct / (energy - direct))
    shape = (*energy.shape[:2], early)
    labels["early_time_s"] = np.full(shape, np.nan)
    labels["early_direction"] = np.full((*shape, 3), np.nan)
    labels["early_energy"] = np.full((*shape, energy.shape[2]), np.nan)
    labels["early_order"] = np.full(shape, -1)
    for pair in np.ndindex(*energy.shape[:2]):
        own = np.flatnonzero((s == pair[0]) & (r == pair[1]))
        strongest = own[np.argsort(-energies[own].sum(axis=1), kind="stable")[:early]]
        strongest = strongest[np.argsort(response["arrival_time_s"][strongest], kind="stable")]
        count = len(strongest)
        labels["early_time_s"][pair][:count] = response["arrival_time_s"][strongest]
        labels["early_direction"][pair][:count] = response["arrival_direction"][strongest]
        labels["early_energy"][pair][:count] = energies[strongest]
        labels["early_order"][pair][:count] = response["arrival_order"][strongest]
    return labels


def _read(responses: NDArray[np.float32], sample_rate: int, center_frequencies: NDArray[np.float64]) -> dict[str, NDArray[Any]]:
    """Parameters read from impulse responses as from measurements, [S, R, band]; NaN where there are none, and in bands that are no octaves."""
    from . import Response

    labels = {name: np.full((*responses.shape[:2], len(center_frequencies)), np.nan) for name in READ}
    for place in np.ndindex(*responses.shape[:2]):
        try:
            found = Response.of_impulse_response(responses[place], sample_rate).parameters()[0, 0]
        except Error:
            # Silence behind furniture, or less than a decay.
            continue
        for row in found:
            for name, parameter in READ.items():
                labels[name][place][center_frequencies == row["center_frequency_hz"]] = row[parameter]
    return labels


def _half_width(readings: NDArray[np.float64]) -> NDArray[np.float64]:
    """Within how much of their mean 95 of 100 readings lie, [N, …]; NaN where fewer than 4 can be read."""
    finite = np.isfinite(readings)
    count = np.where(finite.sum(axis=0) < 4, np.nan, finite.sum(axis=0))
    deviations = np.where(finite, readings - np.nansum(readings, axis=0) / count, 0.0)
    # Quantile of Student's t for ν = N − 1: Abramowitz and Stegun 26.7.5, 0.7 % low at ν = 3.
    z, freedom = 1.959964, count - 1
    quantile = z + (z**3 + z) / (4 * freedom) + (5 * z**5 + 16 * z**3 + 3 * z) / (96 * freedom**2)
    quantile += (3 * z**7 + 19 * z**5 + 17 * z**3 - 15 * z) / (384 * freedom**3)
    half: NDArray[np.float64] = quantile * np.sqrt(np.sum(deviations**2, axis=0) / freedom * (1 + 1 / count))
    return half


def _arrays(rows: list[dict[str, Any]]) -> dict[str, NDArray[Any]]:
    """One array for each label, its rows side by side; impulse responses are as long as the longest, with silence behind."""
    longest = max(row["ir"].shape[-1] for row in rows)

    def values(name: str, row: dict[str, Any]) -> Any:
        return np.pad(row[name], ((0, 0), (0, longest - row[name].shape[-1]))) if _is_sound(name) else row[name]

    return {name: np.stack([values(name, row) for row in rows]) for name in rows[0]}


def _npz(rows: list[dict[str, Any]]) -> bytes:
    file = io.BytesIO()
    arrays: dict[str, Any] = _arrays(rows)
    np.savez(file, **arrays)
    return file.getvalue()


def _chunks(name: str, values: NDArray[Any]) -> tuple[int, ...]:
    """A row of sound is read alone."""
    return (1 if _is_sound(name) else len(values), *(max(1, length) for length in values.shape[1:]))


def _hdf5() -> Callable[[list[dict[str, Any]]], bytes]:
    """Datasets of HDF5, by h5py."""
    try:
        import h5py
    except ImportError:
        raise Error('format h5 needs the package h5py: pip install "sonel[hdf5]"') from None

    def content(rows: list[dict[str, Any]]) -> bytes:
        file = io.BytesIO()
        with h5py.File(file, "w") as store:
            for name, values in _arrays(rows).items():
                store.create_dataset(name, data=values, chunks=_chunks(name, values) if _is_sound(name) else None, track_times=False)
        return file.getvalue()

    return content


def _zarr() -> Callable[[list[dict[str, Any]]], bytes]:
    """A group of zarr in a ZIP file, by zarr."""
    try:
        import zarr
        from zarr.storage import MemoryStore
    except ImportError:
        raise Error('format zarr needs the package zarr, 3 or later: pip install "sonel[zarr]"') from None

    def content(rows: list[dict[str, Any]]) -> bytes:
        entries: dict[str, Any] = {}
        group = zarr.create_group(MemoryStore(entries))
        for name, values in _arrays(rows).items():
            group.create_array(name, data=values, chunks=_chunks(name, values), compressors=None)
        file = io.BytesIO()
        with zipfile.ZipFile(file, "w") as archive:
            # Without the time of day: the same rows are the same bytes.
            for name in sorted(entries):
                archive.writestr(zipfile.ZipInfo(name), entries[name].to_bytes())
        return file.getvalue()

    return content


def _is_sound(name: str) -> bool:
    return name == "ir" or name.startswith("ir_within_")


def _tar(rows: list[dict[str, Any]]) -> bytes:
    """WebDataset: ROOM-SOURCE-RECEIVER.ir.npy, likewise for targets, and .json."""
    file = io.BytesIO()
    with tarfile.open(fileobj=file, mode="w", format=tarfile.USTAR_FORMAT) as archive:
        for row in rows:
            key = f"{row['room']:06d}-{row['source']}-{row['receiver']}"
            files = []
            for name in filter(_is_sound, row):
                samples = io.BytesIO()
                np.save(samples, row[name])
                files.append((f"{name}.npy", samples.getvalue()))
            labels = {name: _finite(value.tolist()) for name, value in row.items() if not _is_sound(name)}
            for end, content in (*files, ("json", json.dumps(labels).encode())):
                member = tarfile.TarInfo(f"{key}.{end}")
                member.size = len(content)
                archive.addfile(member, io.BytesIO(content))
    return file.getvalue()


def _finite(value: Any) -> Any:
    """JSON has no NaN and no infinity."""
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return value if not isinstance(value, float) or np.isfinite(value) else None


class _Progress:
    """Rooms done: a bar of tqdm where it is installed, else a number on stderr; or the function that was given."""

    def __init__(self, progress: Any, done: int, total: int) -> None:
        from . import _in_notebook

        self._done, self._total = done, total
        self._bar: Any = None
        self._lock = threading.Lock()
        self._follower: Callable[[str, float], object] | None = progress if callable(progress) else None
        shows = sys.stderr.isatty() or _in_notebook() if progress is None else bool(progress) and self._follower is None
        if shows:
            try:
                from tqdm.auto import tqdm  # type: ignore[import-untyped]

                self._bar = tqdm(total=total, initial=done, unit="room")
            except ImportError:
                self._follower = self._print

    def __enter__(self) -> Callable[[int], None]:
        return self._step

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()

    def _step(self, rooms: int) -> None:
        with self._lock:
            self._done += rooms
            if self._bar is not None:
                self._bar.update(rooms)
            if self._follower is not None:
                self._follower("rooms", self._done / self._total)

    def _print(self, what: str, share: float) -> None:
        sys.stderr.write(f"\r{what} {share:4.0%}" + ("\n" if self._done == self._total else ""))
        sys.stderr.flush()
