// What the server is asked for: one thing at a time, answers sharpen step by step.
"use strict";
class Server {
  constructor(token) {
    this.token = token;
    this.window = Array.from(crypto.getRandomValues(new Uint8Array(8)), (byte) => byte.toString(16)).join("");
  }

  async ask(path, wish = {}, signal = undefined) {
    const reply = await fetch(`/api/${path}`, { method: "POST", headers: { "X-Sonel-Token": this.token }, body: JSON.stringify(wish), signal });
    if (reply.headers.get("Content-Type") === "application/octet-stream") return new Float32Array(await reply.arrayBuffer());
    const answer = await reply.json();
    if (answer.error !== undefined) throw new Error(answer.error);
    return answer;
  }
}

// One kind of work in steps, one request at a time. A first step is always answered, so that whoever drags sees numbers on the way; later
// steps give way to a newer wish.
class Steps {
  constructor(path, show) {
    Object.assign(this, { path, show, waiting: null, isAtWork: false });
  }

  async wish(value, steps) {
    this.waiting = { value, steps };
    this.later?.abort();
    if (this.isAtWork) return;
    this.isAtWork = true;
    while (this.waiting) {
      const { value, steps } = this.waiting;
      this.waiting = null;
      try {
        await this.work(value, steps);
      } catch (error) {
        if (!this.waiting && !this.isDropped) this.failed?.(error);
      }
    }
    this.isAtWork = false;
  }

  drop() {
    this.waiting = null;
    this.isDropped = true;
    this.later?.abort();
  }

  async work(value, steps) {
    this.isDropped = false;
    const ask = (step, signal) => server.ask(this.path, { ...value, window: server.window, batches: steps[step] }, signal);
    let answer = await ask(0);
    for (let step = 0; step < steps.length && !this.isDropped; step++) {
      // The server goes on while this one is drawn.
      this.later = new AbortController();
      const next = step + 1 < steps.length && !this.waiting ? ask(step + 1, this.later.signal) : null;
      next?.catch(() => {});
      this.show(answer, { isFirst: step === 0, isLast: step + 1 === steps.length, isNewest: !this.waiting });
      if (!next) return;
      answer = await next;
    }
  }
}

// Rows of parameters over the bands; with those of A, differences in JND, bold where they are beyond chance.
function showParameters(pair, kept) {
  const table = byId("parameters");
  table.replaceChildren(heading(["", "mid", ...pair.bands.map(hertz)]));
  for (const row of pair.parameters) {
    const line = make("tr");
    line.dataset.key = row.key;
    const name = make("th", row.unit ? `${row.symbol} [${row.unit}]` : row.symbol);
    name.scope = "row";
    line.append(name, cell(row.single), ...row.values.map((entry) => cell(entry)));
    table.append(line);
    const before = kept?.parameters.find((other) => other.key === row.key);
    if (before) table.append(difference(row, before));
  }
  const counted = typeof pair.batches === "number" ? " From part of the packets: sharpening …" : "";
  byId("about").textContent = `${pair.source} → ${pair.receiver}. mid: mean of 500 and 1000 Hz. ± is half of the 95 % interval of the simulation: `
    + `the value of an endless simulation lies within. It says nothing of how well materials are known.${counted}`;
}

function difference(row, before) {
  const line = make("tr");
  line.append(make("td", "  − A [JND]"));
  const pairs = [[row.single, before.single], ...row.values.map((entry, band) => [entry, before.values[band]])];
  for (const [now, then] of pairs) {
    if (!Array.isArray(now) || !Array.isArray(then)) { line.append(make("td", "–")); continue; }
    const step = (now[0] - then[0]) / row.noticeable, half = Math.hypot(Number(now[1]) || 0, Number(then[1]) || 0) / row.noticeable;
    const shown = make("td", `${step > 0 ? "+" : ""}${step.toFixed(1)}`, Math.abs(step) > half ? "beyond" : "note");
    shown.title = `± ${half.toFixed(1)} JND${Math.abs(step) > half ? "" : ": within chance"}`;
    line.append(shown);
  }
  return line;
}

// Charts as they were drawn last: other colours draw them again.
const drawn = new Map();
function draw(id, chart) {
  drawn.set(id, chart);
  return drawChart(id, chart);
}

function showCurves(pair) {
  for (const [name, title] of [["decay", "Decay curves"], ["echogram", "Echogram"], ["early", "Early reflections"]]) {
    byId(name).setAttribute("role", "img");
    byId(name).setAttribute("aria-label", `${title}: ${pair.source} to ${pair.receiver}`);
    draw(name, pair[name]);
  }
}
