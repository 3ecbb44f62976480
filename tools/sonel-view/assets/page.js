// The page: joins room, tables, charts, and what the server answers.
"use strict";
const shown = { pair: null, kept: null, changes: {}, listener: null, source: 0, maps: 0, steps: [], map: null };
let view, server, hearing;

async function start() {
  if (!window.DecompressionStream) return document.body.prepend(make("p", "Room and charts need a browser of 2023 or later; tables are below.", "bad"));
  document.head.append(make("script", await unpacked("libraries")));
  const { room, pairs, charts, live } = JSON.parse(await unpacked("content"));
  charts.forEach((chart, index) => drawChart(`chart${index}`, chart));
  shown.room = room;
  if (live) {
    document.body.classList.add("served");
    server = new Server(live.token);
  }
  view = new RoomView(room, live && moveListener, dropSource);
  view.onHover = (way) => highlight(way?.delay ?? null);
  byId("whole").onclick = () => view.whole();
  byId("above").onclick = () => view.above();
  byId("wire").onchange = (event) => view.setWire(event.target.checked);
  byId("cut").oninput = (event) => view.setCut(Number(event.target.value));
  byId("ways").onchange = showWays;
  byId("coefficient").onchange = showMaterials;
  showMaterials();
  showFaults();
  const choose = byId("pair");
  pairs.forEach((pair) => choose.append(make("option", pair.name)));
  choose.onchange = () => show(pairs[choose.selectedIndex]);
  byId("choose").hidden = pairs.length < 2;
  if (pairs.length) show(pairs[0]);
  else byId("curves").hidden = !live;
  if (live) serve();
}

// A source at a receiver: from the file, or as the server answers.
function show(pair) {
  shown.pair = pair;
  showParameters(pair, shown.kept);
  showCurves(pair);
  showWays();
  view.moveListener(pair.at);
  if (!shown.isLinked) {
    byId("early").on("plotly_hover", (event) => view.pick(event.points[0].x));
    byId("early").on("plotly_unhover", () => view.pick(null));
    shown.isLinked = true;
  }
}

function showWays() {
  const choice = byId("ways").value, most = { none: -1, all: Infinity }[choice] ?? Number(choice);
  const whole = ({ at, sourceAt, ways }) => ways.map((way) => ({ ...way, corners: [at, ...way.corners, sourceAt] }));
  view.showWays(shown.pair ? whole(shown.pair) : [], most);
}

// The point of a delay in the chart of early reflections.
function highlight(delay) {
  const chart = byId("early");
  if (delay === shown.delay || !chart.data) return;
  shown.delay = delay;
  view.pick(delay);
  const curve = delay === null ? -1 : chart.data.findIndex((trace) => trace.x?.some((x) => Math.abs(x - delay) < 1e-3));
  if (curve < 0) return Plotly.Fx.unhover?.(chart);
  Plotly.Fx.hover(chart, [{ curveNumber: curve, pointNumber: chart.data[curve].x.findIndex((x) => Math.abs(x - delay) < 1e-3) }]);
}

const isChanged = () => Object.keys(shown.changes).length > 0;

// Materials with what they absorb: sliders where a server answers, and a block for other materials that responses were rendered with.
function showMaterials() {
  const { room } = shown, table = byId("materials");
  if (!room.materials.length) return byId("materialsSection").remove();
  const texts = ["material", "area [m²]", "share of absorption", ...room.bands.map(hertz), "scattering", "law", "source"];
  const focused = document.activeElement?.ariaLabel;
  table.replaceChildren(heading(texts));
  const current = room.materials.map((material) => {
    const changed = (key) => shown.changes[`materials.${material.name}.${key}`];
    const keys = ["absorption", "scattering", "transmission"];
    return { ...Object.fromEntries(keys.map((key) => [key, changed(key) ?? material[key]])), isChanged: keys.some(changed) };
  });
  const rendered = room.rendered ?? [], isOther = ({ materials }) => materials.some(({ isChanged }) => isChanged);
  if (server || !rendered.length) table.append(materialRows(current, server));
  for (const block of server ? rendered.filter(isOther) : rendered) {
    if (rendered.length > 1 || isOther(block)) {
      const name = Object.assign(make("th", block.name), { colSpan: texts.length }), line = make("tr");
      line.append(name);
      table.append(line);
    }
    table.append(materialRows(block.materials));
  }
  [...table.querySelectorAll("input")].find(({ ariaLabel }) => ariaLabel === focused)?.focus();
  byId("original").hidden = !isChanged();
}

function materialRows(coefficients, isEdited) {
  const { room } = shown, key = byId("coefficient").value, rows = document.createDocumentFragment();
  const mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
  const absorbing = room.materials.map(({ area }, index) => area * mean(coefficients[index].absorption));
  const total = absorbing.reduce((sum, area) => sum + area, 0) || 1;
  room.materials.forEach((material, index) => {
    const own = coefficients[index], values = own[key];
    const line = make("tr", undefined, own.isChanged ? "beyond" : ""), name = make("td"), swatch = make("span", "", "swatch");
    swatch.style.background = colorOf(index);
    name.append(swatch, material.name);
    line.append(name, make("td", material.area.toFixed(1)), make("td", `${(100 * absorbing[index] / total).toFixed(0)} %`));
    values.forEach((value, band) => {
      const place = make("td");
      if (isEdited) {
        const input = Object.assign(make("input"), { type: "number", min: 0, max: 1, step: 0.01, value: Number(value.toFixed(4)) });
        input.setAttribute("aria-label", `${key} of ${material.name} at ${hertz(room.bands[band])}`);
        // Rows are made anew when the next input has the focus.
        input.onchange = () => setTimeout(() => changeMaterial(material, values.map((old, at) => at === band ? Math.min(1, Math.max(0, Number(input.value))) : old), key));
        place.append(input);
      } else place.textContent = value.toFixed(2);
      line.append(place);
    });
    const source = own.isChanged ? "not that of the map" : material.source ?? "";
    line.append(make("td", mean(own.scattering).toFixed(2)), make("td", material.law), make("td", source));
    rows.append(line);
  });
  return rows;
}

function showFaults() {
  const { faults } = shown.room;
  byId("faultsSection").hidden = !faults.length;
  for (const text of faults) {
    const item = make("li", text), place = text.match(/\((-?[\d.]+), (-?[\d.]+), (-?[\d.]+)\)/);
    if (place) {
      const fly = make("button", "show");
      fly.onclick = () => view.flyTo(place.slice(1).map(Number));
      item.append(" ", fly);
    }
    byId("faults").append(item);
  }
}

// From here on a server answers.

const rendering = new Newest(async (wish, isNewest) => {
  for (const batches of shown.steps) {
    const last = batches === shown.steps.at(-1);
    const answer = await server.ask("render", { ...wish, window: server.window, batches: last ? null : batches });
    if (!isNewest()) return;
    show(answer);
    say(answer.warnings.join(" "));
  }
  if (hearing?.source) await refreshSound();
});
rendering.failed = (error) => {
  say(error.message, true);
  byId("retrace").hidden = !(isChanged() && shown.canTrace);
};

const wish = () => ({ listener: shown.listener, source: shown.source, changes: shown.changes });
function render() {
  if (shown.steps.length) rendering.wish(wish());
}

function say(text, isBad = false) {
  byId("job").replaceChildren(make("span", text, isBad ? "bad" : ""));
}

// Millimetres: so exact are the commands that are saved.
function moveListener(at) {
  shown.listener = at.map((value) => Math.round(1000 * value) / 1000);
  ["x", "y", "z"].forEach((axis, index) => { byId(axis).value = shown.listener[index]; });
  view.moveListener(shown.listener);
  render();
}

// A source that was dragged sends from there when the scene has been traced anew.
function dropSource(source, at) {
  const place = at.map((value) => Math.round(1000 * value) / 1000);
  trace(shown.room.sources.map((own, index) => index === source ? place : own.at));
}

function changeMaterial(material, values, key = "absorption") {
  const name = `materials.${material.name}.${key}`;
  const isOwn = values.every((value, band) => Math.abs(value - material[key][band]) < 1e-9);
  if (isOwn) delete shown.changes[name]; else shown.changes[name] = values;
  byId("retrace").hidden = true;
  showMaterials();
  render();
}

function serve() {
  const { room } = shown, source = byId("source");
  room.sources.forEach((one) => source.append(make("option", one.name)));
  source.onchange = () => { shown.source = source.selectedIndex; render(); };
  ["x", "y", "z"].forEach((axis, index) => {
    byId(axis).onchange = () => moveListener(shown.listener.map((value, at) => at === index ? Number(byId(axis).value) : value));
  });
  walkByKeys();
  const middle = view.world(view.box.getCenter(new THREE.Vector3()));
  const first = room.receivers[0]?.at ?? middle;
  shown.listener = first;
  moveListener(first);
  compare();
  listen();
  maps();
  byId("original").onclick = () => { shown.changes = {}; showMaterials(); render(); };
  byId("retrace").onclick = () => trace(room.sources.map(({ at }) => at));
  byId("move").onclick = () => trace(room.sources.map(({ at }, index) => index === shown.source ? shown.listener : at));
  byId("save").onclick = save;
  library();
  follow();
}

function walkByKeys() {
  const step = 0.1, up = new THREE.Vector3(...shown.room.up);
  const ways = { ArrowLeft: [-1, 0, 0], ArrowRight: [1, 0, 0], ArrowUp: [0, 1, 0], ArrowDown: [0, -1, 0], PageUp: [0, 0, 1], PageDown: [0, 0, -1] };
  byId("room").addEventListener("keydown", (event) => {
    const way = ways[event.key];
    if (!way) return;
    event.preventDefault();
    const side = new THREE.Vector3().setFromMatrixColumn(view.camera.matrixWorld, 0).projectOnPlane(up).normalize();
    const ahead = new THREE.Vector3().crossVectors(up, side);
    const moved = new THREE.Vector3().addScaledVector(side, way[0]).addScaledVector(ahead, way[1]).addScaledVector(up, way[2]);
    moveListener(shown.listener.map((value, index) => value + step * moved.getComponent(index)));
  });
}

// The trace, as far as it is; a new map is rendered.
async function follow() {
  let wait = 1000;
  try {
    const state = await server.ask("state");
    shown.canTrace = state.can_trace;
    byId("move").disabled = !state.can_trace;
    view.canTrace = state.can_trace;
    if (state.share !== null) {
      wait = 150;
      const bar = Object.assign(make("progress"), { max: 1, value: state.share });
      bar.setAttribute("aria-label", "progress of the trace");
      byId("job").replaceChildren("Tracing the scene … ", bar);
    }
    if (state.failure !== shown.failure) {
      shown.failure = state.failure;
      if (state.failure) refuse(state.failure);
      shown.tracedChanges = null;
    }
    if (state.maps !== shown.maps) {
      shown.maps = state.maps;
      shown.steps = state.map.steps;
      state.map.sources.forEach((at, index) => { shown.room.sources[index].at = at; });
      view.spots();
      if (shown.tracedChanges) {
        for (const [name, values] of Object.entries(shown.tracedChanges)) {
          const [, own, key] = name.match(/^materials\.(.*)\.(\w+)$/);
          const material = shown.room.materials.find((one) => one.name === own);
          if (material) material[key] = values;
        }
        [shown.changes, shown.tracedChanges] = [{}, null];
        showMaterials();
      }
      say(state.messages.join(" ") || `${state.map.packets.toLocaleString("en")} packets a source.`);
      render();
      library();
    }
  } catch (error) {
    wait = 3000;
    say(`sonel-view does not answer: ${error.message}`, true);
  }
  setTimeout(follow, wait);
}

async function trace(sources) {
  try {
    const { changes } = shown;
    await server.ask("trace", { sources, changes });
    [shown.failure, shown.tracedChanges] = [null, changes];
    byId("retrace").hidden = true;
  } catch (error) { refuse(error.message); }
}

// A source that was dragged is again where the map has it.
function refuse(message) {
  view.spots();
  view.moveListener(shown.listener);
  say(message, true);
}

function compare() {
  byId("keep").onclick = () => {
    shown.kept = shown.pair;
    shown.heardA = hearing?.samples ?? null;
    byId("forget").hidden = false;
    byId("hearing").hidden = !shown.heardA;
    showParameters(shown.pair, shown.kept);
  };
  byId("forget").onclick = () => {
    shown.kept = null;
    byId("forget").hidden = true;
    byId("hearing").hidden = true;
    showParameters(shown.pair, null);
  };
}

// Without the last batches first: a walk is heard at once.
const sounding = new Newest(async (wish, isNewest) => {
  for (const batches of [shown.steps[0], null]) {
    const samples = await server.ask("sound", { ...wish, window: server.window, batches });
    if (!isNewest()) return;
    shown.heard = samples;
    if (!byId("hearA").checked) hearing.hear(samples);
  }
});
sounding.failed = (error) => say(error.message, true);
const refreshSound = () => sounding.wish(wish());

function listen() {
  const recording = byId("recording"), signal = byId("signal");
  signal.onchange = () => { recording.hidden = signal.value !== "file"; };
  byId("play").onclick = async () => {
    hearing ??= new Hearing();
    await refreshSound();
    try {
      await hearing.play(signal.value, recording.files[0]);
    } catch (error) { say(`The recording cannot be played: ${error.message}`, true); }
  };
  byId("stop").onclick = () => hearing?.stop();
  byId("hearA").onchange = (event) => hearing.hear(event.target.checked ? shown.heardA : shown.heard);
}

// A quarter of the packets: an interval twice as wide as the listener's is still a fraction of a colour.
const MAP_STEPS = 2;
// A map of one parameter; all are asked for at once.
function maps() {
  const parameter = byId("shown"), band = byId("band");
  ["L", "G", "EDT", "T20", "T30", "C50", "C80", "D50", "Ts"].forEach((symbol) => parameter.append(make("option", symbol)));
  parameter.value = "C80";
  ["mid", ...shown.room.bands.map(hertz)].forEach((text) => band.append(make("option", text)));
  // About 60 places: each takes as long as the first numbers of the listener.
  const [a, b] = view.box.getSize(new THREE.Vector3()).projectOnPlane(new THREE.Vector3(...shown.room.up)).toArray().map(Math.abs).sort((one, other) => other - one);
  byId("spacing").value = Math.max(0.2, Math.sqrt(a * b / 60)).toFixed(1);
  const painting = new Newest(async (wish, isNewest) => {
    for (const batches of shown.steps.slice(0, MAP_STEPS)) {
      const answer = await server.ask("grid", { ...wish, window: server.window, batches });
      if (!isNewest()) return;
      shown.map = answer;
      paint();
    }
  });
  painting.failed = (error) => say(error.message, true);
  byId("paint").onclick = () => {
    say("Rendering the map …");
    painting.wish({ height: Number(byId("height").value), spacing: Number(byId("spacing").value), source: shown.source, changes: shown.changes });
  };
  parameter.onchange = band.onchange = paint;
  byId("unpaint").onclick = () => { painting.number++; shown.map = null; view.unpaint(); byId("unpaint").hidden = true; byId("mapped").replaceChildren(); say(""); };
}

function paint() {
  if (!shown.map) return;
  const { symbol, unit, noticeable, single, bands } = shown.map.parameters[byId("shown").selectedIndex];
  const at = byId("band").selectedIndex, entries = at === 0 ? single : bands[at - 1];
  const values = entries.filter(Array.isArray).map(([value]) => value);
  if (!values.length) return say(`${symbol} has no value on this plane`, true);
  const range = [Math.min(...values), Math.max(...values)];
  // A line every JND, or every few: at most twelve.
  const step = noticeable * Math.max(1, Math.ceil((range[1] - range[0]) / noticeable / 12));
  const levels = Array.from({ length: 12 }, (_, index) => step * (Math.ceil(range[0] / step) + index)).filter((level) => level < range[1]);
  view.paint(shown.map.at, shown.map.spacing, entries, range, levels);
  byId("unpaint").hidden = false;
  const scale = make("span");
  scale.id = "scale";
  scale.style.background = `linear-gradient(to right, ${RAMP.map((color) => `rgb(${color})`).join(",")})`;
  const digits = decimals(range[1], noticeable);
  say("");
  byId("mapped").replaceChildren(`${symbol} [${unit || "1"}] ${range[0].toFixed(digits)}`, scale,
    `${range[1].toFixed(digits)}: ${((range[1] - range[0]) / noticeable).toFixed(1)} JND over ${values.length} places, a line every ${step.toFixed(digits)}. Point at one for its interval. ${shown.map.note ?? ""}`);
}

async function library() {
  const entries = byId("entries"), target = byId("target"), words = byId("words");
  if (!target.options.length) shown.room.materials.forEach((material) => target.append(make("option", material.name)));
  const search = async () => {
    try {
      shown.entries = await server.ask("materials", { words: words.value });
    } catch (error) { return say(error.message, true); }
    entries.replaceChildren(...shown.entries.map(({ name, text }) => Object.assign(make("option", name), { title: text })));
    byId("apply").disabled = !shown.entries.length || !shown.steps.length;
  };
  words.oninput = search;
  byId("apply").onclick = () => {
    const entry = shown.entries[entries.selectedIndex], material = shown.room.materials[target.selectedIndex];
    if (!entry.absorption) return say(`${entry.name} has no absorption in the library`, true);
    changeMaterial(material, entry.absorption);
  };
  await search();
}

async function save() {
  try {
    const { files, commands } = await server.ask("save", { listener: shown.listener, changes: shown.changes });
    const written = files.length ? `# written: ${files.join(", ")}\n` : "# nothing was changed: no file is needed\n";
    byId("saved").textContent = written + commands.join("\n");
  } catch (error) { say(error.message, true); }
}
