// What a consultant hands over: verdicts, designs, room and assumptions first, then tables; details are folded.
"use strict";
// Beyond a range, by the parameter; everything else is too high or too low.
const TOO = { t20_s: ["dry", "long"], t30_s: ["dry", "long"], early_decay_time_s: ["dry", "long"], level_db: ["quiet", "loud"], strength_g_db: ["quiet", "loud"], a_weighted_level_db: ["quiet", "loud"] };
// What single numbers are shown of first, as far as there are values.
const FIRST = ["t30_s", "early_decay_time_s", "strength_g_db", "clarity_c50_db", "clarity_c80_db", "definition_d50", "a_weighted_level_db", "useful_to_detrimental_u50_db", "lateral_fraction", "late_lateral_level_db", "speech_transmission_index"];
// Rows of a table beyond which it is a detail.
const MOST_ROWS = 24;

const pairName = (page, pair) => `${page.designs.length > 1 ? `${page.designs[pair.design].name}: ` : ""}${pair.source} → ${pair.receiver}`;
const rowOf = (rows, key) => rows.find((row) => row.key === key);
const chosen = (page) => {
  const has = (key) => page.pairs.some((pair) => isKnown(rowOf(pair.parameters, key)?.single));
  return FIRST.filter(has).map((key) => page.pairs.map((pair) => rowOf(pair.parameters, key)).find(Boolean));
};
const surface = (room) => room.materials.reduce((sum, { area }) => sum + area, 0);

function showReport(page) {
  const results = byId("results"), details = byId("details");
  const by = [page.author && `Author: ${page.author}`, page.date, page.revision && `Version ${page.revision}`].filter(Boolean);
  if (by.length) results.append(make("p", by.join(" · ")));
  if (!page.designs.length) return;
  const section = (title, ...parts) => {
    const heading = make("h2", title);
    heading.id = title.replace(/[^A-Za-z]/g, "");
    results.append(heading, ...parts.flat());
  };
  section("Result", verdicts(page));
  section("Room and assumptions", assumptions(page));
  section("Designs", pictures(page));
  if (page.offices.length) section("Open-plan office", openPlan(page));
  section("Single numbers", singleNumbers(page));
  if (page.designs.length > 1) section("Differences", differences(page));
  if (page.requirements.length) section("Requirement by band", judgedBands(page));
  if (page.maps.length) section("Maps", page.maps.map((plans) => drawPlans(plans)), make("p", "Single numbers. A cell reaches halfway to the next receiver; grey: no value. The cross is the source.", "note"));
  section("Remarks", remarks(page));
  const fold = (title, fill) => {
    const whole = make("details"), about = make("summary", title);
    whole.append(about);
    whole.ontoggle = () => { if (whole.children.length === 1) whole.append(...[fill()].flat()); };
    details.append(whole);
  };
  fold("Over frequency", () => overFrequency(page));
  fold("Over frequency, in numbers", () => page.pairs.filter((pair) => pair.parameters[0].values.length).flatMap((pair) => overBands(page, pair)));
  fold("Over receivers", () => overReceivers(page));
  if (page.designs.some(({ times }) => times.length)) fold("Statistical reverberation times", () => statisticalTimes(page));
  if (page.designs.some(({ uncertainties }) => uncertainties)) fold("Uncertainty of the materials", () => uncertainMaterials(page));
  fold("Positions", () => positions(page));
  page.rooms.forEach((room, index) => {
    if (room.trace) fold(`Effects and energy ledger${page.rooms.length > 1 ? ` of map ${index + 1}` : ""}`, () => ledger(room));
  });
  fold("Provenance", () => page.designs.map((design) => table([], [["response", design.name], ...design.provenance], "long")));
}

// "too long by 0.07 ± 0.02 s at 125 Hz" of the worst band to each side; how much is left where all is well.
function verdictText({ key, unit, designs }, index) {
  const { verdict, bands } = designs[index];
  if (!bands.length) return verdict;
  const known = bands.filter(({ beyond }) => isKnown(beyond));
  if (!known.length) return `${verdict}: no value`;
  const worst = (side) => known.filter(side).sort((a, b) => b.beyond[0] - a.beyond[0])[0];
  const at = ({ at }) => at && known.length > 1 ? ` at ${at}` : "";
  const beyond = (band) => {
    const word = (TOO[key] ?? ["low", "high"])[Number(band.isAbove)];
    const [over, ...sides] = band.beyond, doubt = band.verdict === "undecided" ? "perhaps " : "";
    if (over < 0) return `${numberText([-over, ...sides], unit)} ${unit} to spare${at(band)}`.replace(/ +/g, " ");
    return `${doubt}too ${word} by ${numberText(band.beyond, unit)} ${unit}${at(band)}`.replace(/ +/g, " ");
  };
  const outside = [true, false].map((above) => worst((band) => band.isAbove === above && band.verdict !== "pass")).filter(Boolean);
  if (outside.length) return outside.map(beyond).join("; ");
  const nearest = worst(() => true), inside = [-nearest.beyond[0], ...nearest.beyond.slice(1)];
  return `met with ${numberText(inside, unit)} ${unit} to spare${at(nearest)}`.replace(/ +/g, " ");
}

function verdicts(page) {
  if (!page.requirements.length) return [make("p", "No requirement was stated (--target): what follows are values.", "note")];
  const rows = page.requirements.flatMap((requirement) => page.designs.map((design, index) => {
    const { verdict } = requirement.designs[index];
    const shown = make("td", verdict, verdict.length > 9 ? "" : verdict);
    const name = requirement.name.includes("=") ? requirement.name : `${requirement.name} (${requirement.symbol})`;
    return [index ? "" : name, design.name, shown, verdictText(requirement, index)];
  }));
  const states = [...new Set(page.requirements.filter(({ state }) => state).map(({ name, source, state }) => `${name}: ${source}; ${state}.`))];
  const materials = page.designs.some(({ uncertainties }) => uncertainties);
  return [table(["requirement", "design", "verdict", "margin of the mean over the receivers"], rows, "long"),
    make("p", `± half of the 95 % interval of the simulation${materials ? " and of the materials together" : "; the uncertainty of the materials is not part of it"}. Pass: the whole interval lies within the range. Fail: it lies outside. Undecided: it reaches over an end. ${states.join(" ")}`, "note")];
}

// One chart a design: the required parameter over frequency, with its range.
function pictures(page) {
  const [requirement] = page.requirements, key = rowOf(page.designs[0].means, requirement?.key)?.values.length ? requirement.key : "t30_s";
  const own = requirement?.key === key ? requirement.ranges : [], { bands } = page.rooms[0];
  const wanted = own.flatMap((range, band) => range ? [[bands[band], ...range]] : []);
  const panels = page.designs.map((design) => {
    const row = rowOf(design.means, key), mean = { name: "mean over the receivers", mark: "PointsAndLine", points: pointsOf(bands, row.values) };
    return { title: `${design.name}: ${row.symbol}`, x: { label: "band [Hz]", scale: "Logarithmic", ticks: thirds(bands) }, y: { label: label(row), fromZero: true }, series: [mean], wanted };
  });
  const highest = Math.max(...panels.flatMap(({ series }) => series[0].points.map((point) => point[3] ?? point[1] ?? 0)), ...wanted.map(([, , high]) => high ?? 0));
  const row = make("div", undefined, "grid");
  for (const panel of panels) {
    const place = make("div");
    panel.y.range = [0, 1.08 * highest];
    drawChart(place, panel, { hasKeys: false, height: 220 });
    row.append(place);
  }
  return [row, make("p", `Mean over the receivers with 95 % intervals${wanted.length ? `; grey: range of ${requirement.name}` : ""}.`, "note"), ...materialTable(page)];
}
const pointsOf = (bands, values) => values.map((entry, band) => isKnown(entry) ? [bands[band], entry[0], entry[0] - entry[1] || null, entry[0] + entry[1] || null] : [bands[band], null]);
// Labels of third octaves would run into one another.
const thirds = (bands) => bands.length > 10 ? bands.filter((_, band) => band % 3 === 1) : bands;

// Absorption of every surface, a line a design where designs differ.
function materialTable(page) {
  const isNamed = page.designs.length > 1, { bands } = page.rooms[0];
  const rows = page.rooms.flatMap((room, index) => {
    const own = page.designs.filter((design) => design.room === index && design.materials);
    return room.materials.flatMap((material, at) => {
      const lines = new Map(), total = surface(room);
      for (const design of own.length ? own : [{ name: "" }]) {
        const { absorption } = design.materials?.[at] ?? material, text = absorption.map((alpha) => alpha.toFixed(2)).join(" ");
        lines.set(text, [...lines.get(text) ?? [], design.name]);
      }
      const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
      const first = (text, line) => line ? "" : text;
      return [...lines].map(([text, names], line) => [first(material.name, line), first(material.area.toFixed(1), line), first(`${(100 * material.area / total).toFixed(0)} %`, line),
        ...isNamed ? [lines.size > 1 || page.rooms.length > 1 ? names.join(", ") : ""] : [], ...text.split(" "), first(mean(material.scattering).toFixed(2), line), first(material.source ?? "", line)]);
    });
  });
  if (!rows.length) return [make("p", "Without the map, its materials and walls are not known: give it among the files.", "note")];
  return [table(["surface", "m²", "share", ...isNamed ? ["design"] : [], ...bands.map((hz) => `α ${frequency(hz)}`), "s", "source"], rows, "materials"),
    make("p", "α: absorption in the bands [Hz]; s: scattering, mean over the bands.", "note")];
}

function assumptions(page) {
  const facts = page.rooms.flatMap((room, index) => {
    const of = page.rooms.length > 1 ? ` of map ${index + 1}` : "", size = surface(room);
    const volume = room.volume && `volume ${room.volume.toFixed(0)} m³`, area = size && `surface ${size.toFixed(0)} m²`;
    const path = room.volume && size && `mean free path ${(4 * room.volume / size).toFixed(2)} m`;
    const sources = room.sources.map(({ name, at, directivity }) => `${name} at (${at.map((v) => v.toFixed(2)).join(", ")}) m${directivity ? `, ${directivity}` : ""}`);
    const rendered = page.designs.filter((design) => design.room === index).flatMap(({ effects }) => effects);
    const effects = [...new Set([...room.trace?.effects.filter(([, on]) => on !== "off").map(([name]) => name) ?? [], ...rendered])];
    return [[`room${of}`, [volume, area, path].filter(Boolean).join(", ") || "not closed, or without its map"], [`sources${of}`, sources.join("; ")],
      ...room.trace ? [[`simulation${of}`, `sonel mapping, ${room.trace.packets.toLocaleString("en")} packets a source; on: ${effects.join(", ") || "no effect"}`]] : []];
  });
  const { noise, system } = page.designs[0], receivers = new Set(page.pairs.map(({ receiver }) => receiver));
  facts.push(["receivers", receivers.size > 12 ? `${receivers.size}` : [...receivers].join(", ")]);
  facts.push(["background noise", noise === null ? "none: STI of the room alone" : `${noise.toFixed(1)} dB(A), in STI, U50 and SNR`]);
  if (system.length) facts.push(["sources as one system", system.join("; ")]);
  facts.push(["people and furniture", "as far as they are surfaces and coefficients above"]);
  facts.push(["not simulated", "single modes below the Schroeder frequency, interference of coherent loudspeakers, sound from outside and from services"]);
  const picture = make("img", undefined, "paper");
  picture.id = "picture";
  picture.alt = "The room";
  const both = make("div", undefined, "facts");
  both.append(table([], facts, "long"), picture);
  return [both];
}

// Designs side by side, with their differences to the first.
function openPlan(page) {
  const [first, ...others] = page.offices, unitOf = (label) => /\[(.*)\]/.exec(label)[1];
  const head = ["along the receivers", ...page.designs.flatMap(({ name }, index) => index ? [name, `less ${page.designs[0].name}`] : [name])];
  const rows = first.numbers.map(({ label, value }, index) => [label, cell(value, unitOf(label)), ...others.flatMap(({ numbers }) => {
    const { value, less } = numbers[index];
    return [cell(value, unitOf(label)), cell(less, unitOf(label), significance(less, Infinity))];
  })]);
  const levels = page.offices.filter(({ level }) => level).map(({ level }, index) => `${page.designs.length > 1 ? `${page.designs[index].name}: ` : ""}${level}`);
  return [table(head, rows), make("p", `${[...levels, ""].join(". ")}ISO 3382-3 (2012, annex A) calls an office good with D2,S of at least 7 dB, Lp,A,S,4m of at most 48 dB and rD of at most 5 m.`, "note")];
}

// Means of every design and, where they are few, every seat.
function singleNumbers(page) {
  const columns = chosen(page), head = ["source → receiver", ...columns.map(label)];
  const cells = (rows) => columns.map(({ key, unit }) => cell(rowOf(rows, key)?.single, unit));
  const counted = ({ means }) => columns.map(({ key, unit }) => {
    const { single, counted: [count, of] } = rowOf(means, key);
    return cell(single, unit, count && count < of ? ` (${count} of ${of})` : "");
  });
  const rows = page.pairs.map((pair) => [pairName(page, pair), ...cells(pair.parameters)]);
  const means = page.designs.map((design) => [page.designs.length > 1 ? `${design.name}: mean` : "mean", ...counted(design)]);
  const noticeable = ["JND", ...columns.map(({ isRelative, noticeable, single, unit }) => isRelative ? `${(100 * noticeable / (isKnown(single) ? single[0] : 1)).toFixed(0)} %` : rounded(noticeable, unit))];
  const isLong = rows.length > MOST_ROWS, parts = [table(head, [...isLong ? [] : rows, ...page.pairs.length > page.designs.length || isLong ? means : [], noticeable])];
  if (isLong) parts.push(folded("Every source and receiver", () => table(head, rows)));
  parts.push(make("p", "Means of the octaves 500 and 1000 Hz (LF and LJ: 125 to 1000 Hz), ± half of the 95 % interval of the simulation. A mean is over all pairs with a value; its interval is that of the mean, not the spread between seats. JND: just-noticeable difference.", "note"));
  return parts;
}

function folded(title, fill) {
  const whole = make("details");
  whole.append(make("summary", title));
  whole.ontoggle = () => { if (whole.children.length === 1) whole.append(fill()); };
  return whole;
}

// Of every design less the first.
function differences(page) {
  const columns = chosen(page), head = [`less ${page.designs[0].name}`, ...columns.map((row) => `Δ${label(row)}`)];
  const cells = (rows) => columns.map(({ key, unit }) => {
    const row = rowOf(rows, key);
    return cell(row?.less?.single, unit, significance(row?.less?.single, row?.noticeable));
  });
  const rows = page.pairs.filter(({ parameters }) => parameters[0].less).map((pair) => [pairName(page, pair), ...cells(pair.parameters)]);
  const means = page.designs.slice(1).map((design) => [`${design.name}: mean`, ...cells(design.means)]);
  const parts = rows.length > MOST_ROWS ? [table(head, means), folded("Every source and receiver", () => table(head, rows))] : [table(head, [...rows, ...rows.length > means.length ? means : []])];
  return [...parts, make("p", "± half of the 95 % interval; runs of one map, or of one seed, share their random numbers. (0): not beyond the noise of the simulation. *: at least one JND.", "note")];
}

function judgedBands(page) {
  const range = ([low, high], unit) => low !== null && low > 0 && high !== null ? `${rounded(low, unit)} … ${rounded(high, unit)}` : high !== null ? `at most ${rounded(high, unit)}` : `at least ${rounded(low, unit)}`;
  return page.requirements.filter(({ designs }) => designs.some(({ bands }) => bands.length)).map((requirement) => {
    const { unit, designs } = requirement, first = designs.find(({ bands }) => bands.length);
    const head = [requirement.name, `required${unit && ` [${unit}]`}`, ...page.designs.map(({ name }) => name)];
    return table(head, first.bands.map((band, index) => [band.at || requirement.symbol, range(band.range, unit), ...designs.map(({ bands }) => {
      const own = bands[index];
      const place = cell(own?.value, unit, own ? `: ${own.verdict}` : "");
      if (own) place.classList.add(own.verdict);
      return place;
    })]));
  });
}

function remarks(page) {
  const list = make("ul"), all = [...page.remarks];
  page.designs.forEach(({ name, modal }) => { if (modal) all.push(`${name}: ${modal}.`); });
  all.push(page.designs.some(({ uncertainties }) => uncertainties)
    ? "The uncertainty of absorption is the second interval, as far as its standard uncertainties are right; that of scattering is not in the numbers."
    : "Intervals are those of the simulation alone. Absorption differs between laboratory and building by 0.1 and more.");
  if (page.pairs.length > page.designs.length) all.push("All receivers share one simulation, so their errors are correlated; each interval holds for one value.");
  list.append(...all.map((text) => make("li", text)));
  return [list];
}

// Every parameter over the bands, a series a pair.
function overFrequency(page) {
  const pairs = page.pairs.filter(({ curves }) => curves), grid = make("div", undefined, "grid"), longest = pairs.map(({ parameters }) => parameters.filter(({ values }) => values.length)).sort((a, b) => b.length - a.length)[0];
  for (const { key, symbol, unit } of longest) {
    const series = pairs.map((pair) => ({ name: pairName(page, pair), mark: "PointsAndLine", points: pointsOf(pair.bands, rowOf(pair.parameters, key)?.values ?? []) }));
    const place = make("div");
    drawChart(place, { title: "", x: { label: "band [Hz]", scale: "Logarithmic", ticks: thirds(pairs[0].bands) }, y: { label: label({ symbol, unit }) }, series }, { hasKeys: false });
    grid.append(place);
  }
  return [keys(pairs.map((pair) => pairName(page, pair))), grid];
}

function overBands(page, pair) {
  const rows = pair.parameters.filter(({ values }) => values.length);
  const lines = pair.bands.map((hz, band) => [hertz(hz), ...rows.map(({ values, unit, less, noticeable }) => {
    const place = cell(values[band], unit), change = less && cell(less.values[band], unit, significance(less.values[band], noticeable));
    if (change && isKnown(less.values[band])) place.append(make("br"), make("small", `Δ ${change.textContent}`));
    return place;
  })]);
  return [make("h3", pairName(page, pair)), table(["f", ...rows.map(label)], lines)];
}

// Single numbers over the receivers, a series a design and source.
function overReceivers(page) {
  const names = page.pairs.map((pair) => `${page.designs.length > 1 ? `${page.designs[pair.design].name}: ` : ""}${pair.source}`), grid = make("div", undefined, "grid");
  const each = [...new Set(names)];
  for (const { key, unit, symbol } of chosen(page)) {
    const series = each.map((name) => {
      const own = page.pairs.filter((_, index) => names[index] === name);
      const points = own.map((pair) => [pair.receiver, rowOf(pair.parameters, key)?.single]).filter(([, single]) => isKnown(single));
      return { name, mark: "Points", points: points.map(([receiver, [value, half]]) => [receiver, value, value - half || null, value + half || null]) };
    });
    const place = make("div");
    drawChart(place, { title: "", x: { label: "receiver", scale: "Category" }, y: { label: label({ symbol, unit }) }, series }, { hasKeys: false });
    grid.append(place);
  }
  return [keys(each), grid];
}

function statisticalTimes(page) {
  const { bands } = page.rooms[0];
  return [...page.designs.filter(({ times }) => times.length).flatMap((design) => [make("h3", design.name), table(["f", "mean α", "Sabine [s]", "Eyring [s]", "T30 [s]"],
    design.times.map(({ absorption, sabine, eyring }, band) => [hertz(bands[band]), absorption.toFixed(3), sabine.toFixed(2), eyring.toFixed(2), cell(rowOf(design.means, "t30_s").values[band], "s")]))]),
  make("p", "Statistical times hold for a diffuse field; where absorption is uneven, simulated times are longer. T30 is the mean over the receivers with a value.", "note")];
}

function uncertainMaterials(page) {
  const { bands } = page.rooms[0], change = (value) => value === null ? "–" : `${value < 0 ? "−" : "+"}${Math.abs(value).toFixed(3)}`;
  return [...page.designs.filter(({ uncertainties }) => uncertainties).flatMap(({ name, uncertainties }) => [make("h3", name), table(["material", "G [dB]", "T30 [s]", "C80 [dB]", ...bands.map((hz) => `u(α) ${hertz(hz)}`)],
    uncertainties.map(({ material, absorption, changes }) => [material, ...changes.map(change), ...absorption.map((u) => u.toFixed(3))]))]),
  make("p", "Changes of single numbers, as means over the receivers, by one standard uncertainty u(α) of the absorption of each material. Materials are taken as independent, bands of one material as deviating together; the second interval is 1.96 times the root of the sum of squares, of times that of the decay rate, within the range of absorption. Scattering is taken as exact.", "note")];
}

function positions(page) {
  return page.rooms.map(({ sources, receivers }) => {
    const own = receivers.length ? receivers : [...new Map(page.pairs.map(({ receiver, at }) => [receiver, { name: receiver, at }])).values()];
    const line = (what) => ({ name, at }) => [what, name, ...at.map((value) => value.toFixed(2))];
    return table(["", "name", "x [m]", "y [m]", "z [m]"], [...sources.map(line("source")), ...own.map(line("receiver"))]);
  });
}

function ledger({ trace: { effects, balances, fates } }) {
  const keys = ["absorbed", "transmitted", "escaped", "truncated", "sampling"], share = (value) => `${(100 * value).toFixed(3)} %`;
  return [table(["effect", "state", "reason and bound"], effects, "long"),
    table(["f", ...keys, "residual"], balances.map((band) => [hertz(band.center_frequency_hz), ...keys.map((key) => share(band[key])), band.relative_residual.toExponential(1)])),
    make("p", `Shares of the emitted energy. Truncated is the energy of packets at the end of the simulated time; sampling is random with mean zero. Packets by fate: ${Object.entries(fates).map(([name, count]) => `${name} ${count}`).join(", ")}.`, "note")];
}
