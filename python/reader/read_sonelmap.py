"""A reader of sonel maps that knows nothing but docs/formats/sonelmap.md; needs numpy only.

As a program it recomputes, in an empty shoebox, what reaches a receiver by connections from all sonels (docs/physics.md §4,
class "... D R"), and prints the sum over time per source and band as JSON:

    python read_sonelmap.py room.sonelmap --receiver 3.0,3.6,1.1
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

SPECULAR, DIFFUSE, TRANSMITTED, REFRACTED = range(4)
DIFFRACTED, RETURNED = 6, 7
EMERGED, SPLIT = 14, 15
ABSORBED, ESCAPED, EXPIRED, LOST, LEFT = 8, 9, 10, 12, 13

SURFACE = np.dtype([("material", "<u4"), ("closed", "<u4"), ("normal", "<f8", 3), ("offset", "<f8"), ("area", "<f8")])
CHUNK = np.dtype([("source", "<u4"), ("paths", "<u4"), ("first_emission", "<u8"), ("vertices", "<u8"),
                  ("offset", "<u8"), ("digest", "V32")])
VERTEX = np.dtype([("position", "<f4", 3), ("tag", "<u4")])

# The header's records: fields in order. A one-element list means "list of", a pair "array of fixed length".
SETTINGS = {"emissions": "<u8", "seed": "<u8", "batches": "<u4", "spectral": "<u4", "mode": "<u4", "shard_index": "<u4",
            "shard_count": "<u4", "chunk_emissions": "<u8", "survival": "<f8"}
EFFECT = {"name": "text", "on": ["<u1"], "reason": "text"}
MATERIAL = {"name": "text", "absorption": ["<f8"], "scattering": ["<f8"], "transmission": ["<f8"], "source": "text"}
SOURCE = {"name": "text", "position": ("<f8", 3), "power_level_db": ["<f8"], "directivity": "text", "aim": ("<f8", 3)}
RECEIVER = {"name": "text", "position": ("<f8", 3), "aim": ("<f8", 3)}
SCENE = {"name": "text", "up": ("<f8", 3), "third_octaves": "<u1", "nominal_frequencies": ["<f8"],
         "temperature_celsius": "<f8", "relative_humidity_percent": "<f8", "pressure_kpa": "<f8",
         "speed_of_sound": "<f8", "air_attenuation": ["<f8"], "duration": "<f8", "scene_digest": ("<u1", 32),
         "mesh_digest": ("<u1", 32), "materials": [MATERIAL], "sources": [SOURCE], "receivers": [RECEIVER]}
REGION = {"name": "text", "inside": ("<f8", 3), "temperature_celsius": "<f8", "relative_humidity_percent": "<f8",
          "pressure_kpa": "<f8", "speed_of_sound": "<f8", "density": "<f8", "air_attenuation": ["<f8"]}
REGIONS = {"regions": [REGION], "interfaces": ["<u4"], "at_sources": ["<u4"], "sides": [("<u4", 2)]}
ROLL = {"balloon": "<u4", "up": ("<f8", 3)}
BALLOON = {"name": "text", "azimuths": "<u4", "polars": "<u4", "factors": ["<f8"]}
VARIANT = {"material": "<u4", **MATERIAL}
VARIANTS = {"variants": [VARIANT]}
DESIGNS = {"designs": [{"name": "text", "choices": [("<u4", 2)]}]}
DIRECTIVITY = {"balloons": [BALLOON], "sources": [ROLL], "receivers": ["text"]}
SECTION = {"name": "text", "offset": "<u8", "length": "<u8", "digest": ("<u1", 32)}
HEADER = {"tool_version": "text", "settings": SETTINGS, "effects": [EFFECT], "scene": SCENE, "center": ("<f8", 3),
          "chunk_count": "<u8", "sections": [SECTION]}


class Record:
    """Reads the header from front to back."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, kind):
        if isinstance(kind, dict):
            return {name: self.take(field) for name, field in kind.items()}
        if isinstance(kind, tuple):
            return self.numbers(*kind)
        if kind == "text":
            return self.numbers("<u1", self.take("<u8")).tobytes().decode("utf-8")
        if isinstance(kind, list):
            count = self.take("<u8")
            return self.numbers(kind[0], count) if isinstance(kind[0], str) and kind[0] != "text" else [self.take(kind[0]) for _ in range(count)]
        return self.numbers(kind, 1)[0].item()

    def numbers(self, dtype, count):
        start, self.at = self.at, self.at + np.dtype(dtype).itemsize * count
        if self.at > len(self.data):
            raise ValueError("the header ends too early")
        return np.frombuffer(self.data, dtype, count, start)


GRADIENT = "sound_speed_gradient"


class SonelMap:
    """The file, mapped into memory: `header` is a dictionary, `surfaces` and `chunks` are structured arrays."""

    def __init__(self, path):
        self.file = np.memmap(path, np.uint8, "r")
        start = self.file[:64].tobytes()
        if start[:8] != b"SONELMAP":
            raise ValueError("not a sonel map")
        major, minor = np.frombuffer(start, "<u2", 2, 8)
        if major != 1:
            raise ValueError(f"format version {major}.{minor} is unknown, this reads 1.x")
        offset, length = (int(number) for number in np.frombuffer(start, "<u8", 2, 16))
        if offset == 0:
            raise ValueError("the map was never completed")
        if offset + length != len(self.file):
            raise ValueError("the file does not end with its header")
        self.header = Record(self.file[offset:].tobytes()).take(HEADER)
        self.sections = {section["name"]: section for section in self.header["sections"]}
        self.surfaces = self.section("surfaces", SURFACE)
        self.chunks = self.section("chunks", CHUNK)
        self.directivity = None
        if "directivity" in self.sections:
            self.directivity = Record(self.section("directivity", "<u1").tobytes()).take(DIRECTIVITY)
        self.airs = Record(self.section("regions", "<u1").tobytes()).take(REGIONS) if "regions" in self.sections else None
        variants = Record(self.section("variants", "<u1").tobytes()).take(VARIANTS)["variants"] if "variants" in self.sections else []
        self.kinds = [[material, *(variant for variant in variants if variant["material"] == number)]
                      for number, material in enumerate(self.header["scene"]["materials"])]
        self.designs = Record(self.section("designs", "<u1").tobytes()).take(DESIGNS)["designs"] if "designs" in self.sections else []
        uniform = np.zeros(len(self.header["scene"]["materials"]), np.uint8)
        self.laws = self.section("absorption.laws", "<u1") if "absorption.laws" in self.sections else uniform
        self.gradient = float(self.section(GRADIENT, "<f8")[0]) if GRADIENT in self.sections else 0.0

    def section(self, name, dtype):
        """The rows of a section."""
        section = self.sections[name]
        return self.part(section["offset"], section["length"], dtype)

    def part(self, offset, length, dtype):
        if offset + length > len(self.file):
            raise ValueError("a part lies outside the file")
        return self.file[offset:offset + length].view(dtype)

    def paths(self, source):
        """(emission, vertices) of every path of a source, in emission order."""
        for chunk in self.chunks[self.chunks["source"] == source]:
            offset, count = int(chunk["offset"]), int(chunk["paths"])
            ends = self.part(offset, 4 * count, "<u4")
            vertices = self.part(offset + -(-4 * count // 64) * 64, 16 * int(chunk["vertices"]), VERTEX)
            for index, end in enumerate(ends):
                yield int(chunk["first_emission"]) + index, vertices[ends[index - 1] if index else 0:end]


def packets(vertices):
    """The packets that a path's becomes: vertices of each from the source on, its part of the energy on the way to each, number of the first of its own."""
    way, part, own, second = [], 1.0, 0, []
    for vertex in vertices:
        event = vertex["tag"] & 15
        if event == SPLIT:
            part /= 2
            second.append((list(way), part))
            continue
        way.append((vertex, part))
        if ABSORBED <= event <= LEFT:
            yield np.array([vertex for vertex, _ in way], VERTEX), [part for _, part in way], own
            if second:
                way, part = second.pop()
                own = len(way)


def coefficients(map):
    """f per row, event (specular, diffuse, transmitted) and band, p per row, event and lead. A row is a material or, where it is locally
    reacting, one of its ranges of angles, whose f are means; and the first row of every material."""
    beta, factors, probabilities, first = map.header["settings"]["survival"], [], [], []
    for number, (kinds, law) in enumerate(zip(map.kinds, map.laws)):
        first.append(len(factors))
        alpha, s, tau = (np.array([kind[name] for kind in kinds]) for name in ("absorption", "scattering", "transmission"))
        drawn = np.concatenate([shares(kinds[chosen[number]]) for chosen in sets(map)], 1)
        for seen in zip(*(locally_reacting(absorption) for absorption in alpha)) if law else [alpha]:
            seen = np.array(seen)
            factors.append([(1 - seen[0]) * (1 - s[0]), (1 - seen[0]) * s[0], tau[0]])
            most = (1 - seen + tau).max(0)
            survival = np.where(most > 0, np.where(most > 0, most, 1) ** beta, 0)
            probabilities.append(drawn * np.tile(survival, len(sets(map))))
    return np.array(factors), np.array(probabilities), np.array(first)


LEAST_THROUGH = 0.15


def shares(kind):
    """Shares of the events in the packets that survive at a material, per event and band."""
    alpha, s, tau = (np.array(kind[name]) for name in ("absorption", "scattering", "transmission"))
    passed_on = np.where(1 - alpha + tau > 0, 1 - alpha + tau, 1)
    through = np.where(tau > 0, np.where(alpha < 1, np.maximum(tau / passed_on, LEAST_THROUGH), 1), 0)
    return np.stack([(1 - s) * (1 - through), s * (1 - through), through])


def sets(map):
    """Which kind of every material has its shares, in each set, the last material changing fastest."""
    alike = [[next(i for i, other in enumerate(kinds) if (shares(other) == shares(kind)).all()) for kind in kinds] for kinds in map.kinds]
    found = [[0] * len(alike)]
    for design in map.designs:
        chosen = list(found[0])
        for material, variant in design["choices"]:
            chosen[material] = alike[material][variant + 1]
        found.append(chosen)
    for number, kinds in enumerate(alike):
        free = sorted(set(kinds) - {chosen[number] for chosen in found})
        found += [[*chosen[:number], kind, *chosen[number + 1:]] for kind in free for chosen in found]
    return sorted({tuple(chosen) for chosen in found})


# Ranges of the cosine of incidence: one below 2^-10, then eight equal ones an octave.
BOUNDS = [0.0] + [2.0**octave * (1 + eighth / 8) for octave in range(-10, 0) for eighth in range(8)] + [1.0]


def locally_reacting(alpha):
    """What a wall with these coefficients in a diffuse field absorbs of diffuse sound in each range of angles."""
    impedance = impedances(alpha)
    means = [(primitive(impedance, high) - primitive(impedance, low)) / (high**2 - low**2) for low, high in zip(BOUNDS, BOUNDS[1:])]
    return [np.where(alpha > 0, mean, 0.0) for mean in means]


def primitive(impedance, cosine):
    """Integral of the absorption of diffuse sound up to a cosine of incidence."""
    x = impedance * cosine
    series = x**3 / 3 - x**4 / 2 + 3 * x**5 / 5 - 2 * x**6 / 3 + 5 * x**7 / 7 - 3 * x**8 / 4
    return 8 / impedance**2 * np.where(x < 0.01, series, x - 2 * np.log1p(x) + x / (1 + x))


def impedances(alpha):
    """Of walls with these coefficients in a diffuse field."""
    softest, hardest = np.full_like(alpha, 1.5671414), 8 / np.maximum(alpha, 1e-300)
    for _ in range(200):
        middle = np.sqrt(softest * hardest)
        harder = primitive(middle, 1.0) > alpha
        softest, hardest = np.where(harder, middle, softest), np.where(harder, hardest, middle)
    return np.sqrt(softest * hardest)


class Coefficients:
    """What packets meet at surfaces."""

    def __init__(self, map):
        self.map = map
        self.factors, self.probabilities, self.first = coefficients(map)
        materials = map.header["scene"]["materials"]
        self.impedances = [impedances(np.array(material["absorption"])) for material in materials]

    def met(self, surface, direction):
        """f and p per event and band for a packet that meets a surface in a direction: f of its angle, p of its range."""
        material = self.map.surfaces["material"][surface]
        first = self.first[material]
        if not self.map.laws[material]:
            return self.factors[first], self.probabilities[first]
        cosine = abs(direction @ self.map.surfaces["normal"][surface]) / np.linalg.norm(direction)
        row = first + np.clip(np.searchsorted(BOUNDS, cosine, "right") - 1, 0, len(BOUNDS) - 2)
        given = self.map.header["scene"]["materials"][material]
        alpha, s = np.array(given["absorption"]), np.array(given["scattering"])
        x = self.impedances[material] * cosine
        reflected = 1 - np.where(alpha > 0, 4 * x / (1 + x) ** 2, 0.0)
        return np.stack([reflected * (1 - s), reflected * s, 0 * s]), self.probabilities[row]


def stretches(map, source, vertices):
    """What the length of each leg of a path counts: c of the scene over that of the air it is in."""
    if map.airs is None:
        return np.ones(len(vertices))
    speed = map.header["scene"]["speed_of_sound"]
    speeds = [speed, *(region["speed_of_sound"] for region in map.airs["regions"])]
    air, factors = map.airs["at_sources"][source], []
    for tag in vertices["tag"]:
        factors.append(speed / speeds[air])
        if tag & 15 == REFRACTED:
            air = map.airs["sides"][tag >> 5][1 - (tag >> 4 & 1)]
    return np.array(factors)


def legs(map, source, origin, points, vertices):
    """What each leg of a path counts: its travel time times the speed of sound of the scene [m]."""
    lengths = np.linalg.norm(np.diff(points, axis=0, prepend=origin[None]), axis=1)
    if map.gradient == 0:
        return lengths * stretches(map, source, vertices)
    ends = speeds(map, np.vstack([origin, points]))
    half = abs(map.gradient) * lengths / 2 / np.sqrt(ends[:-1] * ends[1:])
    return map.header["scene"]["speed_of_sound"] * 2 / abs(map.gradient) * np.arcsinh(half)


def speeds(map, points):
    """Speed of sound at local positions where it has a gradient [m/s]."""
    scene = map.header["scene"]
    return scene["speed_of_sound"] + map.gradient * ((points + map.header["center"]) @ np.array(scene["up"]))


def arriving(map, before, after):
    """Unit direction in which an arc from one local position arrives at another."""
    up = np.array(map.header["scene"]["up"])
    here, there = speeds(map, np.array([before, after]))
    height = (after - before) @ up
    level = after - before - height * up
    direction = 2 * there * level + ((here + there) * height - map.gradient * (level @ level)) * up
    return direction / np.linalg.norm(direction)


class Emissions:
    """Which lead emission i has, which batch it counts for, how many packets of each lead there are."""

    def __init__(self, map):
        settings = map.header["settings"]
        self.bands, self.batches = len(map.header["scene"]["nominal_frequencies"]), settings["batches"]
        self.leads = self.bands * len(sets(map))
        self.per_band = settings["spectral"] == 1
        self.total = settings["emissions"] * (self.bands if self.per_band else 1)
        index = np.arange(self.total)
        self.led = np.zeros((self.batches, self.leads))
        np.add.at(self.led, (index // self.leads % self.batches, index % self.leads), 1)

    def start(self, emission):
        """The batch's share of all emissions, the bands carried (1 or 0), the leads mixed, and the packets n_k that count for them."""
        batch = emission // self.leads % self.batches
        carried, mixed = np.ones(self.bands), np.ones(self.leads)
        if self.per_band:
            own = emission % self.leads % self.bands
            carried, mixed = ((np.arange(count) % self.bands == own) * 1.0 for count in (self.bands, self.leads))
        return self.led[batch].sum() / self.total, carried, mixed, self.led[batch] * mixed


class Directions:
    """First directions of the packets of a source, regenerated from the seed (section "First directions" of the page)."""

    def __init__(self, map, source):
        settings = map.header["settings"]
        self.leads, self.batches = len(map.header["scene"]["nominal_frequencies"]) * len(sets(map)), settings["batches"]
        self.per_band = settings["spectral"] == 1
        count = self.batches * (self.leads if self.per_band else 1)
        self.keys = [chacha8(settings["seed"], [2, source, 0, 0, 0, 0], number)[:2] for number in range(count)]

    def direction(self, emission):
        """The unit vector in which an emission leaves."""
        block, lead = divmod(emission, self.leads)
        round, batch = divmod(block, self.batches)
        if self.per_band:
            first, second = self.keys[batch * self.leads + lead]
            index = round
        else:
            first, second = self.keys[batch]
            turn = scramble(scramble(round, first) ^ second, (first << 16 | first >> 16) & WORD)
            index = round * self.leads + (lead + turn) % self.leads
        u, v = unit(scramble(reversed_bits(index), first)), unit(scramble(pascal(index), second))
        z, angle = 1 - 2 * u, 2 * np.pi * v
        radius = np.sqrt(max(0, 1 - z * z))
        return np.array([radius * np.cos(angle), radius * np.sin(angle), z])


WORD = 0xFFFFFFFF
PATTERNS = {"omni": 1, "subcardioid": 0.7, "cardioid": 0.5, "supercardioid": (3**0.5 - 1) / 2, "hypercardioid": 0.25,
            "figure-eight": 0}


def directivity(map, source, direction):
    """Energy in a direction, relative to an omnidirectional source of the same power: of all bands, or per band."""
    emitter = map.header["scene"]["sources"][source]
    if emitter["directivity"] == "balloon":
        return balloon(map, source, direction)
    a, cosine = PATTERNS[emitter["directivity"]], direction @ emitter["aim"]
    return (a + (1 - a) * cosine) ** 2 / (a * a + (1 - a) ** 2 / 3)


def balloon(map, source, direction):
    """Factors per band, linear in both angles between the nodes of the grid."""
    roll, aim = map.directivity["sources"][source], map.header["scene"]["sources"][source]["aim"]
    found = map.directivity["balloons"][roll["balloon"] - 1]
    factors = found["factors"].reshape(found["azimuths"], found["polars"], -1)
    ahead, above, aside = direction @ aim, direction @ roll["up"], direction @ np.cross(aim, roll["up"])
    polar = np.arctan2(np.hypot(above, aside), ahead) / np.pi * (found["polars"] - 1)
    azimuth = np.arctan2(above, aside) / (2 * np.pi) % 1 * found["azimuths"]
    row, column = min(int(polar), found["polars"] - 2), int(azimuth) % found["azimuths"]
    down, right, after = polar - row, azimuth - int(azimuth), (column + 1) % found["azimuths"]
    upper = (1 - right) * factors[column, row] + right * factors[after, row]
    lower = (1 - right) * factors[column, row + 1] + right * factors[after, row + 1]
    return (1 - down) * upper + down * lower


def chacha8(seed, words, stream):
    """The first sixteen words of ChaCha with 8 rounds under the key (seed, words) in a stream."""
    key = [seed & WORD, seed >> 32, *words]
    start = [0x61707865, 0x3320646E, 0x79622D32, 0x6B206574, *key, 0, 0, stream & WORD, stream >> 32]
    x = list(start)
    columns = [(0, 4, 8, 12), (1, 5, 9, 13), (2, 6, 10, 14), (3, 7, 11, 15)]
    diagonals = [(0, 5, 10, 15), (1, 6, 11, 12), (2, 7, 8, 13), (3, 4, 9, 14)]
    for a, b, c, d in 4 * (columns + diagonals):
        for into, add, turned, by in [(a, b, d, 16), (c, d, b, 12), (a, b, d, 8), (c, d, b, 7)]:
            x[into] = (x[into] + x[add]) & WORD
            mixed = x[turned] ^ x[into]
            x[turned] = (mixed << by | mixed >> (32 - by)) & WORD
    return [(word + begun) & WORD for word, begun in zip(x, start)]


def reversed_bits(word):
    return int(f"{word:032b}"[::-1], 2)


def pascal(index):
    """Second coordinate of Sobol's sequence as a 32-bit fraction."""
    point, direction = 0, 1 << 31
    while index:
        if index & 1:
            point ^= direction
        direction ^= direction >> 1
        index >>= 1
    return point


def scramble(fraction, key):
    """Flips every bit of a fraction depending on the key and on the bits above it."""
    x = reversed_bits(fraction)
    x ^= x * 0x3D20ADEA & WORD
    x = (x + key) & WORD
    x = x * (key >> 16 | 1) & WORD
    x ^= x * 0x05526C56 & WORD
    x ^= x * 0x53A22864 & WORD
    return reversed_bits(x)


def unit(bits):
    return (bits >> 8) / 2**24


def sonels(map, source):
    """Every sonel of a source: (surface, back, local position, path length, incident energy per band, f per event and band)."""
    coefficients = Coefficients(map)
    emissions = Emissions(map)
    emitter = map.header["scene"]["sources"][source]
    directions = Directions(map, source)
    origin = emitter["position"] - map.header["center"]
    for emission, path in map.paths(source):
        share, carried, mixed, led = emissions.start(emission)
        # The directivity factor is part of the energy alone, not of the probabilities.
        share = share * directivity(map, source, directions.direction(emission))
        for vertices, parts, own in packets(path):
            feeding, drawing = carried.copy(), mixed.copy()
            points = vertices["position"].astype(float)
            lengths = np.cumsum(legs(map, source, origin, points, vertices))
            events, surfaces = vertices["tag"] & 15, vertices["tag"] >> 5
            for step, (event, surface) in enumerate(zip(events, surfaces)):
                if event in (ESCAPED, EXPIRED, LOST, LEFT):
                    break
                if event in (DIFFRACTED, REFRACTED, RETURNED, EMERGED):
                    continue
                energy = parts[step] * share * feeding / (led * drawing).sum()
                factors, probabilities = coefficients.met(surface, points[step] - (points[step - 1] if step else origin))
                if step >= own:
                    yield surface, vertices["tag"][step] >> 4 & 1, points[step], lengths[step], energy, factors
                if event >= ABSORBED:
                    break
                feeding = feeding * factors[event]
                drawing = drawing * probabilities[event]
                scale = 1 / drawing.max()  # common to both, so it drops out: nothing underflows
                feeding, drawing = feeding * scale, drawing * scale


def connections(map, source, receiver):
    """Fluence per unit emitted energy and band [1/m²] by connection in an empty convex room: nothing is in the way."""
    scene = map.header["scene"]
    attenuation = np.array(scene["air_attenuation"])
    target = np.array(receiver) - map.header["center"]
    reach = scene["duration"] * scene["speed_of_sound"]
    fluence = np.zeros(len(attenuation))
    for surface, back, point, length, energy, factors in sonels(map, source):
        row = map.surfaces[surface]
        offset = target - point
        distance = np.linalg.norm(offset)
        cosine = (-1 if back else 1) * (offset @ row["normal"]) / distance
        if cosine > 0 and length + distance <= reach:
            air = np.exp(-attenuation * (length + distance))
            fluence += energy * factors[DIFFUSE] * cosine / (np.pi * distance**2) * air
    return fluence


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("map", type=Path, metavar="MAP.sonelmap")
    parser.add_argument("--receiver", required=True, metavar="x,y,z", help="in the axes of the scene [m]")
    arguments = parser.parse_args()
    map = SonelMap(arguments.map)
    scene = map.header["scene"]
    if len(map.surfaces) != 6 or not map.surfaces["closed"].all():
        sys.exit("error: connections are computed here in an empty shoebox only, where nothing is in the way")
    receiver = [float(number) for number in arguments.receiver.split(",")]
    sources = [{"name": source["name"], "connection": connections(map, index, receiver).tolist()}
               for index, source in enumerate(scene["sources"])]
    print(json.dumps({"scene": scene["name"], "tool_version": map.header["tool_version"],
                      "center_frequency_hz": scene["nominal_frequencies"].tolist(), "paths": int(map.chunks["paths"].sum()),
                      "sources": sources}))


if __name__ == "__main__":
    main()
