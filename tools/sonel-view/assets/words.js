// Numbers as text, and small helpers.
"use strict";
const byId = (id) => document.getElementById(id);
const make = (tag, text, kind) => {
  const element = document.createElement(tag);
  if (text !== undefined) element.textContent = text;
  if (kind) element.className = kind;
  return element;
};
// A table of texts and cells; print repeats its head.
function table(head, rows, kind = "") {
  const whole = make("table", undefined, kind), body = make("tbody"), scroll = make("div", undefined, "scroll");
  const line = (cells, tag) => {
    const row = make("tr");
    row.append(...cells.map((one) => one instanceof Node ? one : make(tag, one)));
    return row;
  };
  if (head.length) {
    const top = make("thead");
    top.append(line(head, "th"));
    whole.append(top);
  }
  body.append(...rows.map((cells) => line(cells, "td")));
  whole.append(body);
  scroll.tabIndex = 0;
  scroll.append(whole);
  return scroll;
}
// What the file holds packed: gzip in base64.
async function unpacked(id) {
  const bytes = Uint8Array.from(atob(byId(id).textContent), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
}
// Decimals of the trade: times in 0.01 s, levels and clarity in 0.1 dB, indices in 0.01.
const DECIMALS = { s: 2, dB: 1, "dB(A)": 1, "%": 0, ms: 0, m: 1, "": 2 };
function rounded(value, unit) {
  const text = value.toFixed(DECIMALS[unit]);
  return Number(text) === 0 ? text.replace("-", "") : text.replace("-", "−");
}
// [value, half-width or reason, distances by materials], or a reason.
const isKnown = (entry) => Array.isArray(entry);
function beside(half, unit) {
  const least = 0.1 ** DECIMALS[unit];
  return half < 0.5 * least ? `<${least.toFixed(DECIMALS[unit])}` : half.toFixed(DECIMALS[unit]);
}
function numberText(entry, unit) {
  if (!isKnown(entry)) return "–";
  const [value, half, materials] = entry;
  const side = (off) => off === null ? "∞" : beside(off, unit), [low, high] = (materials ?? []).map(side);
  const second = !materials ? "" : low === high ? ` ± ${low}` : ` −${low} +${high}`;
  return `${rounded(value, unit)} ± ${typeof half === "number" ? beside(half, unit) : "?"}${second}`;
}
// A number with all of its digits, or why it is missing, as a title.
function cell(entry, unit, mark = "") {
  const shown = make("td", numberText(entry, unit) + mark);
  if (!isKnown(entry)) shown.title = entry;
  else {
    const [value, half] = entry;
    shown.dataset.value = value;
    if (typeof half === "number") shown.dataset.half = half;
    shown.title = typeof half === "number" ? `${value.toPrecision(6)} ± ${half.toPrecision(2)} ${unit}` : half;
  }
  return shown;
}
// (0) of a difference within the noise of the simulation, * of one that can be noticed.
function significance(entry, noticeable) {
  if (!isKnown(entry)) return "";
  const [value, half] = entry;
  return typeof half === "number" && Math.abs(value) <= half ? " (0)" : Math.abs(value) >= noticeable ? " *" : "";
}
const label = ({ symbol, unit }) => unit ? `${symbol} [${unit}]` : symbol;
const hertz = (band) => band >= 1000 ? `${band / 1000} kHz` : `${band} Hz`;
