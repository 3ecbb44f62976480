// Numbers as text, and small helpers.
"use strict";
const byId = (id) => document.getElementById(id);
const make = (tag, text, kind) => {
  const element = document.createElement(tag);
  if (text !== undefined) element.textContent = text;
  if (kind) element.className = kind;
  return element;
};
// The head of a table: print repeats it.
function heading(texts) {
  const head = make("thead"), line = make("tr");
  line.append(...texts.map((text) => make("th", text)));
  head.append(line);
  return head;
}
// What the file holds packed: gzip in base64.
async function unpacked(id) {
  const bytes = Uint8Array.from(atob(byId(id).textContent), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
}
// Decimals that show two digits of a half-width, and no more than anybody can use: as in the tables of the page.
function decimals(value, half) {
  const most = Math.abs(value) < 10 ? 3 : 2;
  return half > 0 ? Math.min(most, Math.max(1, 1 - Math.floor(Math.log10(half)))) : most;
}
// [value, half-width], [value, reason] or a reason; with the reason as a title.
function cell(entry, tag = "td") {
  if (entry === null || entry === undefined) return make(tag, "–");
  if (!Array.isArray(entry)) {
    const none = make(tag, "–");
    none.title = entry;
    return none;
  }
  const [value, half] = entry;
  const known = typeof half === "number";
  const digits = decimals(value, known ? half : 0), least = 0.1 ** digits;
  const width = !known ? "?" : half < 0.5 * least ? `<${least.toFixed(digits)}` : half.toFixed(digits);
  const shown = make(tag, `${value.toFixed(digits)} ± ${width}`);
  shown.dataset.value = value;
  if (known) shown.dataset.half = half; else shown.title = half;
  return shown;
}
const hertz = (band) => band >= 1000 ? `${band / 1000} kHz` : `${band} Hz`;
const cssColor = (name) => getComputedStyle(document.body).getPropertyValue(name).trim();
// What every chart of the page is drawn with.
function drawChart(id, chart) {
  const ink = cssColor("--ink") || "#222", line = cssColor("--line") || "#ddd";
  const axis = (own) => ({ ...own, gridcolor: line, zerolinecolor: line, automargin: true });
  const layout = { ...chart.layout, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
    font: { color: ink, size: 12 },
    legend: { orientation: "h", yref: "container", y: 0, yanchor: "bottom", font: { size: 11 } },
    xaxis: axis(chart.layout.xaxis), yaxis: axis(chart.layout.yaxis) };
  for (const trace of chart.data) if (typeof trace.x === "number") trace.x = chart.data[trace.x].x;
  return Plotly.react(id, chart.data, layout, { responsive: true, displaylogo: false, displayModeBar: false });
}
