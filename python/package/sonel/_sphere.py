"""Microphones on a rigid sphere as a SOFA file that `hrtf=` takes, by the package sofar.

Pressure on a rigid sphere of radius a under a plane wave at the angle θ from the microphone, over that at its centre without it:
H(μ, θ) = μ⁻² Σ (−i)^(m−1) (2m + 1) P_m(cos θ) / h_m′(μ), μ = 2π f a / c (convention e^(−iωt)) [DudaMartens1998], as of the head in
docs/formats/sound.md.
"""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ._sonel import Error

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

# Orders beyond μ of the series: the terms fall off faster than exponentially.
_BEYOND = 20
# Directions of a head, 6° apart, and how many times the least number of directions that tell all orders at the band limit apart.
_FEWEST, _TIMES = 1000, 2
# Samples of a response beside its way around the sphere: the band limit rings.
_RINGING = 64
# Microphones at one distance from the middle, to this part.
_SAME = 1e-6


def rigid_sphere(path: str | os.PathLike[str], microphones: ArrayLike, *, sample_rate: int = 48_000, speed_of_sound: float = 343.0) -> Path:
    """Writes microphones on a rigid sphere as a SOFA file for `hrtf=` of `impulse_responses`, `to_sofa` and `dataset`.

    Arrays of `array=` are open: the microphones disturb nothing. On a rigid sphere, as usual spherical arrays have, sound is louder on the side
    that it comes from and goes around to the other. All responses come a radius and 16 samples later than the centre of an open array has them.

    Parameters
    ----------
    path
        File that ends in `.sofa` and does not exist.
    microphones
        Positions about the centre [m], shape [N, 3], all at one distance from it: x towards where the receiver looks, y left, z up.
    sample_rate
        Sample rate [Hz]; `impulse_responses` converts.
    speed_of_sound
        Speed of sound [m/s], above 0.

    Returns
    -------
    Path
        The path of the file.

    Raises
    ------
    Error
        When the microphones are not at one distance from the centre, the file exists, or the package sofar is missing.
    """
    path = Path(path)
    places = np.asarray(microphones, dtype=float)
    if places.ndim != 2 or places.shape[1] != 3 or not len(places) or not np.isfinite(places).all():
        raise Error("microphones are finite positions of shape [N, 3] in metres")
    radii = np.linalg.norm(places, axis=1)
    radius = float(radii[0])
    if radius <= 0 or np.abs(radii - radius).max() > _SAME * radius:
        raise Error("microphones on a rigid sphere are all at one distance above 0 from its centre")
    if not speed_of_sound > 0:
        raise Error("speed_of_sound is above 0 m/s")
    if path.suffix != ".sofa":
        raise Error(f"{path} does not end in .sofa")
    if os.path.lexists(path):
        raise Error(f"{path} exists: delete it first, or choose another name")
    try:
        import sofar  # type: ignore[import-untyped]
    except ImportError:
        raise Error("SOFA files need the package sofar: pip install sofar") from None
    directions = _spread(_count(math.pi * sample_rate * radius / speed_of_sound))
    sofa: Any = sofar.Sofa("GeneralFIR")
    sofa.GLOBAL_Title = f"{len(places)} microphones on a rigid sphere of {1000 * radius:g} mm"
    sofa.SourcePosition, sofa.SourcePosition_Type, sofa.SourcePosition_Units = directions, "cartesian", "metre"
    sofa.ReceiverPosition, sofa.ReceiverPosition_Type, sofa.ReceiverPosition_Units = places, "cartesian", "metre"
    sofa.Data_IR, lead = _responses(directions @ places.T / radius, radius, sample_rate, speed_of_sound)
    sofa.Data_SamplingRate, sofa.Data_Delay = float(sample_rate), np.zeros((1, len(places)))
    sofa.GLOBAL_Comment = f"the centre of the sphere would hear {lead} samples after the begin"
    sofar.write_sofa(str(path), sofa)
    return path


def _count(highest: float) -> int:
    """Directions for a sphere of this μ at the band limit."""
    return max(_FEWEST, _TIMES * math.ceil(highest + 1) ** 2)


def _spread(count: int) -> NDArray[np.float64]:
    """Unit vectors spread evenly by the golden angle."""
    z = 1 - (2 * np.arange(count) + 1) / count
    angle = math.pi * (3 - math.sqrt(5)) * np.arange(count)
    across = np.sqrt(1 - z * z)
    return np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=1)


def _responses(cosines: NDArray[np.float64], radius: float, rate: int, speed: float) -> tuple[NDArray[np.float64], int]:
    """Responses [direction, microphone, sample] for the cosines of incidence, and the sample at which the centre would hear."""
    around = math.ceil(radius / speed * rate)
    length = 2 ** math.ceil(math.log2(_RINGING + 8 * around))
    lead = around + _RINGING // 4
    bins = np.arange(1, length // 2 + 1)
    factors = _orders(2 * math.pi * bins * rate / length * radius / speed)
    turns = np.exp(-2j * math.pi * bins * lead / length)
    found = np.empty((*cosines.shape, length))
    for direction, row in enumerate(cosines):
        spectrum = np.ones((len(row), length // 2 + 1), dtype=complex)
        # e^(−iωt) in the series, e^(+iωt) in the transform.
        spectrum[:, 1:] = np.conj(_legendre(row, len(factors)).T @ factors) * turns
        found[direction] = np.fft.irfft(spectrum, length)
    return found, lead


def _orders(mu: NDArray[np.float64]) -> NDArray[np.complex128]:
    """μ⁻² (−i)^(m−1) (2m + 1) / h_m′(μ) for every order m and μ. The recurrence of h_m upwards is stable, as |h_m| grows."""
    before, own = np.exp(1j * mu) / mu, -1j * np.exp(1j * mu) / mu
    factors = []
    # Beyond the largest number h_m counts as infinite: its term is nothing.
    with np.errstate(over="ignore", invalid="ignore"):
        for m in range(int(mu.max()) + _BEYOND):
            factor = (-1j) ** (m - 1) * (2 * m + 1) / (before - own * ((m + 1) / mu)) / mu**2
            factors.append(np.where(np.isfinite(factor), factor, 0))
            before, own = own, own * ((2 * m + 1) / mu) - before
    return np.array(factors)


def _legendre(cosines: NDArray[np.float64], count: int) -> NDArray[np.float64]:
    """P_m for the orders below `count`, shape [order, cosine]."""
    found = [np.ones_like(cosines), cosines]
    for m in range(1, count - 1):
        found.append(((2 * m + 1) * cosines * found[m] - m * found[m - 1]) / (m + 1))
    return np.array(found[:count])
