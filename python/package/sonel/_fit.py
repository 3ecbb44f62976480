"""Absorption of materials from parameters, measured or wanted.

A map gives parameters and their derivatives by the absorption α of every material (`Map.sensitivity`). In each band they are continued over
u = −ln(1 − α), over which 1/T and levels are nearly straight because packets that met a surface n times carry (1 − α)ⁿ. Least squares of

    Σ ((computed − measured)/σ)² + Σ ((y − y₀)/w)²,  y = ln((α − τ)/(1 − α)),

by scipy give the next coefficients; the map is rendered with them, until the step is as short as noise makes it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _input, _sonel
from ._sonel import Error

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

    from . import Map

    _Numbers = NDArray[np.float64]

# Key, just-noticeable difference, whether that is relative.
PARAMETERS = _sonel.parameters()
_KEYS = [key for key, _, _ in PARAMETERS]
_IS_TIME = np.array([is_relative for _, _, is_relative in PARAMETERS])

# Most renderings. Chosen, not measured: fits that settle take two to five.
_MOST_ROUNDS = 10
# Largest ratio of a continued reverberation time to its value. Chosen, not measured; it keeps times finite where absorption vanishes.
_LONGEST = 20.0
# Longest step of y: a coefficient changes to its odds times or divided by seven at once.
_LONGEST_STEP = 2.0
# Distance of the believed coefficient from the ends of its range, half a unit of the two digits of tables.
_FROM_THE_END = 0.005
# Absorption is read as this at the most, because nothing is left to multiply beyond.
_BLACKEST = 1 - 1e-6
# Root mean square of a step that is short [standard errors]. Chosen, not measured; doubled, fits end a rendering earlier.
_SHORT = 0.5
# χ² of four degrees of freedom exceeds this many times its mean in one of ten cases: each rendering draws part of its noise anew.
_REDRAWN = 2.0
# Largest share of the prior variance that the data leave of an identified coefficient: half, so that they count more than the prior.
_LEFT = 0.5
# Cosine between derivatives from which on coefficients are confounded: 18°. Chosen, not measured.
_ALIKE = 0.95


@dataclass(frozen=True)
class Fit:
    """Fitted absorption of M materials in B bands, with 95 % intervals."""

    materials: list[str]
    """Names, [M]."""
    center_frequencies: NDArray[np.float64]
    """Nominal band centres [Hz], [B]."""
    start: NDArray[np.float64]
    """Absorption of the map, [M, B]."""
    absorption: NDArray[np.float64]
    """Fitted absorption, [M, B]; that of the map where it is not fitted."""
    low: NDArray[np.float64]
    """Lower ends of the intervals, [M, B]: noise of measurement and map, and what the map's coefficient was believed to be."""
    high: NDArray[np.float64]
    """Upper ends, [M, B]."""
    verdict: NDArray[np.str_]
    """[M, B]: "identified"; "weak", where the data hardly depend on the coefficient; "confounded", where it would be identified if those of other
    materials were known; "not fitted", without data or where no packet depends on it. Weak and confounded ones stay near the value of the map."""
    confounded: list[tuple[float, str, str]]
    """Pairs of materials that the data cannot tell apart, with the centre of the band [Hz]."""
    deviation: dict[str, tuple[float, float]]
    """Root mean square of the deviations of each parameter [standard deviations], with the map's absorption and with that fitted."""
    renderings: int
    """Renderings that were made."""
    is_settled: bool
    """False where the coefficients still moved in the last rendering: fit again from them."""

    @property
    def changes(self) -> dict[str, NDArray[np.float64]]:
        """For `set` of `Map.render`: the absorption of the materials that were fitted."""
        fitted = np.any(self.verdict != "not fitted", axis=1)
        return {f"materials.{name}.absorption": self.absorption[m] for m, name in enumerate(self.materials) if fitted[m]}

    def __str__(self) -> str:
        head = "".join(f"{center:>20g} Hz" for center in self.center_frequencies)
        width = max(map(len, self.materials))
        lines = [" " * width + head]
        for m, name in enumerate(self.materials):
            cells = zip(self.absorption[m], self.low[m], self.high[m], self.verdict[m])
            lines.append(f"{name:{width}}" + "".join(f"  {a:.3f} [{low:.3f}, {high:.3f}]{_MARK[word]}" for a, low, high, word in cells))
        lines += [f"{center:g} Hz: {one} and {other} cannot be told apart" for center, one, other in self.confounded]
        return "\n".join([*lines, "w: weak, c: confounded, -: not fitted"])


_MARK = {"identified": "  ", "weak": " w", "confounded": " c", "not fitted": " -"}


@dataclass
class _Band:
    """The data of one band about the absorption `here` [m]; D data, m free materials, K batches."""

    here: _Numbers
    low: _Numbers
    believed: _Numbers
    prior_sigma: float
    value: _Numbers
    is_time: NDArray[np.bool_]
    slope: _Numbers
    wanted: _Numbers
    noise: _Numbers
    without: _Numbers
    weight: _Numbers

    def __post_init__(self) -> None:
        self.of_map = _standard_error(self.value, self.without, self.weight)
        self.sigma = np.hypot(self.noise, self.of_map)

    def alpha(self, y: _Numbers) -> _Numbers:
        """Absorption at `y`."""
        alpha: _Numbers = self.low + (1 - self.low) / (1 + np.exp(-np.clip(y, -12, 12)))
        return alpha

    def y(self, alpha: _Numbers) -> _Numbers:
        """The inverse of `alpha`."""
        share = np.clip((alpha - self.low) / (1 - self.low), 1e-5, 1 - 1e-5)
        return np.log(share / (1 - share))

    def predicted(self, y: _Numbers) -> _Numbers:
        """The parameters at `y`, [D]."""
        here, there = (np.minimum(alpha, _BLACKEST) for alpha in (self.here, self.alpha(y)))
        straight = np.where(self.is_time, -1 / self.value**2, 1.0)
        change = straight * ((self.slope * (1 - here)) @ (np.log1p(-here) - np.log1p(-there)))
        rate = np.where(self.is_time, np.maximum(1 / self.value + change, 1 / (_LONGEST * self.value)), 1.0)
        return np.where(self.is_time, 1 / rate, self.value + change)

    def residuals(self, y: _Numbers) -> _Numbers:
        """Deviations of the data, then of the coefficients from what is believed [standard deviations], [D + m]."""
        return np.concatenate([(self.predicted(y) - self.wanted) / self.sigma, (y - self.y(self.believed)) / self.prior_sigma])

    def cost(self, y: _Numbers) -> float:
        return 0.5 * float(np.sum(self.residuals(y) ** 2))

    def solve(self, least_squares: Any) -> None:
        """The least squares, with their derivatives [D + m, m] and covariance [m, m]."""
        found = least_squares(self.residuals, np.clip(self.y(self.here), -5, 5), method="lm")
        here = self.y(self.here)
        self.solution = np.clip(found.x, here - _LONGEST_STEP, here + _LONGEST_STEP)
        self.jacobian = found.jac
        self.covariance = np.linalg.inv(found.jac.T @ found.jac)

    def is_settled(self) -> bool:
        """Whether the step reduces the cost by no more than a short one does, and than the noise that each rendering draws anew."""
        data = self.jacobian[: len(self.value)]
        share = np.einsum("dm,mn,dn->d", data, self.covariance, data)
        allowed = share @ (0.5 * _SHORT**2 + _REDRAWN * (self.of_map / self.sigma) ** 2)
        return self.cost(self.y(self.here)) - self.cost(self.solution) <= float(allowed)

    def half_width(self, student: float) -> _Numbers:
        """Half of the 95 % interval of y. Batches are left out one at a time, because the data share packets and their noise."""
        gain = self.covariance @ self.jacobian[: len(self.value)].T
        measured = np.sum((gain * self.noise / self.sigma) ** 2, axis=1)
        believed = np.sum((self.covariance / self.prior_sigma) ** 2, axis=1)
        shifts = gain @ ((self.without - self.without @ self.weight[:, None]) / self.sigma[:, None])
        of_map = student * _standard_error(np.zeros(len(shifts)), shifts, self.weight)
        half: _Numbers = np.hypot(1.96 * np.sqrt(measured + believed), of_map)
        return half

    def verdicts(self) -> tuple[list[str], list[tuple[int, int]]]:
        """A word for each coefficient, and the pairs that are confounded."""
        data = self.jacobian[: len(self.value)]
        prior = self.prior_sigma**2
        weak = 1 / (1 + prior * np.sum(data**2, axis=0)) > _LEFT
        together = np.diag(self.covariance) / prior > _LEFT
        words = ["weak" if w else "confounded" if t else "identified" for w, t in zip(weak, together)]
        size = np.linalg.norm(data, axis=0)
        alike = np.abs(data.T @ data) > _ALIKE * np.outer(size, size)
        count = len(words)
        pairs = [(i, j) for i in range(count) for j in range(i + 1, count) if alike[i, j] and "confounded" in (words[i], words[j])]
        return words, pairs


def _standard_error(value: _Numbers, without: _Numbers, weight: _Numbers) -> _Numbers:
    """Jackknife of batches of unequal weight [Busing1999]: `value` [D] from all, `without` [D, K] without each."""
    share = 1 / weight
    mean = len(weight) * value - without @ (1 - weight)
    residual = (share * value[:, None] - (share - 1) * without - mean[:, None]) / np.sqrt(share - 1)
    error: _Numbers = np.sqrt(np.mean(residual**2, axis=1))
    return error


def _table(given: Mapping[str, ArrayLike], name: str, shape: tuple[int, ...]) -> _Numbers:
    """Numbers by parameter as an array [P, S, R, B], NaN where there are none."""
    found = np.full((len(_KEYS), *shape), np.nan)
    for key, numbers in given.items():
        if key not in _KEYS:
            raise Error(f"{name} has the key {_input.shown(key)}: give those of {', '.join(_KEYS)}")
        try:
            found[_KEYS.index(key)] = np.asarray(numbers, dtype=float)
        except (TypeError, ValueError):
            raise Error(f"{name}[{_input.shown(key)}] is {_input.shown(numbers)}: give numbers of the shape [source, receiver, band], {list(shape)}") from None
    return found


def fit(
    map: Map,  # noqa: A002 - what it is
    measured: Mapping[str, ArrayLike],
    sigma: Mapping[str, ArrayLike] | None,
    receivers: Any,
    materials: Sequence[str] | None,
    prior_sigma: float,
    options: dict[str, Any],
) -> Fit:
    """As `sonel.fit`."""
    try:
        from scipy.optimize import least_squares  # type: ignore[import-untyped]
        from scipy.stats import t  # type: ignore[import-untyped]
    except ImportError:
        raise Error('sonel.fit needs scipy: pip install "sonel[fit]"') from None
    if not 0 < prior_sigma < np.inf:
        raise Error(f"prior_sigma is {_input.shown(prior_sigma)}: give a number above 0, such as 0.5")
    of_map = map.materials
    for name in materials or []:
        if name not in of_map:
            raise Error(f"materials has {_input.shown(name)}: the map has {', '.join(of_map)}")
    names = list(of_map)
    may_change = np.array([materials is None or name in materials for name in names])
    start, least = (np.array([of_map[name][key] for name in names]) for key in ("absorption", "transmission"))
    alpha = start.copy()
    with_edges = map.render(receivers, **options).parameters()
    value, without, weight, slope, _ = map._derivatives(receivers, "absorption", None, options)
    wanted = _table(measured, "measured", value.shape[1:])
    if len(weight) < 2:
        raise Error("the map has one batch, so that its noise is not known: trace with more batches")
    # Variants are without diffraction; its part of each parameter is taken from one rendering.
    edges = np.nan_to_num(np.stack([with_edges[key] for key in _KEYS]) - value)
    noticeable = np.array([noticed for _, noticed, _ in PARAMETERS])[:, None, None, None]
    half = 0.5 * noticeable * np.where(_IS_TIME[:, None, None, None], np.abs(wanted), 1.0)
    noise = np.where(np.isnan(stated := _table(sigma or {}, "sigma", value.shape[1:])), half, stated)
    if np.any(noise <= 0):
        raise Error("sigma has a number that is not above 0: leave it out for half a just-noticeable difference")
    if np.any(wanted[_IS_TIME] <= 0):
        raise Error("measured has a reverberation time that is not above 0 s: give NaN where nothing was measured")

    def bands() -> dict[int, tuple[_Band, NDArray[Any], NDArray[np.bool_]]]:
        """Bands with data; which data, and which materials are free."""
        found = {}
        for b in range(value.shape[-1]):
            known = np.isfinite(wanted[..., b] + value[..., b]) & np.all(np.isfinite(without[..., b, :]), axis=-1)
            # Where no packet depends on a material it has no derivative at all.
            free = may_change & np.any(np.isfinite(slope[..., b]) & known[..., None], axis=(0, 1, 2))
            known &= np.all(np.isfinite(slope[..., b]) | ~free, axis=-1)
            if known.any() and free.any():
                believed = np.clip(start[free, b], least[free, b] + _FROM_THE_END, 1 - _FROM_THE_END)
                parameter = np.nonzero(known)[0]
                shift = (wanted - edges)[..., b][known]
                band = _Band(
                    alpha[free, b], least[free, b], believed, prior_sigma, value[..., b][known], _IS_TIME[parameter],
                    slope[..., b][known][:, free], shift, noise[..., b][known], without[..., b, :][known], weight,
                )  # fmt: skip
                found[b] = band, parameter, free
        return found

    first: dict[int, tuple[_Band, NDArray[Any], NDArray[np.bool_]]] = {}
    for renderings in range(1, _MOST_ROUNDS + 1):
        if renderings > 1:
            changed = {f"materials.{name}.absorption": np.round(alpha[m], 4) for m, name in enumerate(names) if may_change[m]}
            value, without, weight, slope, _ = map._derivatives(receivers, "absorption", changed, options)
        current = bands()
        if not current:
            raise Error("the map supports none of the measured values, or no material that may change is on a surface")
        first = first or current
        for b, (band, _, free) in current.items():
            band.solve(least_squares)
            alpha[free, b] = band.alpha(band.solution)
        is_settled = all(band.is_settled() for band, _, _ in current.values())
        if is_settled:
            break

    low, high = np.full_like(start, np.nan), np.full_like(start, np.nan)
    verdict = np.full(start.shape, "not fitted", dtype="U10")
    confounded = []
    centers = np.array(map.center_frequencies)
    student = float(t.ppf(0.975, len(weight) - 1))
    for b, (band, _, free) in current.items():
        half_width = band.half_width(student)
        low[free, b], high[free, b] = band.alpha(band.solution - half_width), band.alpha(band.solution + half_width)
        verdict[free, b], pairs = band.verdicts()
        own = np.nonzero(free)[0]
        confounded += [(float(centers[b]), names[own[i]], names[own[j]]) for i, j in pairs]

    def rms(looked: Mapping[int, tuple[_Band, NDArray[Any], Any]], at_solution: bool) -> dict[str, float]:
        parts: dict[str, list[float]] = {}
        for band, parameter, _ in looked.values():
            y = band.solution if at_solution else band.y(band.here)
            for p, off in zip(parameter, band.residuals(y)):
                parts.setdefault(_KEYS[int(p)], []).append(float(off))
        return {key: float(np.sqrt(np.mean(np.square(off)))) for key, off in parts.items()}

    before, after = rms(first, False), rms(current, True)
    deviation = {key: (before.get(key, np.nan), off) for key, off in after.items()}
    return Fit(names, centers, start, alpha, low, high, verdict, confounded, deviation, renderings, is_settled)
