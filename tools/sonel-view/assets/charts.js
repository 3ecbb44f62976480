// Charts by Observable Plot: panels as Rust states them, or as other scripts make them of parameters.
"use strict";
// Colours that also the colour-blind tell apart (Okabe and Ito), the ink of the page first; a ramp where there are more.
const PALETTE = ["currentColor", "#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
// Viridis: dark violet to yellow, even in lightness.
const RAMP = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
function rampColor(part) {
  const place = Math.min(Math.max(part, 0), 1) * (RAMP.length - 1);
  const low = Math.min(Math.floor(place), RAMP.length - 2);
  return RAMP[low].map((from, i) => Math.round(from + (place - low) * (RAMP[low + 1][i] - from)));
}
const seriesColor = (index, count) => count <= PALETTE.length ? PALETTE[index] : `rgb(${rampColor(0.9 * index / (count - 1))})`;

// Names of series with their colours; one needs none.
function keys(names) {
  const line = make("p", undefined, "note keys");
  if (names.length > 1) names.forEach((name, index) => {
    const key = make("span"), swatch = make("b", "■ ");
    swatch.style.color = seriesColor(index, names.length);
    key.append(swatch, name);
    line.append(key);
  });
  return line;
}

const frequency = (hz) => hz >= 1000 ? `${hz / 1000}k` : `${hz}`;

// The drawing as a whole says what it is: parts of it have names for scripts alone.
function unnamed(drawing) {
  for (const part of drawing.querySelectorAll("[aria-label]")) {
    part.dataset.label = part.getAttribute("aria-label");
    part.removeAttribute("aria-label");
  }
  return drawing;
}

// A panel: axes, series of points [x, y, low, high], and `wanted`, ranges [x, low, high] that are required. `onPick` takes the x that is pointed at.
function drawChart(place, panel, { width = 460, height = 270, hasKeys = true, onPick } = {}) {
  const { x, y, wanted = [] } = panel, count = panel.series.length;
  // Rust states columns.
  const series = panel.series.map((one) => one.points ? one : { ...one, points: one.x.map((at, index) => [at, one.y[index], one.low[index], one.high[index]]) });
  const shown = series.map(({ points }) => points.filter((point) => point[1] !== null && (!y.range || point[1] >= y.range[0])));
  const values = shown.flat().flatMap(([, value, low, high]) => [value, ...y.range ? [] : [low, high]]);
  const ends = [...values, ...wanted.flatMap(([, low, high]) => [low, high])].filter(Number.isFinite);
  const [low, high] = y.range ?? [y.fromZero ? 0 : Math.min(...ends), Math.max(...ends)];
  const margin = y.range ? 0 : 0.06 * (high - low || Math.abs(high) || 1), domain = [y.fromZero ? 0 : low - margin, high + margin];
  const inside = (value, otherwise) => value === null || value === undefined ? otherwise : Math.min(Math.max(value, domain[0]), domain[1]);
  const marks = [Plot.areaY(wanted, { x: "0", y1: (d) => inside(d[1], domain[0]), y2: (d) => inside(d[2], domain[1]), fill: "currentColor", fillOpacity: 0.12 })];
  series.forEach(({ name, mark }, index) => {
    const points = shown[index], color = seriesColor(index, count);
    const bars = points.filter((point) => Number.isFinite(point[3])), ranged = { x: "0", y1: (d) => inside(d[2], domain[0]), y2: (d) => inside(d[3], domain[1]) };
    const isLine = mark === "Line" || mark === "Dashed";
    if (bars.length) marks.push(isLine ? Plot.areaY(bars, { ...ranged, fill: color, fillOpacity: 0.2 }) : Plot.ruleX(bars, { ...ranged, stroke: color }));
    if (mark === "Stems") marks.push(Plot.ruleX(points, { x: "0", y1: domain[0], y2: "1", stroke: color }));
    if (isLine || mark === "PointsAndLine") marks.push(Plot.lineY(series[index].points.map((point) => point[1] === null ? [point[0], NaN] : point), { x: "0", y: "1", stroke: color, clip: true, strokeDasharray: mark === "Dashed" ? "6 4" : undefined }));
    if (!isLine) marks.push(Plot.dot(points, { x: "0", y: "1", r: 3, fill: color, ariaLabel: (d) => `${name}: ${d[0]}` }));
  });
  const named = series.flatMap(({ name }, index) => shown[index].map((point) => ({ x: point[0], y: point[1], name, half: point[3] - point[1] })));
  const said = ({ x: at, y: value, name, half }) => `${count > 1 ? `${name}\n` : ""}${x.scale === "Category" ? at : +at.toPrecision(4)}: ${value.toFixed(2)}${half > 0 ? ` ± ${half.toFixed(2)}` : ""}`;
  if (named.length) marks.push(Plot.tip(named, Plot.pointer({ x: "x", y: "y", title: said, maxRadius: 25, fill: "var(--paper)" })));
  const ends_x = x.range ?? (x.scale === "Linear" && named.length ? [0, Math.max(...named.map((point) => point.x))] : undefined);
  const across = x.scale === "Category" ? { type: "point", domain: [...new Set(named.map((point) => point.x))], label: null, tickRotate: count && shown[0].length > 6 ? -40 : 0 }
    : { type: x.scale === "Logarithmic" ? "log" : "linear", base: 2, domain: ends_x, ticks: x.ticks ?? undefined, tickFormat: x.scale === "Logarithmic" ? frequency : undefined, label: x.label };
  const drawing = unnamed(Plot.plot({ width, height, marginLeft: 52, marginBottom: x.scale === "Category" && shown[0]?.length > 6 ? 70 : 38, marks,
    x: { ...across, labelAnchor: "center", labelArrow: "none" }, y: { domain, label: y.label, labelArrow: "none", grid: true, ticks: 6 } }));
  if (onPick) drawing.addEventListener("input", () => onPick(drawing.value?.x ?? null));
  const figure = make("figure", undefined, "chart");
  if (panel.title) figure.append(make("figcaption", panel.title));
  figure.append(drawing, ...hasKeys ? [keys(series.map(({ name }) => name))] : []);
  drawing.setAttribute("role", "img");
  drawing.setAttribute("aria-label", `${panel.title || y.label} over ${x.label}`);
  place.replaceChildren(figure);
  return figure;
}

// Plans of one parameter with one scale of colours: cells of a grid or dots, walls, sources.
function drawPlans({ scale, each }) {
  const values = each.flatMap(({ spots }) => spots.map(({ value }) => value)).filter((value) => value !== null);
  const color = { type: "linear", scheme: "viridis", domain: [Math.min(...values), Math.max(...values)], label: scale.label, unknown: "#c8c8c8" };
  const row = make("div", undefined, "grid");
  each.forEach(({ title, axes, spots, walls, sources }, index) => {
    const cells = spots.filter(({ cell }) => cell), dots = spots.filter(({ cell }) => !cell);
    const said = ({ at, value }) => `${at.map((v) => v.toFixed(2)).join(", ")} m: ${value?.toFixed(2) ?? "–"}`;
    const plan = unnamed(Plot.plot({ width: 460, aspectRatio: 1, color: { ...color, legend: index === 0 }, marks: [
      Plot.rect(cells, { x1: (d) => d.cell[0][0], x2: (d) => d.cell[1][0], y1: (d) => d.cell[0][1], y2: (d) => d.cell[1][1], fill: (d) => d.value ?? NaN }),
      Plot.dot(dots, { x: (d) => d.at[0], y: (d) => d.at[1], r: 6, fill: (d) => d.value ?? NaN, stroke: "currentColor" }),
      Plot.link(walls, { x1: (d) => d[0][0], y1: (d) => d[0][1], x2: (d) => d[1][0], y2: (d) => d[1][1] }),
      Plot.dot(sources, { x: "0", y: "1", symbol: "times", r: 6, stroke: "#d55e00", strokeWidth: 3 }),
      Plot.tip(spots, Plot.pointer({ x: (d) => d.at[0], y: (d) => d.at[1], title: said, fill: "var(--paper)" }))],
      x: { label: axes[0], labelArrow: "none" }, y: { label: axes[1], labelArrow: "none" } }));
    plan.setAttribute("role", "img");
    plan.setAttribute("aria-label", title);
    const figure = make("figure", undefined, "chart map");
    figure.append(make("figcaption", title), plan);
    row.append(figure);
  });
  return row;
}
