// The page: joins room, report, and what the server answers.
"use strict";
// What is shown, and of the map that the server has.
const shown = { page: null, room: null, pair: null, kept: null, maps: 0, steps: [], map: null, over: null };
// What the reader wants: one state. An answer is valid as long as it is of this state and of the newest map.
const wanted = { listener: null, source: 0, changes: {}, sources: [], kept: null, receivers: [] };
let view, server, hearing;

async function start() {
  document.head.append(make("script", await unpacked("libraries")));
  const page = JSON.parse(await unpacked("content"));
  Object.assign(shown, { page, room: page.rooms[0] });
  if (page.live) {
    document.body.classList.add("served");
    server = new Server(page.live.token);
    byId("results").before(byId("view"));
    byId("side").append(byId("curves"), byId("faultsSection"));
    byId("about").before(byId("over"));
  }
  showReport(page);
  byId("detailsSection").hidden = !byId("details").children.length;
  view = new RoomView(shown.room, server && moveListener, dropSource);
  // The dot of the reflection that is pointed at.
  view.onHover = (way) => byId("early").querySelectorAll("circle").forEach((dot) => dot.setAttribute("r", way && dot.dataset.label.endsWith(`: ${way.delay}`) ? 7 : 3));
  byId("whole").onclick = () => view.whole();
  byId("above").onclick = () => view.above();
  byId("wire").onchange = (event) => view.setWire(event.target.checked);
  byId("cut").oninput = byId("across").onchange = () => view.setCut(Number(byId("cut").value), byId("across").value);
  byId("axes").onchange = (event) => view.setAxes(event.target.checked);
  byId("png").onclick = () => view.picture()?.toBlob((blob) => download("room.png", blob));
  byId("ways").onchange = showWays;
  const choose = byId("pair");
  page.pairs.forEach((pair) => choose.append(make("option", pairName(page, pair))));
  const chosen = () => {
    const pair = page.pairs[choose.selectedIndex], room = page.rooms[page.designs[pair.design].room];
    if (room !== view.room) view.load(room);
    show(pair);
    view.moveListener(pair.at);
  };
  choose.onchange = chosen;
  byId("choose").hidden = page.pairs.length < 2;
  if (page.pairs.length) chosen();
  byId("curves").hidden = !page.pairs.length;
  const picture = () => { if (byId("picture")) byId("picture").src = view.picture()?.toDataURL() ?? ""; };
  picture();
  addEventListener("beforeprint", picture);
  if (server) serve();
}

// A source at a receiver: from the file, or as the server answers. Charts may wait for the last step.
function show(pair, hasCharts = true, isPart = false) {
  shown.pair = pair;
  showParameters(pair, shown.kept, isPart);
  showWays();
  if (hasCharts) showCurves(pair); else showOver(pair);
}

function showWays() {
  const choice = byId("ways").value, most = { none: -1, all: Infinity }[choice] ?? Number(choice), { pair } = shown;
  const whole = pair?.curves?.ways.map((way) => ({ ...way, corners: [pair.at, ...way.corners, pair.sourceAt] }));
  view.showWays(whole ?? [], most);
}

// From here on a server answers.

const isChanged = () => Object.keys(wanted.changes).length > 0;
const isSame = (values, others) => values.every((value, band) => Math.abs(value - others[band]) < 1e-9);

// What a field holds; where that is no number from `low` to `high`, the field returns to what it showed.
function entered(input, before, low = -Infinity, high = Infinity) {
  const value = input.valueAsNumber;
  if (value >= low && value <= high && Math.abs(value) < 1e6) return value;
  input.value = before;
  say(high === 1 ? "a coefficient is between 0 and 1" : "a coordinate is a number of metres", true);
  return null;
}

// What a material is wanted to have.
const own = (material, key) => wanted.changes[`materials.${material.name}.${key}`] ?? material[key];
const COEFFICIENTS = ["absorption", "scattering", "transmission"];

// Materials with their means and their share of all absorption; of the chosen one fields for every band.
function showMaterials() {
  const { materials } = shown.room, mean = (values) => values.reduce((sum, value) => sum + value, 0) / values.length;
  const absorbing = materials.map((material) => material.area * mean(own(material, "absorption")));
  const total = absorbing.reduce((sum, area) => sum + area, 0) || 1;
  const rows = materials.map((material, index) => {
    const name = make("td"), swatch = make("span", "", "swatch");
    swatch.style.background = colorOf(index);
    name.append(swatch, material.name, COEFFICIENTS.some((key) => wanted.changes[`materials.${material.name}.${key}`]) ? " (changed)" : "");
    return [name, material.area.toFixed(1), `${(100 * absorbing[index] / total).toFixed(0)} %`, mean(own(material, "absorption")).toFixed(2), mean(own(material, "scattering")).toFixed(2)];
  });
  byId("materials").replaceChildren(...table(["material", "area [m²]", "share", "α", "s"], rows).firstChild.children);
  [...byId("materials").tBodies[0].rows].forEach((row, index) => {
    row.dataset.name = materials[index].name;
    row.tabIndex = 0;
    row.classList.toggle("chosen", index === shown.material);
    row.onclick = () => chooseMaterial(index);
    row.onkeydown = (event) => { if (event.key === "Enter") chooseMaterial(index); };
  });
  byId("original").hidden = !isChanged();
  showBands(materials[shown.material]);
}

function chooseMaterial(index) {
  shown.material = index;
  showMaterials();
}

function showBands(material) {
  const { bands } = shown.room, key = byId("coefficient").value, values = own(material, key), focused = document.activeElement?.ariaLabel;
  byId("chosen").textContent = material.name;
  byId("law").textContent = [material.law === "uniform" ? "" : `law: ${material.law}`, material.source].filter(Boolean).join("; ");
  byId("bands").replaceChildren(...values.map((value, band) => {
    const place = make("label", hertz(bands[band])), written = Number(value.toFixed(4));
    const input = Object.assign(make("input"), { type: "number", min: 0, max: 1, step: 0.01, value: written });
    input.setAttribute("aria-label", `${key} of ${material.name} at ${hertz(bands[band])}`);
    input.onchange = () => {
      const changed = entered(input, written, 0, 1);
      if (changed === null) return;
      // Fields are made anew when the next one has the focus.
      setTimeout(() => changeMaterial(material, values.map((old, at) => at === band ? changed : old), key));
    };
    place.append(input);
    return place;
  }));
  [...byId("bands").querySelectorAll("input")].find(({ ariaLabel }) => ariaLabel === focused)?.focus();
  const line = (name, mark, values) => ({ name, mark, points: values.map((value, band) => [bands[band], value]) });
  drawChart(byId("overBands"), { title: "", x: { label: "band [Hz]", scale: "Logarithmic", ticks: thirds(bands) }, y: { label: key, range: [0, 1] },
    series: [line("now", "PointsAndLine", values), ...values === material[key] ? [] : [line("in the map", "Dashed", material[key])]] }, { height: 200 });
}

function showFaults() {
  const { faults } = shown.room;
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

const same = (one, other) => JSON.stringify(one) === JSON.stringify(other);
const placesOf = (room) => room.sources.map(({ at }) => at);
const wish = () => ({ listener: wanted.listener, source: wanted.source, changes: { ...wanted.changes } });
// Whether an answer of a map to a wish is of the state that is wanted.
const isWanted = (answer, of) => answer.map === shown.maps && same(of, wish()) && same(wanted.sources, placesOf(shown.room));

const rendering = new Steps("render", (answer, of, { isFirst, isLast }) => {
  show(answer.pair, isLast, answer.batches !== null);
  shown.of = { answer, wish: of };
  check();
  if (!shown.isStale) byId("retrace").hidden = true;
  if (isFirst && !shown.isStale) say([shown.failure, ...answer.warnings].filter(Boolean).join(" "), Boolean(shown.failure));
  if (isFirst && hearing?.source) refreshSound();
  if (isLast) recallA();
});
rendering.failed = (error) => {
  say(error.message, true);
  byId("retrace").hidden = !(isChanged() && shown.canTrace);
};

// Numbers and charts of another state than the wanted one are grey, and nothing can be kept or saved of them.
function check() {
  const is = !shown.of || !isWanted(shown.of.answer, shown.of.wish);
  shown.isStale = is;
  byId("side").classList.toggle("stale", is);
  // Charts come with the last numbers.
  byId("curves").classList.toggle("stale", is || !shown.pair.curves);
  byId("parameters").setAttribute("aria-busy", String(is));
  byId("keep").disabled = byId("save").disabled = byId("csv").disabled = is;
}

// The address says the state, and is a step that can be undone; steps within a second are one, as of a drag.
function remember() {
  const address = `#${encodeURIComponent(JSON.stringify({ ...wish(), kept: wanted.kept, receivers: same(wanted.receivers, shown.room.receivers) ? undefined : wanted.receivers }))}`;
  if (address === location.hash) return;
  const isOne = performance.now() - (shown.remembered ?? 0) < 1000;
  history[isOne || !location.hash ? "replaceState" : "pushState"](null, "", address);
  shown.remembered = performance.now();
}

// What follows every change of the state: what was written of another one goes.
function changed(isMoved = false) {
  if (!shown.isRestored) remember();
  byId("saved").replaceChildren();
  byId("retrace").hidden = true;
  if (!isMoved) removeMap();
  render();
}

// Numbers of batches: few for numbers at once; all, as the commands that are shown. What is deterministic is found anew in each step.
const steps = () => [...shown.steps.slice(0, -1).slice(0, 1), null];
function render() {
  check();
  // Until a moved source is traced, every answer would be of its former place.
  if (!shown.steps.length || !same(wanted.sources, placesOf(shown.room))) return;
  say("");
  rendering.wish(wish(), steps());
}

function say(text, isBad = false) {
  byId("job").replaceChildren(make("span", text, isBad ? "bad" : ""));
}

// So exact are the commands that are saved.
const millimetres = (at) => at.map((value) => Math.round(1000 * value) / 1000);
function moveListener(at) {
  wanted.listener = millimetres(at);
  ["x", "y", "z"].forEach((axis, index) => { byId(axis).value = wanted.listener[index]; });
  showStand();
  view.moveListener(wanted.listener);
  changed(true);
}

// A source that was dragged sends from there when the scene has been traced anew.
function dropSource(source, at) {
  trace(wanted.sources.map((own, index) => index === source ? millimetres(at) : own));
}

function changeMaterial(material, values, key = "absorption") {
  const name = `materials.${material.name}.${key}`;
  if (isSame(values, material[key])) delete wanted.changes[name]; else wanted.changes[name] = values;
  showMaterials();
  changed();
}

function serve() {
  const { room } = shown, source = byId("source");
  byId("coefficient").onchange = showMaterials;
  shown.material = 0;
  tabs();
  showFaults();
  wanted.sources = placesOf(room);
  room.sources.forEach((one) => source.append(make("option", one.name)));
  source.onchange = () => { wanted.source = source.selectedIndex; changed(); };
  ["x", "y", "z"].forEach((axis, index) => {
    byId(axis).onchange = () => {
      const value = entered(byId(axis), wanted.listener[index]);
      if (value !== null) moveListener(wanted.listener.map((old, at) => at === index ? value : old));
    };
  });
  const stand = byId("stand");
  stand.onchange = () => moveListener(stand.selectedIndex ? wanted.receivers[stand.selectedIndex - 1].at : wanted.listener);
  byId("add").onclick = () => {
    const names = wanted.receivers.map(({ name }) => name), free = names.map((_, index) => `receiver ${index + 1}`).find((name) => !names.includes(name));
    changeReceivers([...wanted.receivers, { name: free ?? `receiver ${names.length + 1}`, at: wanted.listener }]);
  };
  byId("places").onclick = () => download("receivers.csv", csv([["name", "x", "y", "z"], ...wanted.receivers.map(({ name, at }) => [name, ...at])]));
  byId("csv").onclick = () => download("numbers.csv", csv([CSV_HEAD, ...shown.pair.parameters.flatMap((row) => csvRows(row, wanted.listener, shown.pair.bands))]));
  view.onPick = ({ receiver, material }) => {
    if (receiver !== undefined) return moveListener(wanted.receivers[receiver].at);
    chooseMaterial(material);
    openTab("materialsSection");
  };
  walkByKeys();
  byId("undo").onclick = () => history.back();
  addEventListener("popstate", () => { if (location.hash) restore(wanted.listener); });
  addEventListener("keydown", (event) => {
    if (event.key === "z" && (event.ctrlKey || event.metaKey) && event.target.tagName !== "INPUT") history.back();
  });
  const middle = view.world(view.box.getCenter(new THREE.Vector3()));
  const first = room.receivers[0]?.at ?? middle;
  compare();
  restore(first);
  listen();
  maps();
  byId("original").onclick = () => { wanted.changes = {}; showMaterials(); changed(); };
  byId("retrace").onclick = () => trace(wanted.sources);
  byId("move").onclick = () => {
    const places = wanted.sources.with(wanted.source, wanted.listener), [x, y, z] = wanted.sources[wanted.source];
    trace(places);
    moveListener([x, y, z]);
  };
  byId("save").onclick = save;
  library();
  follow();
}

// The state that the address says, as far as it is one of this room.
function restore(first) {
  let state = {};
  try { state = JSON.parse(decodeURIComponent(location.hash.slice(1))); } catch { /* Not an address of ours. */ }
  if (state.source in wanted.sources) byId("source").selectedIndex = wanted.source = state.source;
  wanted.changes = { ...state.changes };
  wanted.kept = state.kept ?? null;
  showReceivers(state.receivers ?? shown.room.receivers);
  shown.isRestored = Boolean(state.listener);
  moveListener(state.listener ?? first);
  showMaterials();
  removeMap();
  shown.isRestored = false;
  if (!same(wanted.kept, shown.keptAt ?? null)) forgetA();
}

function changeReceivers(receivers) {
  showReceivers(receivers);
  showStand();
  remember();
  byId("saved").replaceChildren();
}

// The receiver that the listener is at.
function showStand() {
  byId("stand").selectedIndex = 1 + wanted.receivers.findIndex((one) => same(millimetres(one.at), wanted.listener));
}

// The list of receivers: a name can be written over, a click leads there.
function showReceivers(receivers) {
  wanted.receivers = receivers;
  view.placeReceivers(receivers);
  byId("stand").replaceChildren(...["anywhere", ...receivers.map(({ name }) => name)].map((name) => make("option", name)));
  byId("places").disabled = !receivers.length;
  const rows = receivers.map(({ name, at }, index) => {
    const own = make("td"), input = Object.assign(make("input"), { value: name, ariaLabel: `name of receiver ${index + 1}` });
    input.onchange = () => {
      const isFree = input.value.trim() && receivers.every((one) => one.name !== input.value.trim());
      if (isFree) return changeReceivers(receivers.with(index, { name: input.value.trim(), at }));
      input.value = name;
      say("a receiver has a name of its own", true);
    };
    own.append(input);
    const acts = make("td"), [go, remove] = ["Go", "Remove"].map((text) => Object.assign(make("button", text), { ariaLabel: `${text} ${text === "Go" ? "to " : ""}${name}` }));
    go.onclick = () => moveListener(at);
    remove.onclick = () => changeReceivers(receivers.toSpliced(index, 1));
    acts.append(go, " ", remove);
    return [own, ...at.map((value) => value.toFixed(2)), acts];
  });
  byId("receivers").replaceChildren(...table(["name", "x [m]", "y [m]", "z [m]", "actions"], rows).firstChild.children);
}

// Values as a table for other programs.
const CSV_HEAD = ["source", "x_m", "y_m", "z_m", "parameter", "unit", "band_hz", "value", "half_width", "missing"];
const csv = (rows) => rows.map((row) => row.map((text) => /[",\n]/.test(text) ? `"${`${text}`.replaceAll('"', '""')}"` : text).join()).join("\n") + "\n";
function csvRows({ symbol, unit, single, values }, at, bands) {
  const line = (band, entry) => [shown.room.sources[wanted.source].name, ...at, symbol, unit, band, ...isKnown(entry) ? [entry[0], typeof entry[1] === "number" ? entry[1] : "", ""] : ["", "", entry]];
  return [line("mid", single), ...values.map((entry, band) => line(bands[band], entry))];
}
function download(name, content) {
  const link = Object.assign(make("a"), { href: URL.createObjectURL(new Blob([content])), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// Parts of the panel, one at a time.
const TABS = { numbers: "Numbers", curves: "Curves", materialsSection: "Materials", receiving: "Receivers", mapping: "Map", sounding: "Sound", saving: "Save", faultsSection: "Check" };
function tabs() {
  for (const [id, name] of Object.entries(TABS)) {
    if (id === "faultsSection" && !shown.room.faults.length) continue;
    const tab = make("button", id === "faultsSection" ? `${name} (${shown.room.faults.length})` : name);
    tab.setAttribute("role", "tab");
    tab.setAttribute("aria-controls", id);
    tab.onclick = () => openTab(id);
    byId("tabs").append(tab);
  }
  openTab("numbers");
}
function openTab(chosen) {
  for (const tab of byId("tabs").children) tab.setAttribute("aria-selected", String(tab.getAttribute("aria-controls") === chosen));
  for (const id of Object.keys(TABS)) byId(id).classList.toggle("closed", id !== chosen);
}

function walkByKeys() {
  const step = 0.1, up = new THREE.Vector3(...shown.room.up);
  const ways = { ArrowLeft: [-1, 0, 0], ArrowRight: [1, 0, 0], ArrowUp: [0, 1, 0], ArrowDown: [0, -1, 0], PageUp: [0, 0, 1], PageDown: [0, 0, -1] };
  byId("room").addEventListener("keydown", (event) => {
    const way = ways[event.key], nearer = { "+": 0.9, "-": 1 / 0.9 }[event.key];
    if (!way && !nearer && event.key !== "Home") return;
    event.preventDefault();
    if (event.key === "Home") return view.whole();
    if (nearer) return view.turn(0, 0, nearer);
    if (event.shiftKey) return view.turn(0.1 * way[0], 0.1 * (way[1] + way[2]));
    const side = new THREE.Vector3().setFromMatrixColumn(view.camera.matrixWorld, 0).projectOnPlane(up).normalize();
    const ahead = new THREE.Vector3().crossVectors(up, side);
    const moved = new THREE.Vector3().addScaledVector(side, way[0]).addScaledVector(ahead, way[1]).addScaledVector(up, way[2]);
    moveListener(wanted.listener.map((value, index) => value + step * moved.getComponent(index)));
  });
}

// The trace, as far as it is; a new map is rendered.
async function follow() {
  let wait = 1000;
  shown.next = null;
  try {
    const state = await server.ask("state");
    if (shown.isLost) {
      shown.isLost = false;
      render();
    }
    // An editor has written the scene.
    if (shown.page.live.number !== state.pages) return location.reload();
    shown.canTrace = state.can_trace;
    shown.share = state.share;
    byId("move").disabled = !state.can_trace;
    view.canTrace = state.can_trace;
    if (state.share !== null) {
      wait = isTraced() ? 150 : 10;
      const bar = Object.assign(make("progress"), { max: 1, value: state.share });
      bar.setAttribute("aria-label", "progress of the trace");
      byId("job").replaceChildren("Tracing the scene … ", bar);
    }
    if (state.failure !== shown.failure) {
      shown.failure = state.failure;
      if (state.failure) refuse(state.failure);
    }
    if (state.map && state.maps !== shown.maps) {
      shown.maps = state.maps;
      shown.steps = state.map.steps;
      offer(state.map.parameters);
      const isOwn = same(wanted.sources, placesOf(shown.room));
      state.map.sources.forEach((at, index) => { shown.room.sources[index].at = at; });
      // A source that was moved since is traced next.
      if (isOwn || state.share === null) wanted.sources = state.map.sources;
      view.placeSources(wanted.sources);
      // Another window may have had the scene traced with other materials.
      shown.room.materials.forEach((material) => Object.assign(material, state.map.materials[material.name]));
      for (const [name, values] of Object.entries(wanted.changes)) {
        const [, own, key] = name.match(/^materials\.(.*)\.(\w+)$/);
        const material = shown.room.materials.find((one) => one.name === own);
        if (!material || isSame(values, material[key])) delete wanted.changes[name];
      }
      showMaterials();
      removeMap();
      say(state.messages.join(" ") || `${state.map.packets.toLocaleString("en")} packets a source.`);
      const said = byId("job").textContent;
      render();
      say(said);
      library();
    }
  } catch (error) {
    wait = 3000;
    shown.isLost = true;
    say(`sonel-view does not answer: ${error.message}`, true);
  }
  shown.next = setTimeout(follow, wait);
}

// Whether there is a map of the sources where they are.
const isTraced = () => shown.maps > 0 && same(wanted.sources, placesOf(shown.room));

async function trace(sources) {
  wanted.sources = sources;
  view.placeSources(sources);
  changed();
  try {
    await server.ask("trace", { sources, changes: wanted.changes });
    shown.failure = null;
    byId("retrace").hidden = true;
    if (shown.next) {
      clearTimeout(shown.next);
      follow();
    }
  } catch (error) { refuse(error.message); }
}

// A source that was dragged is again where the map has it.
function refuse(message) {
  if (!same(wanted.sources, placesOf(shown.room))) {
    wanted.sources = placesOf(shown.room);
    view.placeSources(wanted.sources);
    render();
  }
  say(message, true);
}

function compare() {
  byId("keep").onclick = () => {
    wanted.kept = wish();
    remember();
    keepA(shown.pair);
  };
  byId("forget").onclick = () => {
    wanted.kept = null;
    remember();
    forgetA();
  };
}

// A and what it is; differences are shown in just-noticeable differences.
function keepA(pair) {
  const { kept } = wanted, materials = Object.keys(kept.changes).length ? "changed materials" : "the materials of the map";
  Object.assign(shown, { kept: pair, keptAt: kept });
  byId("isA").textContent = `A: ${pair.source} → (${kept.listener.join(", ")}) m, ${materials}. Differences in just-noticeable ones (JND).`;
  byId("forget").hidden = false;
  setSoundOfA(null);
  if (hearing?.source) recallSoundOfA();
  showParameters(shown.pair, shown.kept);
}

function forgetA() {
  Object.assign(shown, { kept: null, keptAt: null });
  byId("forget").hidden = true;
  byId("isA").textContent = "";
  setSoundOfA(null);
  if (shown.pair) showParameters(shown.pair, null);
}

// What A sounds like; both have its gain from then on.
function setSoundOfA(samples) {
  byId("hearing").hidden = !samples;
  byId("hearA").checked &&= Boolean(samples);
  if (!hearing) return;
  hearing.before = samples;
  if (shown.heard) hearing.hear(byId("hearA").checked ? samples : shown.heard);
}

async function recallSoundOfA() {
  const { kept } = wanted;
  try {
    const samples = await server.ask("sound", { ...kept, window: `${server.window}A`, batches: null });
    if (same(kept, wanted.kept)) setSoundOfA(samples);
  } catch (error) { say(`A: ${error.message}`, true); }
}

// The A of an address is rendered again.
async function recallA() {
  const { kept } = wanted;
  if (!kept || same(kept, shown.keptAt) || !shown.steps.length) return;
  try {
    const { pair } = await server.ask("render", { ...kept, window: `${server.window}A`, batches: null });
    if (same(kept, wanted.kept)) keepA(pair);
  } catch (error) { say(`A: ${error.message}`, true); }
}

// From few batches first: what is played, and a walk, is heard at once.
const sounding = new Steps("sound", (samples, of) => {
  if (!same(of, wish())) return;
  shown.heard = samples;
  if (!byId("hearA").checked) hearing.hear(samples);
});
sounding.failed = (error) => say(error.message, true);
const refreshSound = () => sounding.wish(wish(), [shown.steps[0], null]);

function listen() {
  const recording = byId("recording"), signal = byId("signal");
  signal.onchange = () => { recording.hidden = signal.value !== "file"; };
  byId("play").onclick = async () => {
    if (signal.value === "file" && !recording.files[0]) return say("choose a recording first", true);
    hearing ??= new Hearing();
    try {
      await hearing.play(signal.value, recording.files[0]);
      await refreshSound();
      if (wanted.kept && !hearing.before) await recallSoundOfA();
    } catch (error) { say(`The recording cannot be played: ${error.message}`, true); }
  };
  byId("stop").onclick = () => hearing?.stop();
  byId("hearA").onchange = (event) => hearing?.hear(event.target.checked ? hearing.before : shown.heard);
}

// A quarter of the packets: an interval twice as wide as the listener's is still a fraction of a colour.
const MAP_STEPS = 2;
// Parameters to choose from, in the order in which the server sends their maps.
function offer(symbols) {
  const parameter = byId("shown"), chosen = parameter.value || "C80";
  parameter.replaceChildren(...symbols.map((symbol) => make("option", symbol)));
  parameter.value = chosen;
}

// A map of one parameter; all are asked for at once.
function maps() {
  const parameter = byId("shown"), band = byId("band");
  ["mid", ...shown.room.bands.map(hertz)].forEach((text) => band.append(make("option", text)));
  // About 60 places: each takes as long as the first numbers of the listener.
  const [a, b] = view.box.getSize(new THREE.Vector3()).projectOnPlane(new THREE.Vector3(...shown.room.up)).toArray().map(Math.abs).sort((one, other) => other - one);
  byId("spacing").value = Math.max(0.2, Math.sqrt(a * b / 60)).toFixed(1);
  painting.failed = (error) => say(error.message, true);
  byId("paint").onclick = () => {
    removeMap();
    say("Rendering the map …");
    const wish = { height: Number(byId("height").value), spacing: Number(byId("spacing").value), source: wanted.source, changes: wanted.changes };
    painting.wish(wish, shown.steps.slice(0, MAP_STEPS));
  };
  parameter.onchange = band.onchange = paint;
  byId("unpaint").onclick = () => { removeMap(); say(""); };
  byId("mapCsv").onclick = () => {
    const { at, parameters } = shown.map, row = parameters[byId("shown").selectedIndex];
    download("map.csv", csv([CSV_HEAD, ...at.flatMap((place, index) => csvRows({ ...row, single: row.single[index], values: row.bands.map((band) => band[index]) }, place, shown.room.bands))]));
  };
}

const painting = new Steps("grid", (answer) => {
  shown.map = { ...answer, from: shown.room.sources[wanted.source].name, height: byId("height").value };
  paint();
});

// A map of another source or of other materials would be taken for one of these.
function removeMap() {
  painting.drop();
  shown.map = null;
  view.unpaint();
  byId("unpaint").hidden = byId("mapCsv").hidden = true;
  byId("mapped").replaceChildren();
}

function paint() {
  if (!shown.map) return;
  const { symbol, unit, noticeable, single, bands } = shown.map.parameters[byId("shown").selectedIndex];
  const at = byId("band").selectedIndex, entries = at === 0 ? single : bands[at - 1];
  const values = entries.filter(isKnown).map(([value]) => value);
  if (!values.length) return say(`${symbol} has no value on this plane`, true);
  const range = [Math.min(...values), Math.max(...values)];
  // A line every JND, or every few: at most twelve.
  const step = noticeable * Math.max(1, Math.ceil((range[1] - range[0]) / noticeable / 12));
  const levels = Array.from({ length: 12 }, (_, index) => step * (Math.ceil(range[0] / step) + index)).filter((level) => level < range[1]);
  view.paint(shown.map.at, shown.map.spacing, entries, unit, range, levels);
  byId("unpaint").hidden = byId("mapCsv").hidden = false;
  const scale = make("span");
  scale.id = "scale";
  scale.style.background = `linear-gradient(to right, ${RAMP.map((color) => `rgb(${color})`).join(",")})`;
  say("");
  const band = at === 0 ? "500 and 1000 Hz" : hertz(shown.room.bands[at - 1]);
  scale.setAttribute("role", "img");
  scale.setAttribute("aria-label", "to");
  byId("mapped").replaceChildren(`${symbol} [${unit || "1"}] at ${band}, from ${shown.map.from}, ${shown.map.height} m high: ${rounded(range[0], unit)} `, scale,
    ` ${rounded(range[1], unit)}: ${((range[1] - range[0]) / noticeable).toFixed(1)} JND over ${values.length} places, a line every ${rounded(step, unit)}. Point at one for its interval. ${shown.map.note ?? ""}`);
}

async function library() {
  const entries = byId("entries"), words = byId("words");
  const search = async () => {
    try {
      shown.entries = await server.ask("materials", { words: words.value });
    } catch (error) { return say(error.message, true); }
    entries.replaceChildren(...shown.entries.map(({ name, text }) => Object.assign(make("option", name), { title: text })));
    byId("apply").disabled = !shown.entries.length || !shown.steps.length;
  };
  words.oninput = search;
  byId("apply").onclick = () => {
    const entry = shown.entries[entries.selectedIndex], material = shown.room.materials[shown.material];
    if (!entry.absorption) return say(`${entry.name} has no absorption in the library`, true);
    changeMaterial(material, entry.absorption);
  };
  await search();
}

async function save() {
  try {
    const { files, commands } = await server.ask("save", { listener: wanted.listener, changes: wanted.changes, receivers: same(wanted.receivers, shown.room.receivers) ? [] : wanted.receivers.map(({ name, at }) => [name, at]) });
    const written = files.length ? `# written: ${files.join(", ")}\n` : "# nothing was changed: no file is needed\n";
    byId("saved").textContent = written + commands.join("\n");
  } catch (error) { say(error.message, true); }
}
