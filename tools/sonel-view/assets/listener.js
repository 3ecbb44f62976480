// What the server is asked for: the newest wish wins, answers sharpen step by step.
"use strict";
class Server {
  constructor(token) {
    this.token = token;
    this.window = Array.from(crypto.getRandomValues(new Uint8Array(8)), (byte) => byte.toString(16)).join("");
  }

  async ask(path, wish = {}) {
    const reply = await fetch(`/api/${path}`, { method: "POST", headers: { "X-Sonel-Token": this.token }, body: JSON.stringify(wish) });
    if (reply.headers.get("Content-Type") === "application/octet-stream") return new Float32Array(await reply.arrayBuffer());
    const answer = await reply.json();
    if (!reply.ok) throw new Error(answer.error);
    return answer;
  }
}

// One kind of work: only the answers to the last wish count.
class Newest {
  constructor(work) {
    this.work = work;
    this.number = 0;
  }

  async wish(value) {
    const own = ++this.number;
    const isNewest = () => own === this.number;
    try {
      await this.work(value, isNewest);
    } catch (error) {
      if (isNewest()) this.failed?.(error);
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
    line.append(make("td", row.unit ? `${row.symbol} [${row.unit}]` : row.symbol), cell(row.single), ...row.values.map((entry) => cell(entry)));
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

function showCurves(pair) {
  for (const name of ["decay", "echogram", "early"]) drawChart(name, pair[name]);
}
