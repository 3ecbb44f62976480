"""`sonel.fit` in rooms whose absorption is known, and the derivatives that it goes by."""

import os
import re
import sys
from pathlib import Path

import numpy as np
import pytest
import sonel

KEYS = ["early_decay_time_s", "t20_s", "clarity_c80_db", "level_db"]
NAMES = ["walls", "z0", "z1"]
START = np.array([[0.2, 0.2], [0.3, 0.3], [0.2, 0.4]])
TRUTH = np.array([[0.12, 0.25], [0.5, 0.2], [0.3, 0.3]])
SEATS = {"near": [2.6, 2.0, 1.2], "far": [6.9, 3.7, 2.1]}
RAYS = 4096


def traced(absorption, seed, packets=18_000):
    materials = {name: {"absorption": list(alpha), "scattering": 0.4} for name, alpha in zip(NAMES, absorption)}
    scene = sonel.Scene.shoebox([8, 5, 4], materials, sources=[1.5, 1.2, 1.3], bands={"center_frequencies_hz": [500, 1000]}, duration_s=0.8)
    return sonel.trace(scene, packets=packets, seed=seed)


def values(room, seats=SEATS, keys=KEYS, rays=RAYS):
    """What a room reads, and its standard deviations."""
    found = room.render(seats, rays=rays).parameters()
    widths = {key: found[key + "_high"] - found[key + "_low"] for key in keys}
    return {key: found[key] for key in keys}, {key: width / 4 for key, width in widths.items()}


@pytest.fixture(scope="module")
def room():
    return traced(START, 1)


@pytest.fixture(scope="module")
def measured():
    return values(traced(TRUTH, 3))


@pytest.fixture(scope="module")
def light():
    """Few packets, where numbers do not matter."""
    return traced(START, 1, packets=1000)


def missed(fit):
    return int(np.sum((TRUTH < fit.low) | (TRUTH > fit.high)))


def test_known_absorption_is_recovered_within_its_intervals(room, measured):
    """Of six coefficients two or more are outside their 95 % intervals once in 30 runs; the seeds are constant."""
    fit = sonel.fit(room, measured[0], sigma=measured[1], receivers=SEATS, prior_sigma=1, rays=RAYS)
    assert fit.is_settled and fit.materials == NAMES, fit
    assert missed(fit) <= 1, fit
    assert np.all(fit.verdict == "identified") and np.all(fit.high - fit.low < 0.3), fit
    assert all(after < before for before, after in fit.deviation.values()), fit.deviation
    again = room.render(SEATS, set=fit.changes, rays=RAYS).parameters()["t20_s"]
    assert np.all(np.abs(again / measured[0]["t20_s"] - 1) < 0.1)


def test_a_wrong_measurement_is_not_within_the_intervals(room, measured):
    """The sibling: levels 0.3 dB too high."""
    wrong = {**measured[0], "level_db": measured[0]["level_db"] + 0.3}
    fit = sonel.fit(room, wrong, sigma=measured[1], receivers=SEATS, prior_sigma=1, rays=RAYS)
    assert missed(fit) >= 3, fit


def test_what_the_data_do_not_tell_is_said(room, measured):
    """One reverberation time tells the absorption area and not whose it is; values that are hardly known tell nothing."""
    seat = {"near": SEATS["near"]}
    fit = sonel.fit(room, {"t20_s": measured[0]["t20_s"][:, :1]}, sigma={"t20_s": 0.002}, receivers=seat, rays=RAYS)
    assert np.sum(fit.verdict == "confounded") >= 4 and (500.0, "walls", "z0") in fit.confounded, fit
    fit = sonel.fit(room, {"level_db": measured[0]["level_db"][:, :1]}, sigma={"level_db": 10}, receivers=seat, rays=RAYS)
    assert np.all(fit.verdict == "weak") and np.all(np.abs(fit.absorption - START) < 0.01), fit


def test_a_wanted_time_is_reached_by_the_material_that_may_change(room):
    """3 % of T is 3 % of the absorption area, 0.05 of the ceiling's absorption. The band without a goal stays."""
    wanted = values(traced([START[0], START[1], [0.2, 0.6]], 7))[0]["t20_s"].mean(axis=(0, 1))
    fit = sonel.fit(
        room, {"t20_s": [np.nan, wanted[1]]}, sigma={"t20_s": 0.01}, receivers=SEATS, materials=["z1"], prior_sigma=3, rays=RAYS
    )
    assert list(fit.changes) == ["materials.z1.absorption"], fit
    assert abs(fit.absorption[2, 1] - 0.6) < 0.07 and fit.absorption[2, 0] == START[2, 0], fit
    assert np.array_equal(fit.absorption[:2], START[:2]) and fit.verdict[2, 0] == "not fitted", fit


def test_derivatives_have_the_shape_of_their_docstring_and_are_differences(room):
    slopes = room.sensitivity(SEATS, rays=RAYS)
    assert slopes.shape == (1, 2, 3, 2) and list(room.materials) == NAMES
    step = 0.02
    changed = [room.render(SEATS, set={"materials.walls.absorption": START[0] + by}, rays=RAYS) for by in (-step, step)]
    for key in ("level_db", "t20_s"):
        less, more = (response.parameters()[key] for response in changed)
        difference = (more - less) / (2 * step)
        assert np.allclose(slopes[key][:, :, 0], difference, rtol=0.1), key
        assert np.all(slopes[key + "_low"] < slopes[key]) and np.all(slopes[key] < slopes[key + "_high"])
    assert np.all(slopes["t20_s"] < 0)
    assert room.sensitivity(SEATS, coefficient="scattering", rays=RAYS).shape == slopes.shape
    np.testing.assert_array_equal(slopes["t30_s_value"][:, :, 0], slopes["t30_s_value"][:, :, -1])
    with pytest.raises(sonel.Error, match="absorption, scattering"):
        room.sensitivity(SEATS, coefficient="transmission")


def test_the_documented_optimisation_reaches_its_time():
    """Value and gradient come from one rendering, so that the search ends where the parameters of that rendering are those wanted: bounds bind nowhere."""
    optimize = pytest.importorskip("scipy.optimize")
    text = (Path(__file__).parents[2] / "docs" / "python.md").read_text(encoding="utf-8")
    [documented] = re.findall(r"```python\n(room = sonel\.trace\(scene, variants=(?:(?!```).)*misfit.*?)```", text, re.DOTALL)
    walls = {"absorption": 0.3, "scattering": 0.4}
    scene = sonel.Scene.shoebox([6, 5, 3], {"walls": walls}, sources=[1.5, 1.2, 1.3], bands={"center_frequencies_hz": [500, 1000]})
    names = {"np": np, "sonel": sonel, "scene": scene, "seats": SEATS["near"], "scipy": type("scipy", (), {"optimize": optimize})}
    exec(documented.replace("(scene,", "(scene, packets=1000,").replace("* 8", "* 2"), names)
    room = names["room"]
    begin = room.materials["walls"]["absorption"]
    assert begin.shape == (2,) and names["best"].fun < 1e-3 < names["misfit"](begin)[0], names["best"]


def test_wrong_input_is_named(light, monkeypatch):
    t20 = {"t20_s": 1.0}
    for wrong, message in [
        (({"rt": 1.0},), "rt.*give those of level_db"),
        (({"t20_s": [1.0, 1.0, 1.0]},), r"shape \[source, receiver, band\], \[1, 2, 2\]"),
        (({"t20_s": -1.0},), "not above 0 s"),
    ]:
        with pytest.raises(sonel.Error, match=message):
            sonel.fit(light, *wrong, receivers=SEATS, rays=64)
    for wrong, message in [
        ({"materials": ["felt"]}, "felt.*walls, z0, z1"),
        ({"prior_sigma": 0}, "above 0"),
        ({"sigma": {"t20_s": 0}}, "not above 0"),
    ]:
        with pytest.raises(sonel.Error, match=message):
            sonel.fit(light, t20, receivers=SEATS, rays=64, **wrong)
    monkeypatch.setitem(sys.modules, "scipy.optimize", None)
    with pytest.raises(sonel.Error, match=r"pip install \"sonel\[fit\]\""):
        sonel.fit(light, t20, receivers=SEATS)


def test_coefficients_that_the_paths_do_not_carry_are_refused_with_the_remedy():
    """From nearly black walls few packets were reflected often enough."""
    dead = traced([[0.97, 0.97]] * 3, 1, packets=2000)
    live, sigma = values(traced([[0.1, 0.1]] * 3, 2, packets=2000), keys=["level_db"], rays=1024)
    with pytest.raises(sonel.Error, match="(?s)does not support these materials.*sonel\\.trace\\(scene, packets=2000"):
        sonel.fit(dead, live, sigma=sigma, receivers=SEATS, prior_sigma=3, rays=1024)


@pytest.mark.skipif("SONEL_LONG" not in os.environ, reason="long: cargo xtask accept")
def test_intervals_hold_the_absorption_as_often_as_they_say():
    """True coefficients are drawn from the prior. One band: bands of a map share packets, so that they would be within or outside together.

    Of some 300 coefficients 95 % ± 1.3 % are expected inside, two thirds of them at half the width. The mean error is within 3.5 of its
    standard errors, 1/(1.96 √300) each.
    """
    start, prior_sigma = np.array([0.15, 0.25, 0.3, 0.2]), 0.5
    names = ["short", "long", "floor", "ceiling"]
    corners = [[x, y, z] for x in (0, 8.0) for y in (0, 6.0) for z in (0, 3.5)]
    faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
    of_faces = [names[index] for index in (0, 0, 1, 1, 2, 3)]
    seats = [[3.0, 2.4, 1.2], [6.9, 4.7, 1.2], [5.0, 1.2, 2.6], [2.2, 5.1, 0.7]]

    def logit(alpha):
        return np.log(alpha / (1 - alpha))

    def box(absorption, seed):
        materials = {name: {"absorption": float(alpha), "scattering": 0.4} for name, alpha in zip(names, absorption)}
        source = {"sources": [1.5, 1.7, 1.3], "bands": {"center_frequencies_hz": [1000]}, "duration_s": 1.0}
        scene = sonel.Scene.from_mesh(corners, faces, materials, face_materials=of_faces, **source)
        return sonel.trace(scene, packets=3000, seed=seed)

    numbers, errors = np.random.default_rng(9000), []
    for repetition in range(1, 81):
        truth = 1 / (1 + np.exp(-logit(start) - prior_sigma * numbers.standard_normal(4)))
        data, sigma = values(box(truth, 5000 + repetition), seats)
        fit = sonel.fit(box(start, repetition), data, sigma=sigma, receivers=seats, rays=RAYS)
        for m, name in enumerate(fit.materials):
            alpha = truth[names.index(name)]
            if fit.verdict[m, 0] == "identified":
                width = logit(fit.high[m, 0]) - logit(fit.low[m, 0])
                errors.append(2 * (logit(fit.absorption[m, 0]) - logit(alpha)) / width)
    errors = np.array(errors)
    inside, half = (np.mean(np.abs(errors) <= scale) for scale in (1.0, 0.5))
    print(f"{len(errors)} identified: {inside:.3f} inside, {half:.3f} at half width, mean {errors.mean():.3f}")
    assert len(errors) >= 240, "the data tell too little to mean anything"
    assert 0.90 <= inside <= 0.99
    assert half < 0.90, "intervals of half the width are found out"
    assert abs(errors.mean()) < 3.5 / (1.96 * np.sqrt(len(errors)))
