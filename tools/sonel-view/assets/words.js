// Numbers as text, and small helpers.
"use strict";
const byId = (id) => document.getElementById(id);
const make = (tag, text, kind) => {
  const element = document.createElement(tag);
  if (text !== undefined) element.textContent = text;
  if (kind) element.className = kind;
  return element;
};
// What the file holds packed: gzip in base64.
async function unpacked(id) {
  const bytes = Uint8Array.from(atob(byId(id).textContent), (letter) => letter.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).text();
}
// Decimals that show the first digit of a half-width, and the second where the first is 1.
function decimals(half) {
  if (!(half > 0)) return 2;
  const place = Math.floor(Math.log10(half));
  return Math.min(9, Math.max(0, half / 10 ** place < 2 ? 1 - place : -place));
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
  const digits = known ? decimals(half) : 2;
  const shown = make(tag, known ? `${value.toFixed(digits)} ± ${half.toFixed(digits)}` : `${value.toFixed(digits)} ± ?`);
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
    font: { color: ink, size: 12 }, margin: { ...chart.layout.margin, b: 100 },
    legend: { orientation: "h", y: -0.3, yanchor: "top", font: { size: 11 } },
    xaxis: axis(chart.layout.xaxis), yaxis: axis(chart.layout.yaxis) };
  for (const trace of chart.data) if (typeof trace.x === "number") trace.x = chart.data[trace.x].x;
  return Plotly.react(id, chart.data, layout, { responsive: true, displaylogo: false, displayModeBar: false });
}
