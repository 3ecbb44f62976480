// Drives the page of sonel-view in a real browser as a user does, and measures a frozen page: node view.mjs PROGRAM FILE FOLDER PAGE.
// Prints what it measured as JSON; fails where a script fails or the page does not do what it says.
import { chromium } from "playwright-core";
import { spawn } from "node:child_process";
import { readFileSync, writeFileSync } from "node:fs";

const [program, file, folder, report] = process.argv.slice(2);
const PATIENCE = { timeout: 60000 };
const AXE = readFileSync(new URL("node_modules/axe-core/axe.min.js", import.meta.url), "utf8");
const server = spawn(program, [file, "--no-open", "--quiet"]);
const address = await new Promise((found) => {
  let text = "";
  server.stdout.on("data", (data) => { text += data; if (text.includes("\n")) found(text.trim()); });
});
const browser = await chromium.launch({ executablePath: "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-gl=swiftshader", "--enable-unsafe-swiftshader", "--autoplay-policy=no-user-gesture-required"] });
const measured = { latency_ms: {} };
try {
  const page = await browser.newPage({ viewport: { width: 1400, height: 1000 }, bypassCSP: true });
  const failures = [];
  page.on("pageerror", (error) => failures.push(error.message));
  // Where the page's policy is off for axe, the browser asks for an icon.
  const isOurs = (message) => message.type() === "error" && !message.location().url.endsWith("/favicon.ico");
  page.on("console", (message) => { if (isOurs(message)) failures.push(message.text()); });
  const check = (holds, what) => { if (!holds) throw new Error(what); };
  const settled = () => page.waitForFunction(() => shown.share === null && shown.of?.answer.batches === null && !shown.isStale, null, PATIENCE);
  const values = (key) => page.$eval(`tr[data-key=${key}]`, (row) => [...row.querySelectorAll("td")].map((place) => Number(place.dataset.value)));
  const latency = async (name, act) => {
    await page.evaluate(() => {
      window.redrawn = null;
      new MutationObserver((_, observer) => { window.redrawn = performance.now(); observer.disconnect(); }).observe(byId("parameters"), { childList: true });
      window.begun = performance.now();
    });
    await act();
    await page.waitForFunction(() => window.redrawn, null, PATIENCE);
    measured.latency_ms[name] = Math.round(await page.evaluate(() => window.redrawn - window.begun));
    await settled();
  };

  await page.goto(address);
  await settled();
  check((await page.locator("#curves .chart svg").count()) >= 3, "charts are drawn");
  const ways = await page.evaluate(() => view.ways.children.length);
  check(ways >= 1, "early reflections are drawn");

  // What a screen reader needs, in every part of the panel.
  const accessible = async (where) => {
    await page.evaluate(AXE);
    const { violations } = await page.evaluate(() => axe.run());
    check(!violations.length, `axe on ${where}: ${violations.map(({ id, nodes }) => `${id} ${nodes[0].html}`).join("; ")}`);
  };
  for (const tab of await page.$$eval("#tabs button", (tabs) => tabs.map((tab) => tab.getAttribute("aria-controls")))) {
    await page.evaluate((tab) => openTab(tab), tab);
    await accessible(tab);
  }
  await page.evaluate(() => openTab("numbers"));

  // The listener: by the keys, by the mouse, by numbers.
  const before = await page.evaluate(() => wanted.listener);
  await latency("key", async () => { await page.focus("#room"); await page.keyboard.press("ArrowUp"); });
  check(JSON.stringify(await page.evaluate(() => wanted.listener)) !== JSON.stringify(before), "an arrow key moves the listener");
  const onScreen = (which) => page.evaluate((which) => {
    const body = which === "listener" ? view.listener : view.sources[0];
    const at = body.position.clone().project(view.camera), frame = view.canvas.getBoundingClientRect();
    return [frame.left + (at.x + 1) / 2 * frame.width, frame.top + (1 - at.y) / 2 * frame.height];
  }, which);
  const spot = await onScreen("listener");
  const height = () => page.evaluate(() => wanted.listener.reduce((sum, value, axis) => sum + value * shown.room.up[axis], 0));
  const before_drag = await height();
  await page.mouse.move(...spot);
  await page.mouse.down();
  await page.mouse.move(spot[0] + 12, spot[1] + 6, { steps: 6 });
  await page.mouse.up();
  await page.waitForTimeout(300);
  await settled();
  check(Math.abs(await height() - before_drag) < 2e-3, "the mouse keeps the listener in its plane");
  await latency("moved", () => page.evaluate((at) => moveListener(at), before));
  const plain = await values("t30_s");

  // Whoever drags fast has one request at work, numbers on the way, and those of the last place at the end.
  let open = 0, most = 0;
  const isRendering = (request) => request.url().endsWith("/api/render");
  page.on("request", (request) => { if (isRendering(request)) most = Math.max(most, ++open); });
  for (const ended of ["requestfinished", "requestfailed"]) page.on(ended, (request) => { if (isRendering(request)) open--; });
  const isStale = await page.evaluate(async (at) => {
    for (let step = 0; step < 40; step++) {
      moveListener([at[0] + 1e-3 * (step % 8 + 1), at[1], at[2]]);
      await new Promise((later) => setTimeout(later, 20));
    }
    moveListener(at);
    return byId("side").classList.contains("stale");
  }, before);
  check(isStale, "numbers of another place are grey");
  await page.waitForFunction(() => !byId("side").classList.contains("stale"), null, PATIENCE);
  await settled();
  check(most <= 2, `${most} requests were open at once`);
  check(JSON.stringify(await values("t30_s")) === JSON.stringify(plain), "the numbers are those of the last place");

  // What is no number changes nothing, and the keyboard stays where it was.
  const kept = await page.evaluate(() => {
    byId("x").value = "";
    byId("x").dispatchEvent(new Event("change"));
    openTab("materialsSection");
    const input = document.querySelector("#bands input");
    input.focus();
    input.value = "1.5";
    input.dispatchEvent(new Event("change"));
    return [Number(byId("x").value) === wanted.listener[0], Object.keys(wanted.changes).length, document.activeElement === input];
  });
  check(JSON.stringify(kept) === "[true,0,true]", "fields refuse what is no number");

  // A material, compared with what was before.
  const unfold = (tab) => page.click(`#tabs button[aria-controls=${tab}]`);
  await unfold("numbers");
  await page.click("#keep");
  await latency("material", () => page.evaluate(() => {
    const material = shown.room.materials[0];
    changeMaterial(material, material.absorption.map((value) => Math.min(1, value + 0.3)));
  }));
  const changed = await values("t30_s");
  check(changed.every((value, band) => value !== plain[band]), "other materials have other times");
  check((await page.locator("#parameters .beyond").count()) >= 1, "differences beyond chance are marked");

  // Scattering is another coefficient of the same table.
  await unfold("materialsSection");
  await page.selectOption("#coefficient", "scattering");
  const scattered = await page.evaluate(() => [shown.room.materials[0].scattering[0], Number(document.querySelector("#bands input").value)]);
  check(Math.abs(scattered[0] - scattered[1]) < 1e-3, "the table shows scattering");
  await page.selectOption("#coefficient", "absorption");

  // A map of a plane.
  await unfold("mapping");
  await page.click("#paint");
  await page.waitForFunction(() => view.map.children.length > 3 && shown.map.batches === shown.steps[1], null, PATIENCE);
  check(await page.evaluate(() => view.map.children.at(-1).geometry.attributes.position.count >= 2), "lines of equal value are drawn");
  const symbols = await page.locator("#shown option").allTextContents();
  for (const symbol of symbols) {
    await page.selectOption("#shown", symbol);
    check((await page.locator("#mapped").textContent()).startsWith(`${symbol} [`), `the map of ${symbol} has its name`);
  }
  check(symbols.length >= 9, "all parameters have maps");
  await page.selectOption("#shown", "C80");
  await page.screenshot({ path: `${folder}/wide.png`, fullPage: true });

  // Sound runs.
  await unfold("sounding");
  await page.selectOption("#signal", "speech");
  const played = Date.now();
  await page.click("#play");
  await page.waitForFunction(() => hearing?.chains.length && hearing.context.state === "running", null, PATIENCE);
  await page.waitForFunction(() => {
    const samples = new Float32Array(hearing.meter.fftSize);
    hearing.meter.getFloatTimeDomainData(samples);
    return samples.some((sample) => Math.abs(sample) > 1e-3);
  }, null, PATIENCE);
  measured.latency_ms.sound = Date.now() - played;
  // A was kept before: both are heard with its gain.
  await page.waitForFunction(() => hearing.before && !byId("hearing").hidden, null, PATIENCE);
  await page.waitForFunction(() => Math.abs(hearing.chains.at(-1).level.gain.value * Math.sqrt(energies(hearing.before)[0]) / 0.35 - 1) < 1e-3, null, PATIENCE);
  await page.click("#stop");

  // Steady noise on the left channel of a file, through responses that change five times a second: both ears hear it, and nothing dips or swells.
  const walked = (breaks) => page.evaluate(async (breaks) => {
    let seed = 1;
    const random = () => { seed = (seed * 1664525 + 1013904223) % 4294967296; return seed / 2147483648 - 1; };
    const context = new OfflineAudioContext(2, 6 * RATE_HZ, RATE_HZ), walker = new Hearing(context), noise = context.createBuffer(2, RATE_HZ, RATE_HZ);
    noise.copyToChannel(Float32Array.from({ length: RATE_HZ }, random), 0);
    const response = () => Float32Array.from({ length: 2 * RATE_HZ }, (_, at) => random() * Math.exp(-6.9 * (at % RATE_HZ) / RATE_HZ));
    walker.begin(noise);
    walker.hear(response());
    for (let step = 0; step < 20; step++) context.suspend(1.5 + 0.2 * step).then(() => {
      walker.hear(response());
      if (breaks) walker.chains.slice(0, -1).forEach(({ level }) => level.disconnect());
      context.resume();
    });
    const heard = await context.startRendering(), levels = [0, 1].map((ear) => {
      const samples = heard.getChannelData(ear), window = 0.1 * RATE_HZ;
      return Array.from({ length: 45 }, (_, at) => 10 * Math.log10(samples.subarray((at + 15) * window, (at + 16) * window).reduce((sum, value) => sum + value * value, 0)));
    });
    return [Math.max(...levels.flat()) - Math.min(...levels.flat()), walker.chains.length];
  }, breaks);
  const [range, rings] = await walked(false), [broken] = await walked(true);
  check(range < 2 && rings > 2, `steady noise varies by ${range} dB on a walk`);
  check(broken > 3, `a walk that loses its reverberation goes unnoticed: ${broken} dB`);
  measured.walk_db = range;

  // Receivers are added, renamed and removed, each step can be undone; numbers, places and the picture are files.
  await unfold("receiving");
  const names = () => page.$$eval("#receivers input", (inputs) => inputs.map(({ value }) => value));
  const known = await names();
  await page.click("#add");
  check((await names()).length === known.length + 1 && await page.evaluate(() => view.receivers.length === wanted.receivers.length), "a receiver is added");
  await page.fill("#receivers tr:last-child input", "front row, \"A\"");
  await page.press("#receivers tr:last-child input", "Enter");
  const saved = async (button) => readFileSync(await (await Promise.all([page.waitForEvent("download"), page.click(button)]))[0].path());
  const places = String(await saved("#places"));
  check(places.startsWith("name,x,y,z\n") && places.split("\n").at(-2).startsWith('"front row, ""A""",'), `places as a file: ${places}`);
  await unfold("numbers");
  // What is missing has its reason in quotes.
  const cells = String(await saved("#csv")).trim().split("\n").map((line) => line.replace(/"(?:[^"]|"")*"/g, "quoted").split(","));
  check(cells.every((line) => line.length === cells[0].length) && cells.filter((line) => line[4] === "T30").length === plain.length, "numbers as a file");
  check((await saved("#png")).subarray(1, 4).toString() === "PNG", "the view as a file");
  await unfold("receiving");
  await page.click("#receivers tr:last-child button >> nth=1");
  check(JSON.stringify(await names()) === JSON.stringify(known), "a receiver is removed");

  // The view by keys and the cut.
  const looks = await page.evaluate(() => {
    const at = [], look = () => at.push(view.camera.position.toArray().map((value) => value.toFixed(3)).join());
    const press = (key, shiftKey) => { byId("room").dispatchEvent(new KeyboardEvent("keydown", { key, shiftKey, cancelable: true })); look(); };
    press("Home");
    for (const key of ["ArrowLeft", "ArrowUp"]) press(key, true);
    for (const key of ["+", "-"]) press(key, false);
    press("Home");
    byId("across").value = "1";
    byId("cut").value = "0.5";
    byId("cut").dispatchEvent(new Event("input"));
    const { normal, constant } = view.cut, middle = view.box.getCenter(new THREE.Vector3());
    at.push(Math.abs(normal.dot(middle) + constant) < 1e-3);
    byId("across").value = "";
    byId("cut").value = "1";
    byId("cut").dispatchEvent(new Event("input"));
    return at;
  });
  check(new Set(looks.slice(0, 4)).size === 4 && looks[5] === looks[0] && looks[4] === looks[2] && looks[6], `keys turn the view: ${looks}`);

  // Saved commands; xtask runs them and compares.
  await unfold("saving");
  await page.click("#save");
  await page.waitForFunction(() => byId("saved").textContent, null, PATIENCE);
  measured.commands = (await page.textContent("#saved")).split("\n").filter((line) => !line.startsWith("#"));
  measured.t30_s = (await values("t30_s")).slice(1);

  // A source is dragged; the scene is traced anew with it.
  await unfold("mapping");
  await page.click("#unpaint");
  // The room fits its new place first.
  await page.waitForTimeout(500);
  const [maps, at] = await page.evaluate(() => [shown.maps, shown.room.sources[0].at]);
  const from = await onScreen("source");
  await page.mouse.move(...from);
  await page.mouse.down();
  await page.mouse.move(from[0] + 8, from[1] + 2, { steps: 4 });
  await page.mouse.up();
  await page.waitForFunction((maps) => shown.maps > maps, maps, PATIENCE);
  const moved = await page.evaluate(() => shown.room.sources[0].at);
  check(Math.hypot(...moved.map((value, axis) => value - at[axis])) > 0.01, "the mouse moves the source");
  await settled();

  // Whatever is done in whatever haste: numbers that are not grey are those of a fresh request of the state that the page shows.
  const acted = await page.evaluate(async () => {
    let seed = 1;
    const random = () => { seed = (seed * 1664525 + 1013904223) % 4294967296; return seed / 4294967296; };
    const numbers = () => [...document.querySelectorAll("#parameters tr[data-key] td")].map(({ dataset }) => dataset.value === undefined ? null : Number(dataset.value));
    const near = (at) => at.map((value) => value + 0.2 * (random() - 0.5));
    const [home, sources] = [wanted.listener, wanted.sources], { absorption } = shown.room.materials[0];
    const stand = byId("stand"), receive = () => { stand.selectedIndex = 1 + Math.floor(random() * wanted.receivers.length); stand.onchange(); };
    const acts = [() => moveListener(near(home)), () => changeMaterial(shown.room.materials[0], absorption.map((value) => Math.min(1, value + 0.05 * random()))),
      () => dropSource(0, near(sources[0])), () => byId("original").click(), receive];
    // Whether what is shown is grey or true; null where the state changed meanwhile.
    const isTrue = async () => {
      if (byId("side").classList.contains("stale")) return true;
      const [state, map, at, batches] = [wish(), shown.maps, numbers(), shown.of.answer.batches];
      const fresh = await server.ask("render", { ...state, window: "fresh", batches });
      if (fresh.map !== map || !same(state, wish())) return null;
      const all = fresh.pair.parameters.flatMap(({ single, values }) => [single, ...values]).map((entry) => isKnown(entry) ? entry[0] : null);
      return same(wanted.sources[0], fresh.pair.sourceAt) && same(all, at);
    };
    const calm = async () => { while (shown.isStale) await new Promise((later) => setTimeout(later, 50)); };
    const found = { acts: 0, compared: 0, untrue: 0 };
    while (found.acts < 100) {
      // A source that moves is traced anew: one act in ten.
      acts[random() < 0.1 ? 2 : [0, 1, 3, 4][Math.floor(4 * random())]]();
      found.acts++;
      await new Promise((later) => setTimeout(later, 400 * random()));
      if (found.acts % 5 === 0) await calm();
      const verdict = await isTrue();
      if (verdict !== null) found.compared += Number(!byId("side").classList.contains("stale"));
      if (verdict === false) found.untrue++;
    }
    // A page that forgets to be grey is noticed; a new map meanwhile would be no proof.
    while (shown.share !== null) await new Promise((later) => setTimeout(later, 50));
    await calm();
    moveListener(home.map((value) => value + 0.05));
    byId("side").classList.remove("stale");
    found.isNoticed = await isTrue() === false;
    return found;
  });
  check(acted.untrue === 0 && acted.compared >= 10, `numbers of another state are shown: ${JSON.stringify(acted)}`);
  check(acted.isNoticed, "an untrue number goes unnoticed");
  measured.acts = acted;

  // Undone step by step; place, materials and A are in the address.
  await unfold("numbers");
  await page.evaluate(() => byId("original").click());
  await settled();
  await page.click("#keep");
  const home = await page.evaluate(() => wanted.listener);
  await page.waitForTimeout(1100);
  await page.evaluate((at) => moveListener([at[0] + 0.1, at[1], at[2]]), home);
  await settled();
  await page.reload();
  await settled();
  await page.waitForFunction(() => shown.kept, null, PATIENCE);
  check(await page.evaluate((at) => same(shown.keptAt.listener, at) && Math.abs(wanted.listener[0] - at[0] - 0.1) < 2e-3, home), "a reload keeps place and A");
  await page.click("#undo");
  await page.waitForFunction((at) => same(wanted.listener, at), home, PATIENCE);
  await settled();

  // The scene is edited: what is wrong is said, what is right is shown.
  const scene = readFileSync(file, "utf8");
  await page.waitForTimeout(50);
  writeFileSync(file, "name = ");
  await page.waitForFunction(() => byId("job").textContent.includes("scene.toml"), null, PATIENCE);
  writeFileSync(file, scene.replace(/^name = .*$/m, "name = \"edited\""));
  await page.waitForFunction(() => document.title.includes("edited") && shown.maps, null, PATIENCE);
  await settled();

  // Narrow, and on paper.
  await page.setViewportSize({ width: 400, height: 800 });
  await page.waitForTimeout(300);
  check(await page.evaluate(() => document.documentElement.scrollWidth <= 400), "nothing is wider than a narrow screen");
  await page.screenshot({ path: `${folder}/narrow.png`, fullPage: true });
  await page.emulateMedia({ media: "print" });
  check(await page.locator("#parameters").isVisible() && await page.locator("#room").isVisible(), "paper has the numbers and the room");
  await page.emulateMedia({ media: null });
  await page.pdf({ path: `${folder}/page.pdf`, preferCSSPageSize: true, printBackground: true });
  await page.goto(`file://${report}`);
  await page.waitForTimeout(1000);
  await accessible("a report");
  check(await page.evaluate(() => document.documentElement.scrollWidth <= 400), "nothing of a report is wider than a narrow screen");
  await page.setViewportSize({ width: 1400, height: 1000 });
  const paper = await page.pdf({ path: `${folder}/report.pdf`, preferCSSPageSize: true, printBackground: true });
  const pages = paper.toString("latin1").match(/\/Type \/Page\b/g).length;
  check(pages <= 4, `a report of two designs at three seats has ${pages} pages of A4`);
  check(!failures.length, `scripts fail: ${failures.join("; ")}`);
  console.log(JSON.stringify(measured));
} finally {
  await browser.close();
  server.kill("SIGINT");
}
