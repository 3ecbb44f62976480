// What the server is asked for: one thing at a time, answers sharpen step by step, and each says which state it is of.
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
// steps give way to a newer wish. `show` takes an answer, the wish that it is of, and which step it was.
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
      this.show(answer, value, { isFirst: step === 0, isLast: step + 1 === steps.length });
      if (!next) return;
      answer = await next;
    }
  }
}

// Rows of parameters over the bands; with those of A, differences in JND, bold where they are beyond chance.
function showParameters(pair, kept, isPart) {
  const whole = byId("parameters"), head = make("thead"), line = make("tr");
  line.append(make("td"), ...["mid", ...pair.bands.map(frequency)].map((text) => make("th", text)));
  head.append(line);
  whole.replaceChildren(head);
  const small = (entry, unit) => {
    const place = cell(entry, unit), [value, half] = place.textContent.split(" ± ");
    place.replaceChildren(value, ...half ? [make("small", `±${half}`)] : []);
    return place;
  };
  for (const row of pair.parameters) {
    const line = make("tr"), name = make("th", label(row));
    line.dataset.key = row.key;
    name.scope = "row";
    line.append(name, small(row.single, row.unit), ...row.values.map((entry) => small(entry, row.unit)));
    line.onclick = () => { shown.over = row.key; showOver(pair); };
    whole.append(line);
    const before = kept && rowOf(kept.parameters, row.key);
    if (before) whole.append(difference(row, before));
  }
  byId("about").textContent = `${pair.source} → ${pair.receiver}. mid: mean of 500 and 1000 Hz. ± is half of the 95 % interval of the simulation: `
    + `the value of an endless simulation lies within. It says nothing of how well materials are known. A click on a parameter draws it over frequency.${isPart ? " From part of the packets: sharpening …" : ""}`;
}

function difference(row, before) {
  const line = make("tr");
  line.append(make("td", "− A [JND]"));
  const pairs = [[row.single, before.single], ...row.values.map((entry, band) => [entry, before.values[band]])];
  for (const [now, then] of pairs) {
    if (!isKnown(now) || !isKnown(then)) { line.append(make("td", "–")); continue; }
    const step = (now[0] - then[0]) / row.noticeable, half = Math.hypot(Number(now[1]) || 0, Number(then[1]) || 0) / row.noticeable;
    const shown = make("td", `${step > 0 ? "+" : ""}${step.toFixed(1)}`.replace("-", "−"), Math.abs(step) > half ? "beyond" : "note");
    shown.title = `± ${half.toFixed(1)} JND${Math.abs(step) > half ? "" : ": within chance"}`;
    line.append(shown);
  }
  return line;
}

function showCurves(pair) {
  const { decay, echogram, early } = pair.curves ?? {};
  byId("curves").hidden = !decay;
  if (!decay) return;
  drawChart(byId("decay"), decay);
  drawChart(byId("echogram"), echogram);
  if (early) drawChart(byId("early"), early, { onPick: (delay) => view.pick(delay) });
  else byId("early").replaceChildren(make("p", "Early reflections: none are listed.", "note"));
  showOver(pair);
}

// The chosen parameter over frequency.
function showOver(pair) {
  const row = rowOf(pair.parameters, shown.over ?? "t30_s");
  if (!row?.values.length) return;
  const series = [{ name: row.symbol, mark: "PointsAndLine", points: pointsOf(pair.bands, row.values) }];
  drawChart(byId("over"), { title: `${row.symbol} over frequency`, x: { label: "band [Hz]", scale: "Logarithmic", ticks: thirds(pair.bands) }, y: { label: label(row) }, series });
}
