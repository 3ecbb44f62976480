"""Compares `sonel-analyze parameters IMPULSE.wav` with pyrato: decays into noise, octaves from 125 Hz, in just-noticeable differences.

Both get the same octaves: the filters of docs/formats/sound.md without phase, whose ringing before the onset belongs to the onset. The early decay
time is read off pyrato's decay curve from 0 to -10 dB; pyrato itself begins at -0.1 dB, where a strong onset makes a difference.
"""

import json
import subprocess
import sys
import tempfile
import warnings
import wave
from pathlib import Path

import numpy as np
import pyfar
import pyrato

RATE = 48_000
LIMIT = 0.1
CASES = [(1, 1.0, -60.0), (2, 0.5, -55.0), (3, 2.5, -60.0)]
RELATIVE = {"t20_s": 0.05, "t30_s": 0.05, "early_decay_time_s": 0.05}
ABSOLUTE = {"clarity_c50_db": 1.0, "clarity_c80_db": 1.0, "definition_d50": 0.05, "center_time_s": 0.01}


def impulse(seed: int, time: float, floor_db: float) -> np.ndarray:
    """A click after 50 ms with a decay of noise, and stationary noise."""
    random = np.random.default_rng(seed)
    seconds = np.arange(int(RATE * max(3 * time, 2.0))) / RATE
    decay = random.standard_normal(len(seconds)) * 10 ** (-3 * seconds / time)
    decay[0] += 20
    whole = np.concatenate([np.zeros(RATE // 20), decay])
    whole += random.standard_normal(len(whole)) * 10 ** (floor_db / 20)
    return np.round(whole / np.abs(whole).max() * (2**31 - 1) * 0.99) / 2**31


def write(path: Path, samples: np.ndarray) -> None:
    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(4)
        file.setframerate(RATE)
        file.writeframes((samples * 2**31).astype("<i4").tobytes())


def octaves(samples: np.ndarray, centers: list[float]) -> np.ndarray:
    """The octaves from the onset on."""
    onset = int(np.argmax(np.abs(samples) >= 0.1 * np.abs(samples).max()))
    length = 1 << (len(samples) + RATE // 2 - 1).bit_length()
    spectrum, frequency = np.fft.rfft(samples, length), np.fft.rfftfreq(length, 1 / RATE)
    bands = []
    for center in centers:
        ratio = np.maximum(frequency, 1e-9) / center
        gain = 1 / np.sqrt(1 + (np.sqrt(2) * (ratio - 1 / ratio)) ** 6)
        band = np.fft.irfft(spectrum * gain, length)[: len(samples)]
        before = np.sum(band[max(0, onset - RATE // 20) : onset] ** 2)
        after = band[onset:].copy()
        after[0] = np.sqrt(after[0] ** 2 + before)
        bands.append(after)
    return np.array(bands)


def early_decay_time(curve: pyfar.TimeData) -> float:
    level = 10 * np.log10(np.abs(curve.time[0]))
    inside = slice(0, int(np.argmax(level < -10)))
    return -60 / np.polyfit(curve.times[inside], level[inside], 1)[0]


def reference(band: np.ndarray) -> dict[str, float]:
    curve = pyrato.edc.energy_decay_curve_chu_lundeby(pyfar.Signal(band, RATE), time_shift=False)
    read = pyrato.parameters
    values = {
        "t20_s": read.reverberation_time_linear_regression(curve, "T20"),
        "t30_s": read.reverberation_time_linear_regression(curve, "T30"),
        "early_decay_time_s": early_decay_time(curve),
        "clarity_c50_db": read.clarity(curve, 50),
        "clarity_c80_db": read.clarity(curve, 80),
        "definition_d50": read.definition(curve, 50),
        "center_time_s": read.center_time(curve),
    }
    return {name: float(np.ravel(value)[0]) for name, value in values.items()}


def main(program: str) -> None:
    warnings.filterwarnings("ignore")
    worst: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder:
        for seed, time, floor_db in CASES:
            path, samples = Path(folder) / f"{seed}.wav", impulse(seed, time, floor_db)
            write(path, samples)
            run = subprocess.run([program, "parameters", str(path), "--format", "json", "--quiet"], capture_output=True, check=True)
            bands = [band for band in json.loads(run.stdout)["receivers"][0]["bands"] if band["center_frequency_hz"] >= 125]
            for band, samples_of in zip(bands, octaves(samples, [band["center_frequency_hz"] for band in bands])):
                for name, value in reference(samples_of).items():
                    scale = RELATIVE[name] * value if name in RELATIVE else ABSOLUTE[name]
                    found = band[name]["value"]
                    if found is None:
                        sys.exit(f"{name} at {band['center_frequency_hz']} Hz: {band[name]['reason']}")
                    worst[name] = max(worst.get(name, 0.0), abs(found - value) / scale)
    for name, difference in worst.items():
        print(f"{name}: {difference:.4f} JND")
    if max(worst.values()) > LIMIT:
        sys.exit(f"more than {LIMIT} just-noticeable differences from pyrato")


main(sys.argv[1])
