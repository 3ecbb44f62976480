"""Impulse responses judged by strangers: pyrato reads their parameters, SciPy's spherical harmonics their directions, sofar verifies SOFA.

`cargo xtask python-package` runs this with the folder of the programs in SONEL_PROGRAMS, `cargo xtask accept python` with SONEL_LONG what takes long.
"""

import json
import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pyfar
import pyrato
import pytest
import scipy.io.wavfile
import scipy.signal
import scipy.special
import sofar
import sonel

ROOT = Path(__file__).resolve().parents[2]
SHOEBOX = ROOT / "scenes/shoebox/scene.toml"
PROGRAMS = Path(os.environ["SONEL_PROGRAMS"])
RATE = 48_000
LONG = pytest.mark.skipif("SONEL_LONG" not in os.environ, reason="long: cargo xtask accept python")
SEATS = {"near": [6.0, 4.0, 1.2], "far": [8.5, 5.5, 2.25]}


def run(name, *words, code=0):
    """Runs a program; returns what it wrote to stdout and stderr."""
    done = subprocess.run([PROGRAMS / name, *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == code, done.stderr
    return done.stdout, done.stderr


@pytest.fixture(scope="module")
def room():
    return sonel.trace(sonel.Scene.load(SHOEBOX), packets=4000)


@pytest.fixture(scope="module")
def response(room):
    return room.render(SEATS, directions=True)


ARRAY = {"right": [0.0, -0.05, 0.0], "left": {"position": [0.0, 0.05, 0.01], "directivity": "cardioid", "aim": [0, 1, 0]}}


def write_head(path, rate, width=0.0):
    """Two cardioids in 26 directions whose delays differ by up to 2/3 ms, written by sofar: pulses, or Gaussian ones of a `width` [s]."""
    azimuths = np.arange(0.0, 360.0, 45.0)
    directions = [(azimuth, elevation) for elevation in (-45.0, 0.0, 45.0) for azimuth in azimuths]
    directions += [(0.0, 90.0), (0.0, -90.0)]
    sofa = sofar.Sofa("SimpleFreeFieldHRIR")
    sofa.SourcePosition = np.array([[azimuth, elevation, 1.5] for azimuth, elevation in directions])
    times = np.arange(round(rate * 64 / RATE)) / rate
    responses = np.zeros((len(directions), 2, len(times)))
    for index, (azimuth, elevation) in enumerate(np.radians(directions)):
        left = np.cos(elevation) * np.sin(azimuth)
        for ear, side in enumerate((left, -left)):
            delay = (32 - round(16 * side)) / RATE
            pulse = np.exp(-0.5 * ((times - delay) / width) ** 2) if width else np.isclose(times, delay)
            responses[index, ear] = (1 + 0.5 * side) * pulse / np.sum(pulse)
    sofa.Data_IR, sofa.Data_SamplingRate, sofa.Data_Delay = responses, float(rate), np.zeros((1, 2))
    sofa.ReceiverPosition = [[0, 0.09, 0], [0, -0.09, 0]]
    sofar.write_sofa(str(path), sofa)
    return path


@pytest.fixture(scope="module")
def head(tmp_path_factory):
    return write_head(tmp_path_factory.mktemp("head") / "head.sofa", RATE)


def write_array(path, head):
    """Four microphones: the ears of a head, and the same the other way round, half a metre farther away by their delay."""
    ears, sofa = sofar.read_sofa(str(head), verbose=False), sofar.Sofa("GeneralFIR")
    sofa.SourcePosition, sofa.SourcePosition_Type, sofa.SourcePosition_Units = ears.SourcePosition, "spherical", "degree, degree, metre"
    sofa.Data_IR = np.concatenate([ears.Data_IR, ears.Data_IR[:, ::-1]], axis=1)
    sofa.Data_SamplingRate, sofa.Data_Delay = ears.Data_SamplingRate, np.array([[0.0, 0.0, 70.0, 70.0]])
    sofa.ReceiverPosition = [[0, 0.09, 0], [0, -0.09, 0], [0, -0.09, 0.1], [0, 0.09, 0.1]]
    sofar.write_sofa(str(path), sofa)
    return path


@pytest.fixture(scope="module")
def aside():
    """Two sources at a receiver that looks at the first one: the second is on its left and above."""
    sources = {"ahead": [2.0, 2.0, 1.2], "aside": [4.0, 6.0, 2.5]}
    scene = sonel.Scene.shoebox([10, 7, 3], 0.3, sources=sources, duration_s=0.2)
    return sonel.trace(scene, packets=100).render([7.0, 2.5, 1.0], directions=True, effects="-boundary")


def direct_sample(response, seat, source=0):
    """Sample of the direct sound."""
    distance = np.linalg.norm(response.receiver_positions[seat] - response.source_positions[source])
    return round(distance / response.speed_of_sound * RATE)


OCTAVES = [1000.0, 2000.0, 4000.0]


def octaves(samples):
    """Squared octaves of a signal, [octave, sample]."""
    limits = (0.9 * OCTAVES[0], 1.1 * OCTAVES[-1])
    filtered = pyfar.dsp.filter.fractional_octave_bands(pyfar.Signal(samples, RATE), 1, frequency_range=limits, order=4)
    assert filtered.cshape == (3, 1)
    return filtered.time[:, 0] ** 2


def decays(energies):
    """Schroeder's integral of each octave, by pyrato."""
    times = np.arange(energies.shape[-1]) / RATE
    return [pyrato.edc.schroeder_integration(pyfar.TimeData(octave, times), is_energy=True) for octave in energies]


# What the filters delay a pulse by [s].
DELAYS = [pyrato.parameters.center_time(decay)[0] for decay in decays(octaves(np.r_[1.0, np.zeros(RATE // 2)]))]


def by_pyrato(energies):
    """T30 [s], C80 [dB], D50 and Ts [s] of squared octaves that begin with the direct sound, [4, octave]; limits are as late as the
    filters make them."""
    found = [
        [
            pyrato.parameters.reverberation_time_linear_regression(decay, "T30"),
            pyrato.parameters.clarity(decay, 80 + 1000 * delay),
            pyrato.parameters.definition(decay, 50 + 1000 * delay),
            pyrato.parameters.center_time(decay) - delay,
        ]
        for decay, delay in zip(decays(energies), DELAYS)
    ]
    return np.reshape(found, (3, 4)).T


def jackknifed(of, energies):
    """What `of` finds in the mean of realisations, and its standard error."""
    count = len(energies)
    without = np.array([of((energies.sum(0) - one) / (count - 1)) for one in energies])
    return of(energies.mean(0)), np.sqrt((count - 1) * without.var(axis=0))


@LONG
def test_pyrato_reads_the_parameters_of_the_response(response):
    """Realisations scatter: their mean lies within four standard errors, and a tenth of a just-noticeable difference (5 % of T, 1 dB of
    C80, 0.05 of D50, 10 ms of Ts) for time bins of 1 ms."""
    start = direct_sample(response, 0)
    realisations = [response.impulse_responses(seed=seed)[0, 0, 0, start:].astype(float) for seed in range(48)]
    energies = np.array([octaves(samples) for samples in realisations])
    found, error = jackknifed(by_pyrato, energies)
    rows = response.parameters()[0, 0]
    rows = rows[np.isin(rows["center_frequency_hz"], OCTAVES)]
    expected = np.array([rows[key] for key in ("t30_s", "clarity_c80_db", "definition_d50", "center_time_s")])
    noticeable = np.array([0.05 * expected[0], np.full(3, 1.0), np.full(3, 0.05), np.full(3, 0.010)])
    print("off by", (found - expected) / noticeable, "just-noticeable differences, standard errors", error / noticeable)
    assert np.all(error < 0.2 * noticeable), "the realisations tell nothing"
    allowed = 4 * error + 0.1 * noticeable
    assert np.all(np.abs(found - expected) < allowed)
    # A decay that is 9 % faster is told from it.
    faster = energies.mean(0) * np.exp(-2.0 * np.arange(energies.shape[-1]) / RATE)
    assert not np.all(np.abs(by_pyrato(faster)[0] - expected[0]) < allowed[0])


def test_pyfar_gets_a_signal(response):
    signal = response.to_pyfar(sample_rate=16_000)
    assert signal.cshape == (1, 2, 1) and signal.sampling_rate == 16_000
    np.testing.assert_array_equal(signal.time, response.impulse_responses(sample_rate=16_000))


def harmonics(order, direction):
    """Real spherical harmonics in ACN order with SN3D, from SciPy's complex ones with their Condon-Shortley phase."""
    x, y, z = direction
    polar, azimuth = np.arccos(z), np.arctan2(y, x)
    channels = []
    for n in range(order + 1):
        for m in range(-n, n + 1):
            value = scipy.special.sph_harm_y(n, abs(m), polar, azimuth) * (-1) ** m * np.sqrt(4 * np.pi / (2 * n + 1))
            part = value.imag if m < 0 else value.real
            channels.append(part * (1 if m == 0 else np.sqrt(2)))
    return np.array(channels)


def test_ambisonics_are_those_of_spaudiopy(aside, monkeypatch):
    """Of spaudiopy's real spherical harmonics of order 7, N3D, over the direction of the source that is aside."""
    spaudiopy = pytest.importorskip("spaudiopy")
    # It calls SciPy's function of before 1.17.
    before = lambda m, n, azimuth, polar: scipy.special.sph_harm_y(n, m, polar, azimuth)  # noqa: E731
    monkeypatch.setattr(scipy.special, "sph_harm", before, raising=False)
    x, y, z = towards(aside, 1)
    orders = np.repeat(np.arange(8), 2 * np.arange(8) + 1)
    expected = spaudiopy.sph.sh_matrix(7, np.arctan2(y, x), np.arccos(z), "real")[0] * np.sqrt(4 * np.pi / (2 * orders + 1))
    pulse = aside.impulse_responses(ambix=7)[1, 0, :, direct_sample(aside, 0, 1)].astype(float)
    np.testing.assert_allclose(pulse / pulse[0], expected, atol=1e-3)


def towards(response, source):
    """Direction of a source at receiver 0 in the axes of the scene."""
    way = response.source_positions[source] - response.receiver_positions[0]
    return way / np.linalg.norm(way)


def in_axes_of_the_head(response, source):
    """Direction of a source in the axes front, left, up of receiver 0 in a scene whose z is up; the receiver looks at source 0."""
    up, (ahead, direction) = np.array([0.0, 0.0, 1.0]), response.source_positions[[0, source]] - response.receiver_positions[0]
    front = ahead * [1, 1, 0] / np.linalg.norm(ahead[:2])
    return np.array([front, np.cross(up, front), up]) @ direction / np.linalg.norm(direction)


@pytest.mark.parametrize("aim", [False, True])
@pytest.mark.parametrize("order", [1, 3, 7])
@pytest.mark.parametrize("source", [0, 1])
def test_ambisonics_of_the_direct_sound_point_to_the_source(aside, order, source, aim):
    at = direct_sample(aside, 0, source)
    pulse = aside.impulse_responses(ambix=order, aim=aim)[source, 0, :, at].astype(float)
    expected = (in_axes_of_the_head if aim else towards)(aside, source)
    w, y, z, x = pulse[:4]
    intensity = w * np.array([x, y, z])
    angle = np.degrees(np.arccos(np.clip(intensity @ expected / np.linalg.norm(intensity), -1, 1)))
    print(f"intensity off by {angle:.4f} degrees")
    assert angle < 0.05
    np.testing.assert_allclose(pulse / pulse[0], harmonics(order, expected), atol=5e-4)
    # Only a source that is looked at is on no side: a decoder that mixed up the sides would look elsewhere.
    mirrored = harmonics(order, expected * [1, -1, 1])
    assert (aim and source == 0) == np.allclose(pulse / pulse[0], mirrored, atol=5e-4)


def azimuth(channels, at):
    """Of the intensity of AmbiX channels at a sample [degrees]."""
    w, y, _, x = channels[:4, at - 8 : at + 9].astype(float)
    return np.degrees(np.arctan2(np.sum(w * y), np.sum(w * x)))


def test_azimuths_of_four_sources_are_those_of_the_scene_in_all_outputs(tmp_path):
    sources = {"back": [1.0, 4.0, 1.5], "left": [5.0, 6.0, 1.5], "right": [4.5, 0.5, 1.5], "far": [9.0, 1.0, 1.5]}
    place = np.array([5.0, 3.5, 1.5])
    scene = sonel.Scene.shoebox([10, 7, 3], 0.6, sources=sources, receivers=place, duration_s=0.1)
    room = sonel.trace(scene, packets=100)
    response = room.render(directions=True)
    true = [np.degrees(np.arctan2(*(np.array(source) - place)[1::-1])) for source in sources.values()]
    assert max(true) > 150 and min(true) < -90
    [shard] = sonel.dataset([scene], tmp_path / "set", ambix=1, sample_rate=RATE, trace={"packets": 100}, render={})
    response.to_sofa(tmp_path / "room.sofa", ambix=1)
    sofa = sofar.read_sofa(str(tmp_path / "room.sofa"), verbose=False)
    np.testing.assert_allclose(np.broadcast_to(sofa.ListenerView, (4, 3)), [[1, 0, 0]] * 4)
    room.save(tmp_path / "room.sonelmap")
    files = ["--wav", tmp_path / "wav", "--ambix", 1]
    run("sonel-render", tmp_path / "room.sonelmap", "-o", tmp_path / "room.npz", "--quiet", *files)
    walked = room.walk([[0.0, *place]], [1.0], ambix=1)
    turned = response.impulse_responses(ambix=1, aim=True)
    for number, (name, expected) in enumerate(zip(sources, true)):
        at = direct_sample(response, 0, number)
        _, samples = scipy.io.wavfile.read(tmp_path / f"wav/{number + 1}-{name}_1-receiver 1_ambix1.wav")
        outputs = [response.impulse_responses(ambix=1)[number, 0], walked[number], np.load(shard)["ir"][number], sofa.Data_IR[number], samples.T]
        for output in outputs:
            assert azimuth(output, at) == pytest.approx(expected, abs=0.5), name
        # Front is where the first source is.
        assert azimuth(turned[number, 0], at) == pytest.approx((expected - true[0] + 180) % 360 - 180, abs=0.5)
    with pytest.raises(sonel.Error, match="aim turns the axes of ambisonics"):
        response.impulse_responses(aim=True)


@pytest.mark.parametrize(("rate", "length"), [(44_100, 256), (96_000, 512)])
def test_a_converted_head_is_silent_behind_its_response(response, tmp_path, rate, length):
    """Pulses in the first ms of responses of 5.8 ms, in a room that returns nothing: no energy later than the response, hardly any before or
    after its pulses."""
    sofa = sofar.read_sofa(str(write_head(tmp_path / "head.sofa", rate, width=10e-6)), verbose=False)
    sofa.Data_IR = np.pad(sofa.Data_IR, ((0, 0), (0, 0), (0, length - sofa.Data_IR.shape[-1])))
    sofar.write_sofa(str(tmp_path / "head.sofa"), sofa)
    scene = sonel.Scene.shoebox([20, 20, 20], 1.0, sources=[10, 14, 10], receivers=[10, 10, 10], duration_s=0.1)
    free = sonel.trace(scene, packets=50).render(directions=True)
    at = direct_sample(free, 0)
    for ear in free.impulse_responses(hrtf=tmp_path / "head.sofa")[0, 0].astype(float) ** 2:
        assert ear[at + round(0.003 * RATE) :].sum() < 1e-4 * ear.sum()
        assert ear[: at + 20].sum() < 0.02 * ear.sum()


def test_a_measured_array_has_a_channel_for_each_microphone(response, tmp_path):
    """The first two microphones are those of the head, the others its ears exchanged and 70 samples later."""
    head = write_head(tmp_path / "head.sofa", RATE, width=60e-6)
    array = write_array(tmp_path / "array.sofa", head)
    ears, all_four = (response.impulse_responses(hrtf=file) for file in (head, array))
    assert all_four.shape[2] == 4
    level = np.abs(ears).max()
    np.testing.assert_allclose(all_four[:, :, :2], ears, atol=1e-4 * level)
    np.testing.assert_allclose(all_four[:, :, 2:, 70:], ears[:, :, ::-1, :-70], atol=1e-4 * level)
    assert np.abs(all_four[:, :, 2:, 70:] - ears[:, :, :, :-70]).max() > 0.1 * level
    response.to_sofa(tmp_path / "room.sofa", hrtf=array)
    written = sofar.read_sofa(str(tmp_path / "room.sofa"), verbose=False)
    np.testing.assert_allclose(written.ReceiverPosition.reshape(4, 3), [[0, 0.09, 0], [0, -0.09, 0], [0, -0.09, 0.1], [0, 0.09, 0.1]])
    with pytest.raises(sonel.Error, match="the convention SingleRoomSRIR; give a SOFA file of the convention SimpleFreeFieldHRIR or GeneralFIR"):
        response.impulse_responses(hrtf=tmp_path / "room.sofa")


def on_a_rigid_sphere(mu, cosine):
    """Pressure over that of the free wave at the centre, by SciPy's Bessel functions and Legendre polynomials."""
    m = np.arange(40)[:, None]
    slope = scipy.special.spherical_jn(m, mu, derivative=True) + 1j * scipy.special.spherical_yn(m, mu, derivative=True)
    return (1j ** (m + 1) * (2 * m + 1) * scipy.special.eval_legendre(m, -cosine) / (slope * mu**2)).sum(axis=0)


def test_microphones_on_a_rigid_sphere_have_its_pressure(tmp_path):
    """Level and phase against one another, in a room that returns nothing; those of the open array are elsewhere."""
    angles = np.radians([0.0, 45.0, 90.0, 135.0])
    places = 0.042 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    file = sonel.rigid_sphere(tmp_path / "array.sofa", places)
    scene = sonel.Scene.shoebox([20, 20, 20], 1.0, sources=[14, 10, 10], receivers=[10, 10, 10], duration_s=0.1)
    free = sonel.trace(scene, packets=50).render(directions=True)
    spectra = np.fft.rfft(free.impulse_responses(hrtf=file)[0, 0], axis=-1)
    frequencies = np.fft.rfftfreq(free.impulse_responses(hrtf=file).shape[-1], 1 / RATE)
    heard = (frequencies > 300) & (frequencies < 12_000)
    mu = 2 * np.pi * frequencies[heard] * 0.042 / 343
    expected = np.array([on_a_rigid_sphere(mu, cosine) for cosine in np.cos(angles)])
    ratio = spectra[1:, heard] / spectra[0, heard] / np.conj(expected[1:] / expected[0])
    assert np.abs(ratio - 1).max() < 0.06
    open_array = np.fft.rfft(free.impulse_responses(array=places)[0, 0], axis=-1)[:, heard]
    assert np.abs(np.abs(open_array[3] / open_array[0]) - np.abs(expected[3] / expected[0])).max() > 0.3
    for wrong, message in [([[0.1, 0, 0], [0.2, 0, 0]], "one distance"), ([[0.0, 0, 0]], "one distance"), ([1.0], "shape")]:
        with pytest.raises(sonel.Error, match=message):
            sonel.rigid_sphere(tmp_path / "other.sofa", wrong)
    with pytest.raises(sonel.Error, match="exists"):
        sonel.rigid_sphere(file, places)


def test_a_head_with_one_view_is_read_and_one_that_turns_is_refused(response, head, tmp_path):
    def heard(change):
        sofa = sofar.read_sofa(str(head), verbose=False)
        change(sofa, len(sofa.SourcePosition))
        sofar.write_sofa(str(tmp_path / "changed.sofa"), sofa)
        return response.impulse_responses(hrtf=tmp_path / "changed.sofa")

    def views(*rows):
        def change(sofa, count):
            sofa.ListenerView, sofa.ListenerUp = np.resize(rows, (count, 3)), np.resize([0.0, 0.0, 1.0], (count, 3))

        return change

    np.testing.assert_array_equal(heard(views([1.0, 0.0, 0.0])), response.impulse_responses(hrtf=head))
    with pytest.raises(sonel.Error, match="the listener turns between measurements"):
        heard(views([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]))
    with pytest.raises(sonel.Error, match="SourcePosition has 1 rows, Data.IR 26"):
        heard(lambda sofa, _: setattr(sofa, "SourcePosition", sofa.SourcePosition[:1]))


def test_microphones_are_where_sound_is(tmp_path):
    """A microphone behind a screen, in a box or outside is named with its place, the body and a free place; what is stored refuses it, too."""
    scene = sonel.Scene.shoebox([6, 5, 3], {"walls": 0.2}, sources=[1, 1, 1.5], receivers={"seat": [3.0, 2.5, 1.2]}, duration_s=0.1)
    scene = scene.add_box([3.4, 2.2, 0], [3.6, 2.8, 2.0], {"absorption": 0.5})
    room = sonel.trace(scene, packets=100)
    response = room.render(directions=True)
    response.save(tmp_path / "room.npz")
    loaded = sonel.Response.load(tmp_path / "room.npz")
    for x in (0.5, 0.7):
        for work in (
            lambda array: response.impulse_responses(array=array),
            lambda array: loaded.impulse_responses(array=array),
            lambda array: room.walk([[0, 3.0, 2.5, 1.2]], [1.0], array=array),
            lambda array: response.to_sofa(tmp_path / "room.sofa", array=array),
            lambda array: sonel.dataset([scene], tmp_path / f"set {x}", microphones=array, trace={"packets": 100}, render={}, progress=False),
        ):
            with pytest.raises(sonel.Error, match=rf'"microphone 2" is at \[{3 + x}, 2.5, 1.2\] m.*"(seat|0.000 m)".*"object 1".*\[3.360, 2.500, 1.200\] m is free'):
                work([[0.1, 0, 0], [x, 0, 0]])
    assert response.impulse_responses(array=[[0.1, 0, 0], [0.36, 0, 0]]).shape[2] == 2


def test_what_is_kept_within_a_time_ends_there(response):
    everything = response.impulse_responses()[0, 0, 0].astype(float)
    direct, early = (response.impulse_responses(within=time)[0, 0, 0].astype(float) for time in (0, 0.05))
    at = direct_sample(response, 0)
    end = at + round(0.05 * RATE)
    # A pulse between samples has 32 on either side; filters of bands ring faintly beyond.
    np.testing.assert_allclose(early[at : end - 64], everything[at : end - 64], atol=0.01 * everything.max())
    assert np.sum(early[end + 64 :] ** 2) < 1e-4 * np.sum(everything[end + 64 :] ** 2)
    assert np.sum(direct[at + 64 :] ** 2) < 1e-3 * np.sum(direct**2) < 0.5 * np.sum(early**2)
    assert direct[at] == pytest.approx(everything[at], rel=0.02)


@pytest.mark.parametrize("rate", [16_000, 48_000])
def test_the_tail_is_gaussian_and_0_hz_alone_is_loud(rate):
    """Excess kurtosis over its envelope: a Gaussian tail has 0, with a standard deviation of 0.04, one pulse for every third sample 2, as before the
    room is mixed. Echo density (Abel and Huang 2006), samples beyond one standard deviation over the 31.7 % of Gauss: 1. Arrivals of one sign add up
    below 10 Hz alone: at 20 ... 40 Hz there is no more than in mid bands, in mean squares of one response 2 dB."""
    scene = sonel.Scene.shoebox([7, 5.5, 3], {"absorption": 0.15, "scattering": 0.5}, sources=[2, 2, 1.5])
    response = sonel.trace(scene, packets=4000).render([5, 4, 1.2], rays=512)
    window = np.hanning(rate // 50)

    def shape(samples):
        level = (samples / np.sqrt(np.convolve(samples**2, window / window.sum(), "same")))[len(window) : -len(window)]
        return np.mean(level**4) / np.mean(level**2) ** 2 - 3, np.mean(np.abs(level) > 1) / 0.3173

    responses = [response.impulse_responses(sample_rate=rate, seed=seed)[0, 0, 0].astype(float) for seed in range(4)]
    kurtosis, density = np.mean([shape(samples[round(0.15 * rate) : round(0.6 * rate)]) for samples in responses], axis=0)
    early, sparse = np.mean([shape(samples[round(0.02 * rate) : round(0.08 * rate)]) for samples in responses], axis=0)
    print(f"kurtosis {early:.2f}, later {kurtosis:.3f}; echo density {sparse:.2f}, later {density:.3f}")
    assert abs(kurtosis) < 0.15 < early - 0.3 and abs(density - 1) < 0.02 < 1 - sparse
    samples = responses[-1]
    spectrum, frequencies = np.abs(np.fft.rfft(samples)) ** 2, np.fft.rfftfreq(len(samples), 1 / rate)
    low, middle = (np.mean(spectrum[(frequencies > first) & (frequencies < last)]) for first, last in ((20, 40), (300, 3000)))
    assert low < 2 * middle and spectrum[0] < 10 * middle


def test_an_array_has_the_early_sound_of_receivers_in_its_places(room):
    """Of direct sound and reflections: exact to 10⁻³ of the energy of 20 ms, while the receiver in the middle is far from it."""
    offsets = np.array([[0.08, 0.0, 0.0], [0.0, -0.15, 0.05]])
    middle = np.array(SEATS["near"])
    early = slice(0, round(0.03 * RATE))
    found = room.render(middle).impulse_responses(array=offsets)[0, 0, :, early].astype(float)
    places = room.render([middle, *(middle + offsets)]).impulse_responses()[0, :, 0, early].astype(float)
    sums = np.sum(places[1:] ** 2, axis=1)
    off = np.sum((found - places[1:]) ** 2, axis=1) / sums
    print("off by", off)
    assert np.all(off < 0.02)
    assert np.all(np.sum((places[0] - places[1:]) ** 2, axis=1) > 0.5 * sums)


def test_a_figure_of_eight_has_the_sign_of_the_side(aside):
    """Direct sound of the two sources, one of which it looks at, the other of which is behind; on the axis it is that of a point."""
    ahead = aside.source_positions[0] - aside.receiver_positions[0]
    eight = {"position": [0, 0, 0], "directivity": "figure-eight", "aim": ahead}
    back = {**eight, "aim": -(aside.source_positions[1] - aside.receiver_positions[0])}
    single = aside.impulse_responses()[:, 0, 0]
    found = aside.impulse_responses(array={"eight": eight, "back": back})[:, 0]
    for source in (0, 1):
        at = direct_sample(aside, 0, source)
        assert found[source, source, at] / single[source, at] == pytest.approx((1, -1)[source], abs=1e-3)


def test_arrays_are_those_of_the_program(room, response, tmp_path):
    room.save(tmp_path / "room.sonelmap")
    rows = [f'[[receivers]]\nname = "{name}"\n' for name in ARRAY]
    rows[0] += "position = [0.0, -0.05, 0.0]\n"
    rows[1] += 'position = [0.0, 0.05, 0.01]\ndirectivity = "cardioid"\naim = [0.0, 1.0, 0.0]\n'
    (tmp_path / "array.toml").write_text("".join(rows))
    seats = [f"--receiver={name}={x},{y},{z}" for name, (x, y, z) in SEATS.items()]
    files = ["--wav", tmp_path / "wav", "--array", tmp_path / "array.toml"]
    run("sonel-render", tmp_path / "room.sonelmap", "-o", tmp_path / "room.npz", "--quiet", *seats, *files)
    _, samples = scipy.io.wavfile.read(tmp_path / "wav/1-source_2-far_array.wav")
    np.testing.assert_array_equal(samples.T, response.impulse_responses(array=ARRAY)[0, 1])


def test_a_walk_is_that_of_the_program_and_shifts_a_tone(tmp_path, head):
    """In a room that absorbs nearly everything: towards the source at 5 m/s a tone of 1 kHz rises by 14.6 Hz."""
    scene = sonel.Scene.shoebox([20, 6, 4], 0.99, sources=[1, 3, 2], duration_s=0.2)
    room = sonel.trace(scene, packets=100)
    rate, speed = 16_000, 5.0
    path = [[1.0, 9.0, 3.0, 2.0], [1.4, 9.0 - 0.4 * speed, 3.0, 2.0]]
    signal = np.sin(2 * np.pi * 1000 * np.arange(2 * rate // 5) / rate).astype(np.float32)
    walked = room.walk(path, signal, sample_rate=rate)
    assert walked.shape == (1, 1, len(signal) + round(0.2 * rate))
    steady = walked[0, 0, 1500:6000].astype(float)
    spectrum = np.abs(np.fft.rfft(steady * np.hanning(len(steady)), 1 << 20))
    assert np.argmax(spectrum) * rate / (1 << 20) == pytest.approx(1000 * (1 + speed / room.render([9, 3, 2]).speed_of_sound), abs=0.3)
    path, signal = [[0.0, 9.0, 3.0, 2.0], [0.2, 8.0, 3.0, 2.0]], signal[: rate // 5]
    room.save(tmp_path / "room.sonelmap")
    (tmp_path / "walk.csv").write_text("time,x,y,z\n" + "".join(",".join(map(str, row)) + "\n" for row in path))
    scipy.io.wavfile.write(tmp_path / "dry.wav", rate, signal)
    options = ["--path", tmp_path / "walk.csv", "--recording", tmp_path / "dry.wav", "--wav", tmp_path / "wav", "--wav-rate", rate]
    run("sonel-render", tmp_path / "room.sonelmap", "-o", tmp_path / "room.npz", "--quiet", *options, "--ambix", 1, "--hrtf", head)
    for name, channels in (("ambix1", {"ambix": 1}), ("binaural", {"hrtf": head})):
        _, samples = scipy.io.wavfile.read(tmp_path / f"wav/1-source 1_walk_{name}.wav")
        np.testing.assert_array_equal(samples.T, room.walk(path, signal, sample_rate=rate, **channels)[0])
    for bad, message in [
        ({"path": [[0, 1, 2]]}, "path has the shape"),
        ({"path": [[0, 9, 3, 2], [0, 8, 3, 2]]}, "point 2 has the time 0 s after 0 s"),
        ({"path": [[0, 30, 3, 2]]}, "outside"),
        ({"signal": np.ones((2, 9))}, "signal has the shape"),
        ({"spacing": 0}, "`spacing` is 0 m"),
        ({"hrtf": tmp_path / "none.sofa"}, "cannot read"),
        ({"hrtf": head, "ambix": 1}, "exclude each other"),
        ({"hrtf": head, "aim": [1, 0]}, "a direction, shape"),
        ({"aim": [1, 0, 0]}, "aim turns the head of hrtf"),
    ]:
        with pytest.raises(sonel.Error, match=message):
            room.walk(**{"path": path, "signal": signal, **bad})


@pytest.mark.parametrize("listener", ["array", "head"])
def test_who_stands_hears_what_a_creeping_listener_hears(head, listener):
    """Standing is a convolution, creeping by 20 µm is read between samples, which is flat up to 0.9 of the Nyquist frequency: of image sources, late
    sound would be that of another place."""
    walls = {"absorption": 0.9, "scattering": 0.0}
    room = sonel.trace(sonel.Scene.shoebox([6, 5, 3], walls, sources=[1, 3, 2], duration_s=0.2), packets=100)
    below = scipy.signal.cheby2(10, 60, 0.87, output="sos")
    signal = scipy.signal.sosfiltfilt(below, np.random.default_rng(1).standard_normal(2000))

    def heard(end, creep):
        path = [[0.0, 4.0, 3.0, 1.5], [0.03, end, 3.0, 1.5], [0.25, end + creep, 3.0, 1.5]]
        channels = {"array": ARRAY} if listener == "array" else {"hrtf": head, "aim": [1, 0, 0]}
        return room.walk(path, signal, sample_rate=16_000, **channels)[0].astype(float)

    standing, creeping, elsewhere = heard(3.905, 0), heard(3.905, 2e-5), heard(3.915, 0)
    assert np.std(standing - creeping) < 0.002 * np.std(standing) < 0.1 * np.std(standing - elsewhere)


def levels(samples, parts):
    """Energy of each of so many parts of equal length, [channel, part]."""
    return np.sum(samples[:, : samples.shape[1] // parts * parts].reshape(len(samples), parts, -1) ** 2, axis=-1)


@pytest.mark.parametrize("aim", [None, [0.0, 1.0, 0.0]])
def test_a_head_that_stands_hears_its_impulse_response(head, aim):
    """The signal convolved with it, at both ears, also where it looks elsewhere; to 10⁻⁵ of the energy, and with the ears exchanged not."""
    walls = {"absorption": 0.3, "scattering": 0.5}
    room = sonel.trace(sonel.Scene.shoebox([6, 5, 3], walls, sources=[[3, 4, 2], [1, 1, 1.5]], duration_s=0.3), packets=1000)
    rate, place = 16_000, [4.0, 2.0, 1.5]
    signal = np.random.default_rng(2).standard_normal(4000)
    looking = {} if aim is None else {"aim": aim}
    walked = room.walk([[0.0, *place]], signal, sample_rate=rate, hrtf=head, **looking).astype(float)
    seat = {"seat": {"position": place, **looking}}
    responses = room.render(seat, directions=True).impulse_responses(sample_rate=rate, hrtf=head)[:, 0]
    assert walked.shape == (2, 2, 4000 + responses.shape[-1] - 1)
    for heard, ears in zip(walked, responses):
        expected = scipy.signal.fftconvolve(ears.astype(float), signal[None], axes=1)
        assert np.sum((heard - expected) ** 2) < 1e-5 * np.sum(expected**2)
        assert np.sum((heard[::-1] - expected) ** 2) > 0.01 * np.sum(expected**2)


def test_who_walks_past_a_source_hears_it_change_sides(head):
    """The cardioids differ by 9.5 dB where a source is beside the head; a head that turns to the source hears it in front all along."""
    scene = sonel.Scene.shoebox([12, 8, 4], {"absorption": 0.99, "scattering": 0.0}, sources=[6, 5, 1.5], duration_s=0.1)
    room, rate = sonel.trace(scene, packets=200), 16_000
    signal = np.random.default_rng(3).standard_normal(rate)
    path = [[0.0, 2.0, 4.0, 1.5], [1.0, 10.0, 4.0, 1.5]]
    few = {"sample_rate": rate, "hrtf": head, "order": 0, "rays": 64, "effects": "-diffraction"}
    left, right = levels(room.walk(path, signal, aim=[0, 1, 0], **few)[0].astype(float)[:, :rate], 8)
    differences = 10 * np.log10(left / right)
    print("left over right", np.round(differences, 1))
    assert np.all(differences[:2] < -7) and np.all(differences[-2:] > 7) and np.all(np.diff(differences)[2:5] > 3)
    left, right = levels(room.walk(path, signal, **few)[0].astype(float)[:, :rate], 8)
    assert np.all(np.abs(10 * np.log10(left / right)) < 1)


def test_a_source_moves_by_reciprocity():
    """The path of a source in a scene whose sources are the microphones: late sound at microphones d apart has the coherence sin(kd)/kd, as
    receivers have; 400 values of the band from 400 to 600 Hz spread by 0.05, and at 0.6 m it is near 0."""
    places = np.array([[4.0, 3.0, 1.5], [4.02, 3.0, 1.5], [4.6, 3.0, 1.5]])
    walls = {"absorption": 0.1, "scattering": 0.5}
    scene = sonel.Scene.shoebox([7, 5, 3], walls, sources=[2.0, 1.5, 1.2], duration_s=0.6)
    response = sonel.trace(scene.with_sources(places), packets=2000).render(scene.sources, rays=256)
    spectra = np.concatenate([
        np.fft.rfft(response.impulse_responses(sample_rate=8000, seed=seed)[:, 0, 0, 1200:4000], axis=-1)[:, 140:210] for seed in range(8)
    ], axis=1)
    product = np.real(spectra[0] * np.conj(spectra)).sum(axis=1)
    coherence = product / np.sqrt(np.sum(np.abs(spectra[0]) ** 2) * np.sum(np.abs(spectra) ** 2, axis=1))
    expected = np.sinc(2 * 500 * np.array([0.0, 0.02, 0.6]) / response.speed_of_sound)
    print("coherence", coherence, "expected", expected)
    np.testing.assert_allclose(coherence, expected, atol=0.15)
    assert coherence[1] > 0.9


@LONG
def test_the_documented_moving_source_is_heard_by_all_microphones():
    text = (Path(__file__).parents[2] / "docs" / "python.md").read_text(encoding="utf-8")
    [documented] = re.findall(r"```python\n(for room in sonel\.random_rooms.*?)```", text, re.DOTALL)
    speech, circle = np.random.default_rng(2).standard_normal(1600), np.array([[0.05, 0, 0], [-0.05, 0, 0]])
    names = {"sonel": sonel, "speech": speech, "circle": circle}
    exec(documented.replace("random_rooms(50", "random_rooms(1"), names)
    heard = names["heard"]
    assert heard.shape[0] == 2 and heard.shape[1] > 1600 and np.all(np.sum(heard.astype(float) ** 2, axis=1) > 0)


def iacc(left, right, octave):
    """IACC of annex B by definition: octave by a Butterworth band pass of pyfar, sums over the samples."""
    edges = (octave / np.sqrt(2), octave * np.sqrt(2))
    silence = np.zeros(RATE // 2)
    ears = [
        pyfar.dsp.filter.butterworth(pyfar.Signal(np.r_[ear, silence], RATE), 3, edges, "bandpass").time[0]
        for ear in (left, right)
    ]
    energy = np.sqrt(np.prod([np.sum(ear**2) for ear in ears]))
    lags = range(-RATE // 1000, RATE // 1000 + 1)
    return max(abs(np.sum(ears[0] * np.roll(ears[1], lag))) for lag in lags) / energy


def test_binaural_responses_and_iacc_are_those_of_the_programs_and_of_the_definition(room, response, head, tmp_path):
    room.save(tmp_path / "room.sonelmap")
    seats = [f"--receiver={name}={x},{y},{z}" for name, (x, y, z) in SEATS.items()]
    files = ["--wav", tmp_path / "wav", "--hrtf", head]
    run("sonel-render", tmp_path / "room.sonelmap", "-o", tmp_path / "room.npz", "--quiet", *seats, *files)
    path = tmp_path / "wav/1-source_1-near_binaural.wav"
    rate, samples = scipy.io.wavfile.read(path)
    ears = response.impulse_responses(hrtf=head)[0, 0]
    assert rate == RATE and samples.dtype == np.float32
    np.testing.assert_array_equal(samples.T, ears)
    single, at = response.impulse_responses()[0, 0, 0], direct_sample(response, 0)
    # The receiver looks at the source as far as that is to the front: both ears alike, 32 samples late.
    np.testing.assert_allclose(ears[:, at + 32], single[at], rtol=1e-3)
    printed, _ = run("sonel-analyze", "iacc", path, "--json")
    found = json.loads(printed)["recordings"][0]
    onset = round(found["onset_s"] * RATE)
    # Lobes of a pulse between samples are within 20 dB of it for three samples.
    assert at + 32 - 3 <= onset <= at + 32
    windows = {"early": slice(onset, onset + 3840), "late": slice(onset + 3840, None), "all": slice(onset, None)}
    for band in found["bands"][1:5]:
        for name, window in windows.items():
            expected = iacc(*ears[:, window].astype(float), band["center_frequency_hz"])
            assert band[name]["value"] == pytest.approx(expected, abs=0.01), (band, name)
    _, said = run("sonel-analyze", "iacc", tmp_path / "wav/1-source_1-near.wav", code=2)
    assert "channels of the recording: 1" in said and "two ears" in said


@pytest.mark.parametrize(("rate", "off"), [(32_000, 1e-4), (44_100, 0.12), (96_000, 1e-4)])
def test_a_head_of_another_sample_rate_is_converted(response, tmp_path, rate, off):
    """Gaussian pulses of 60 µs are the same at all rates. 44.1 kHz come in time to half a sample, which changes one by
    e^(−½)/(2 · 48 kHz · 60 µs) = 0.105 of its peak."""
    heads = [write_head(tmp_path / f"{each}.sofa", each, width=60e-6) for each in (RATE, rate)]
    same, found = (response.impulse_responses(hrtf=head).astype(float) for head in heads)
    assert np.abs(found - same).max() < off * np.abs(same).max()
    assert np.sum(found**2) == pytest.approx(np.sum(same**2), rel=0.01)


def test_another_sample_rate_has_the_same_spectrum(response):
    """Without a factor, below half of both rates."""
    spectra = {}
    for rate in (16_000, RATE):
        samples = response.impulse_responses(sample_rate=rate)[0, 0, 0].astype(float)
        frequencies = np.array([120.0, 500.0, 2100.0, 6500.0])
        spectra[rate] = np.exp(-2j * np.pi * np.outer(frequencies, np.arange(len(samples))) / rate) @ samples
    np.testing.assert_allclose(spectra[16_000], spectra[RATE], rtol=0.02)


@pytest.mark.parametrize("kind", ["single", "binaural", "ambix", "aimed", "array"])
def test_sofar_verifies_what_is_written_and_reads_the_same_samples(response, head, tmp_path, kind):
    aimed = {"ambix": 1, "aim": True}
    options = {"single": {}, "binaural": {"hrtf": head}, "ambix": {"ambix": 1}, "aimed": aimed, "array": {"array": ARRAY}}[kind]
    path = tmp_path / "room.sofa"
    response.to_sofa(path, **options)
    sofa = sofar.read_sofa(str(path), verify=False, verbose=False)
    assert sofa.verify(issue_handling="return") is None
    assert sofa.GLOBAL_SOFAConventions == "SingleRoomSRIR"
    samples = response.impulse_responses(**options)
    np.testing.assert_array_equal(sofa.Data_IR, samples[0].reshape(2, *samples.shape[2:]))
    np.testing.assert_array_equal(sofa.ListenerPosition, response.receiver_positions)
    np.testing.assert_array_equal(np.atleast_2d(sofa.SourcePosition)[0], response.source_positions[0])
    # Heads and what is aimed look towards the first source, horizontally; all else has the axes of the scene.
    view = response.source_positions[0] - response.receiver_positions
    view[:, 2] = 0
    if kind not in ("binaural", "aimed"):
        view[:] = [1, 0, 0]
    if kind == "array":
        np.testing.assert_array_equal(np.reshape(sofa.ReceiverPosition, (2, 3)), [ARRAY["right"], ARRAY["left"]["position"]])
    np.testing.assert_allclose(sofa.ListenerView + 0 * view, view / np.linalg.norm(view, axis=1, keepdims=True), atol=1e-9)
    assert sofa.RoomVolume == pytest.approx(210.0)
    with pytest.raises(sonel.Error, match="exists"):
        response.to_sofa(path)


def test_what_makes_no_sound_is_named(room, response, head, tmp_path):
    response.save(tmp_path / "room.npz")
    loaded = sonel.Response.load(tmp_path / "room.npz")
    bare = room.render(SEATS["near"])
    (tmp_path / "text.sofa").write_text("no head")
    for work, message in [
        (lambda: bare.impulse_responses(ambix=1), "`directions`"),
        (lambda: bare.impulse_responses(hrtf=head), "`directions`"),
        (lambda: response.impulse_responses(ambix=8), "from 1 to 7"),
        (lambda: response.impulse_responses(seed=-1), "seed is -1"),
        (lambda: response.impulse_responses(ambix=1, array=ARRAY), "ambix and array exclude each other"),
        (lambda: bare.impulse_responses(array=ARRAY), "`directions`"),
        (lambda: bare.impulse_responses(array=[[0, 0, 1.5]]), "\"microphone 1\" is 1.5 m from its receiver; at most 1 m"),
        (lambda: bare.impulse_responses(array=[[0, 0, 1, 5]]), "microphones are not positions"),
        (lambda: response.impulse_responses(ambix=1, hrtf=head), "exclude each other"),
        (lambda: response.impulse_responses(sample_rate=7999), "from 8000 to 192000 Hz"),
        (lambda: response.impulse_responses(hrtf=tmp_path / "none.sofa"), "cannot read"),
        (lambda: response.impulse_responses(hrtf=tmp_path / "text.sofa"), "SimpleFreeFieldHRIR"),
        (lambda: response.impulse_responses(hrtf="/dev/zero"), "/dev/zero: not a regular file"),
        (lambda: response.impulse_responses(hrtf=tmp_path), "not a regular file"),
        (lambda: bare.to_sofa(tmp_path / "room.hdf5"), "does not end in .sofa"),
    ]:
        with pytest.raises(sonel.Error, match=message):
            work()
    for options in [{}, {"ambix": 1}, {"hrtf": head}]:
        np.testing.assert_array_equal(loaded.impulse_responses(**options), response.impulse_responses(**options))
    assert bare.impulse_responses(seed=1).shape == bare.impulse_responses(seed=2).shape
    assert not np.array_equal(bare.impulse_responses(seed=1), bare.impulse_responses(seed=2))
