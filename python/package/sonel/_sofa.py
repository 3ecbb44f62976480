"""Responses as SOFA files of the convention SingleRoomSRIR (AES69), by the package sofar.

A measurement is a source at a receiver of the response. The receivers of SOFA are its channels: a single point, the two ears, spherical
harmonics, or the microphones of an array. Listeners have the axes of the scene, heads and aimed ambisonics those of the receiver's aim. Impulse responses are relative to the pressure of the source at 1 m in a free field.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ._sonel import Error

if TYPE_CHECKING:
    from . import Response

EARS_M = [[0.0, 0.09, 0.0], [0.0, -0.09, 0.0]]


def write(
    response: Response,
    path: Path,
    *,
    ambix: int | None,
    array: Any,
    microphones: list[dict[str, Any]] | None,
    sample_rate: int,
    **options: Any,
) -> None:
    """Writes `path`, which must not exist."""
    try:
        import sofar  # type: ignore[import-untyped]
    except ImportError:
        raise Error("SOFA files need the package sofar: pip install sofar") from None
    if path.suffix != ".sofa":
        raise Error(f"{path} does not end in .sofa")
    if os.path.lexists(path):
        raise Error(f"{path} exists: delete it first, or choose another name")
    samples = response.impulse_responses(ambix=ambix, array=array, sample_rate=sample_rate, **options)
    sofa = sofar.Sofa("SingleRoomSRIR")
    aim = bool(options["aim"]) or options["hrtf"] is not None
    _places(sofa, response, in_axes_of_the_scene=not aim)
    _channels(sofa, samples.shape[2], ambix, microphones)
    if samples.shape[2] > 2 and options["hrtf"] is not None:
        measured = sofar.read_sofa(os.fspath(options["hrtf"]), verbose=False)
        sofa.ReceiverPosition = measured.ReceiverPosition.reshape(samples.shape[2], -1)[:, :3]
        sofa.ReceiverPosition_Type, sofa.ReceiverPosition_Units = measured.ReceiverPosition_Type, measured.ReceiverPosition_Units
        sofa.GLOBAL_ReceiverDescription = f"microphones of {measured.GLOBAL_Title or os.path.basename(options['hrtf'])}"
    _room(sofa, response)
    sofa.Data_IR = samples.reshape(-1, *samples.shape[2:]).astype(float)
    sofa.Data_SamplingRate = float(sample_rate)
    sofa.Data_Delay = np.zeros((1, samples.shape[2]))
    sofar.write_sofa(str(path), sofa)


def _places(sofa: Any, response: Response, *, in_axes_of_the_scene: bool) -> None:
    """Where sources and listeners are and where listeners look, in the axes of the scene [m]."""
    pairs = [(s, r) for s in range(len(response.sources)) for r in range(len(response.receivers))]
    sources, receivers = (list(index) for index in zip(*pairs))
    up = response._inner.room[1] or [0.0, 0.0, 1.0]
    sofa.SourcePosition = response.source_positions[sources]
    sofa.ListenerPosition = response.receiver_positions[receivers]
    sofa.ListenerUp = np.array([up])
    if in_axes_of_the_scene:
        sofa.ListenerView = np.array([[0.0, 1.0, 0.0] if abs(up[0]) >= 0.9 else [1.0, 0.0, 0.0]])
    else:
        sofa.ListenerView = np.cross(response["lateral_axis"], up)[receivers]
    sofa.MeasurementDate = np.zeros(len(pairs))


def _channels(sofa: Any, channels: int, ambix: int | None, microphones: list[dict[str, Any]] | None) -> None:
    """The receivers of SOFA."""
    if microphones is not None:
        sofa.ReceiverPosition_Type, sofa.ReceiverPosition_Units = "cartesian", "metre"
        sofa.ReceiverPosition = np.array([microphone["position"] for microphone in microphones], dtype=float)
        kinds = [f"{microphone['name']}: {microphone.get('directivity', 'omni')}" for microphone in microphones]
        sofa.GLOBAL_ReceiverDescription = "microphones " + ", ".join(kinds)
    elif ambix is not None:
        sofa.ReceiverPosition_Type = "spherical harmonics"
        sofa.ReceiverPosition_Units = "degree, degree, metre"
        sofa.ReceiverPosition = np.zeros((channels, 3))
        sofa.GLOBAL_ReceiverDescription = "ambisonics, ACN order, SN3D; front is ListenerView"
    else:
        sofa.ReceiverPosition_Type, sofa.ReceiverPosition_Units = "cartesian", "metre"
        sofa.ReceiverPosition = np.array(EARS_M if channels == 2 else [[0.0, 0.0, 0.0]])
        sofa.GLOBAL_ReceiverDescription = "left ear, right ear" if channels == 2 else "omnidirectional"
    _remove(sofa, "ReceiverDescriptions", "ReceiverView", "ReceiverUp", "EmitterDescriptions", "EmitterView", "EmitterUp")


def _room(sofa: Any, response: Response) -> None:
    """Room and provenance."""
    metadata = response.metadata
    volume, _, seed = response._inner.room
    sofa.GLOBAL_Title = f"{metadata['scene']}: simulated impulse responses"
    sofa.GLOBAL_RoomDescription = str(metadata["scene"])
    sofa.GLOBAL_RoomType = "reverberant" if volume is not None else "outdoor"
    sofa.GLOBAL_ApplicationName = "sonel"
    sofa.GLOBAL_ApplicationVersion = str(metadata["tool_version"])
    sofa.GLOBAL_SourceDescription = ", ".join(response.sources)
    sofa.GLOBAL_ListenerDescription = ", ".join(response.receivers)
    sofa.GLOBAL_Comment = f"Simulated by energies, relative to a free field at 1 m; map {metadata['map_digest']}, seed {seed}"
    _remove(sofa, "RoomCornerA", "RoomCornerB", "RoomCorners", "RoomTemperature")
    if volume is None:
        _remove(sofa, "RoomVolume")
    else:
        sofa.RoomVolume = float(volume)


def _remove(sofa: Any, *names: str) -> None:
    """Removes optional entries with their types and units."""
    for name in names:
        for entry in (name, f"{name}_Type", f"{name}_Units"):
            if hasattr(sofa, entry):
                sofa.delete(entry)
