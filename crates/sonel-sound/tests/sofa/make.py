#!/usr/bin/env python3
"""Makes the corpus of SOFA files in this folder: `pip install sofar==1.3.0 h5py==3.16.0`, then `python make.py`.

All files are meant to hold one head: 14 directions, 16 samples at 48 kHz, a response of ear e in direction m has 1 + m + 100 e at sample m and
zeros elsewhere. They differ in how HDF5 stores that. `hostile-*` claim more than they hold.
"""

from pathlib import Path

import h5py
import numpy as np
import sofar

FOLDER = Path(__file__).parent
DIRECTIONS, SAMPLES = 14, 16


def responses() -> np.ndarray:
    taps = np.zeros((DIRECTIONS, 2, SAMPLES))
    for direction in range(DIRECTIONS):
        taps[direction, :, direction] = [1 + direction, 101 + direction]
    return taps


def places() -> np.ndarray:
    angles = 360 * np.arange(DIRECTIONS) / DIRECTIONS
    return np.stack([angles, np.zeros(DIRECTIONS), np.full(DIRECTIONS, 1.5)], axis=1)


def by_sofar(path: Path) -> None:
    sofa = sofar.Sofa("SimpleFreeFieldHRIR")
    sofa.Data_IR, sofa.Data_SamplingRate = responses(), 48000
    sofa.SourcePosition, sofa.ReceiverPosition = places(), [[0, 0.09, 0], [0, -0.09, 0]]
    sofa.Data_Delay = [[0, 0]]
    sofa.GLOBAL_DateCreated = sofa.GLOBAL_DateModified = "2026-01-01 00:00:00"
    sofar.write_sofa(path, sofa)


def by_h5py(path: Path, taps: np.ndarray, *, libver: object = "earliest", kind: str = "<f8", shape: object = None, delay: float = 0, **stored: object) -> None:
    """The least that AES69 asks for, written without the netCDF library."""
    with h5py.File(path, "w", libver=libver, track_order=True) as file:
        attributes = {
            "Conventions": "SOFA", "Version": "1.0", "SOFAConventions": "SimpleFreeFieldHRIR", "SOFAConventionsVersion": "1.0",
            "DataType": "FIR", "RoomType": "free field",
        }
        for name, value in attributes.items():
            file.attrs[name] = np.bytes_(value)
        sizes = {"I": 1, "C": 3, "R": 2, "E": 1, "M": taps.shape[0], "N": taps.shape[2]}
        for name, size in sizes.items():
            dimension = file.create_dataset(name, data=np.zeros(size, ">f4"))
            dimension.attrs["CLASS"] = np.bytes_("DIMENSION_SCALE")
            dimension.attrs["NAME"] = np.bytes_(f"This is a netCDF dimension but not a netCDF variable.{size:10d}")

        def variable(name: str, values: object, **attributes: str) -> None:
            variable = file.create_dataset(name, data=np.asarray(values, "<f8"))
            for key, value in attributes.items():
                variable.attrs[key] = np.bytes_(value)

        variable("ListenerPosition", [[0, 0, 0]], Type="cartesian", Units="metre")
        variable("ListenerView", [[1, 0, 0]], Type="cartesian", Units="metre")
        variable("ListenerUp", [[0, 0, 1]], Type="cartesian", Units="metre")
        variable("ReceiverPosition", [[[0], [0.09], [0]], [[0], [-0.09], [0]]], Type="cartesian", Units="metre")
        variable("SourcePosition", places()[: taps.shape[0]], Type="spherical", Units="degree, degree, metre")
        variable("EmitterPosition", [[[0], [0], [0]]], Type="cartesian", Units="metre")
        variable("Data.SamplingRate", [48000], Units="hertz")
        variable("Data.Delay", [[0, delay]])
        array = file.create_dataset("Data.IR", shape or taps.shape, kind, **stored)
        array[: taps.shape[0], :, : taps.shape[2]] = taps


def main() -> None:
    taps = responses()
    by_sofar(FOLDER / "sofar.sofa")
    chunks = {"chunks": (5, 2, 16)}
    deflate = {"compression": "gzip", "compression_opts": 9}
    stored = {
        "contiguous": {},
        "chunked": chunks,
        "deflate": chunks | deflate,
        "deflate-shuffle": chunks | deflate | {"shuffle": True},
        "many-chunks": {"chunks": (1, 1, 2), "shuffle": True} | deflate,
        "checksums": chunks | deflate | {"shuffle": True, "fletcher32": True},
        "single-precision": {"kind": "<f4"},
        "big-endian": {"kind": ">f8"},
    }
    for name, how in stored.items():
        by_h5py(FOLDER / f"{name}.sofa", taps, libver=("v108", "v108"), **how)
    for name, delay in {"negative": -1, "endless": np.inf}.items():
        by_h5py(FOLDER / f"{name}-delay.sofa", taps, libver=("v108", "v108"), delay=delay)
    # Headers of HDF5 before 1.8, of 1.10 and of the newest.
    for libver in ("earliest", "v110", "latest"):
        by_h5py(FOLDER / f"headers-{libver}.sofa", taps, libver=(libver, libver) if libver == "v110" else libver, **stored["deflate-shuffle"])
    # 69 MB, of which a few chunks are there.
    claimed = stored["deflate-shuffle"] | {"shape": (DIRECTIONS, 2, 310_000)}
    by_h5py(FOLDER / "hostile-claims.sofa", taps, libver=("v108", "v108"), **claimed)


if __name__ == "__main__":
    main()
