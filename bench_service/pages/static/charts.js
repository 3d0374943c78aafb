// Charts over uPlot: strip charts of live channels with bounded memory, and the plots of results.
import { h, number, shownIn } from "./dom.js";
import { t } from "./words.js";

export const COLOURS = ["#2563eb", "#c2410c", "#15803d", "#7c3aed", "#a16207", "#0e7490", "#be185d", "#475569"];
const POINTS = 1200;
const ink = () => getComputedStyle(document.documentElement).getPropertyValue("--ink").trim() || "#222";
const line = () => getComputedStyle(document.documentElement).getPropertyValue("--line").trim() || "#ccc";
/** Labels of an axis by its step: the library rounds to three decimals, and small values are all "0". */
const ticks = (_, splits, _axis, _space, step) => splits.map((v) => v === null || v === undefined ? "" : step > 0 ? String(Number(v.toFixed(Math.min(15, Math.max(0, 1 + Math.ceil(-Math.log10(step))))))) : String(Number(v.toPrecision(4))));
export const axis = (label = "") => ({ label, values: ticks, stroke: ink, grid: { stroke: line, width: 1 }, ticks: { stroke: line }, font: "12px system-ui", labelFont: "12px system-ui", size: 62 });

function fitted(plot, element, height) {
  const observer = new ResizeObserver(() => plot.setSize({ width: Math.max(200, element.clientWidth - 8), height }));
  observer.observe(element);
}

/** A strip chart: at most `POINTS` points are kept, however long it runs; the older ones are merged in pairs. */
export class Strip {
  constructor(title, unit, names, { height = 170, xLabel = t("bench time, s") } = {}) {
    const [shown, size] = shownIn(unit);
    this.size = size;
    this.data = [[], ...names.map(() => [])];
    this.element = h("section", { class: "chart", "aria-label": title }, h("h3", {}, `${title}, ${shown}`));
    this.plot = null;
    this.options = { width: 420, height, cursor: { drag: { x: true, y: false } }, legend: { live: true }, scales: { x: { time: false } },
      axes: [axis(xLabel), axis()], series: [{ label: "t" }, ...names.map((name, k) => ({ label: name, stroke: COLOURS[k % COLOURS.length], width: 1.3, points: { show: false }, value: (_, v) => number(v === null ? null : Number(v.toPrecision(5))) }))] };
    this.dirty = false;
  }

  add(x, values) {
    const [times] = this.data;
    if (times.length && x <= times[times.length - 1]) return;
    times.push(x);
    values.forEach((value, k) => this.data[k + 1].push(value === null ? null : value / this.size));
    if (times.length > POINTS) this.data = this.data.map((column) => merged(column));
    this.dirty = true;
  }

  clear() { this.data = this.data.map(() => []); this.dirty = true; }

  draw() {
    if (!this.dirty || !this.element.isConnected || document.hidden) return;
    this.dirty = false;
    if (this.plot) { this.plot.setData(this.data); return; }
    this.plot = new uPlot(this.options, this.data, this.element);
    fitted(this.plot, this.element, this.options.height);
  }
}

function merged(column) {
  const half = column.length >> 1, old = column.slice(0, half), out = [];
  for (let k = 0; k + 1 < old.length; k += 2) out.push(old[k] === null || old[k + 1] === null ? old[k] ?? old[k + 1] : (old[k] + old[k + 1]) / 2);
  return out.concat(column.slice(old.length - (old.length % 2)));
}

function marks(series, index) {
  const points = series.style === "points" || series.style === "line_points" || series.style === "";
  return { label: series.name || t("value"), stroke: series.style === "reference" ? ink : COLOURS[index % COLOURS.length], dash: series.style === "reference" ? [6, 4] : [],
    width: series.style === "points" ? 0 : 1.4, points: { show: points, size: 6, fill: COLOURS[index % COLOURS.length] }, spanGaps: true, value: (_, v) => number(v === null ? null : Number(v.toPrecision(6))) };
}

/** A common x axis for series that have their own: the union of all x, null where a series has no point. */
export function joined(list) {
  const xs = [...new Set(list.flatMap((series) => series.x))].sort((a, b) => a - b), at = new Map(xs.map((x, k) => [x, k]));
  return [xs, ...list.map((series) => { const column = new Array(xs.length).fill(null); series.x.forEach((x, k) => { column[at.get(x)] = series.y[k]; }); return column; })];
}

function errorBars(series) {
  return (plot) => {
    const { ctx } = plot;
    ctx.save();
    series.forEach((one, index) => {
      if (!one.error || !one.error.length || !plot.series[index + 1].show) return;
      ctx.strokeStyle = COLOURS[index % COLOURS.length];
      ctx.lineWidth = devicePixelRatio;
      ctx.beginPath();
      one.x.forEach((x, k) => {
        if (x < plot.scales.x.min || x > plot.scales.x.max) return;
        const px = plot.valToPos(x, "x", true), low = one.y[k] - one.error[k];
        const top = plot.valToPos(one.y[k] + one.error[k], "y", true), bottom = plot.valToPos(plot.scales.y.distr === 3 && low <= 0 ? plot.scales.y.min : low, "y", true), w = 3 * devicePixelRatio;
        ctx.moveTo(px, top); ctx.lineTo(px, bottom); ctx.moveTo(px - w, top); ctx.lineTo(px + w, top); ctx.moveTo(px - w, bottom); ctx.lineTo(px + w, bottom);
      });
      ctx.stroke();
    });
    ctx.restore();
  };
}

function download(name, type, content) {
  const address = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  const link = h("a", { href: address, download: name });
  document.body.append(link);
  link.click();
  link.remove();
  setTimeout(() => URL.revokeObjectURL(address), 10000);
}

const cell = (value) => value === null || value === undefined ? "" : typeof value === "string" ? `"${value.replaceAll('"', '""')}"` : String(value);

/** Curves that are replaced as a whole, on logarithmic axes where asked; with `dashed` each has its lower and upper end next to it. */
export class Curves {
  constructor(title, names, { xLabel = "", height = 200, logX = false, logY = false, dashed = [] } = {}) {
    this.element = h("section", { class: "chart", "aria-label": title }, h("h3", {}, title));
    this.plot = null;
    this.options = { width: 420, height, cursor: { drag: { x: true, y: false } }, legend: { live: true }, scales: { x: { time: false, distr: logX ? 3 : 1 }, y: { distr: logY ? 3 : 1 } }, axes: [axis(xLabel), axis()],
      series: [{ label: xLabel }, ...names.map((name, k) => ({ label: name, stroke: COLOURS[(dashed.length ? Math.floor(k / 3) : k) % COLOURS.length], width: dashed.includes(name) ? 0.8 : 1.4, dash: dashed.includes(name) ? [4, 4] : [], points: { show: false }, spanGaps: true, value: (_, v) => number(v === null ? null : Number(v.toPrecision(4))) }))] };
  }

  show(data) {
    if (!this.element.isConnected || document.hidden) return;
    if (this.plot) { this.plot.setData(data); return; }
    this.plot = new uPlot(this.options, data, this.element);
    fitted(this.plot, this.element, this.options.height);
  }
}

/** A plot of a result, to zoom into and read values off; it can be taken out as PNG and CSV. */
export function plotted(figure, { height = 330 } = {}) {
  const flat = figure.series.flatMap((s) => s.style === "band" ? [{ ...s, style: "line", error: [] }, { ...s, name: `${s.name} –`, y: s.upper, style: "line", error: [] }] : [s]);
  const usable = flat.map((s) => ({ ...s, ...positive(s, figure) }));
  const place = h("div", { class: "chart" }), wait = () => {
    const plot = new uPlot({ width: Math.max(240, place.clientWidth - 8 || 680), height, hooks: { draw: [errorBars(usable)] },
      scales: { x: { time: false, distr: figure.x_log ? 3 : 1 }, y: { distr: figure.y_log ? 3 : 1 } }, axes: [axis(figure.x_label), axis(figure.y_label)],
      series: [{ label: figure.x_label }, ...usable.map(marks)] }, joined(usable), place);
    fitted(plot, place, height);
    return plot;
  };
  let plot = null;
  const seen = new IntersectionObserver((entries) => { if (entries.some((entry) => entry.isIntersecting) && !plot) { plot = wait(); seen.disconnect(); } }, { rootMargin: "300px" });
  seen.observe(place);
  const name = figure.title.replace(/\W+/g, "_");
  const csv = () => {
    const rows = [["series", "x", "y", "error"], ...figure.series.flatMap((s) => s.x.map((x, k) => [s.name, x, s.y[k], s.error && s.error.length ? s.error[k] : ""]))];
    return rows.map((row) => row.map(cell).join(",")).join("\n") + "\n";
  };
  return h("div", {}, place, h("div", { class: "verbs" },
    h("span", { class: "note" }, t("Drag to zoom in; double-click to see all.")),
    h("button", { type: "button", onclick: () => plot && plot.root.querySelector("canvas").toBlob((blob) => download(`${name}.png`, "image/png", blob)) }, "PNG"),
    h("button", { type: "button", onclick: () => download(`${name}.csv`, "text/csv", csv()) }, "CSV")));
}

function positive(series, figure) {
  const keep = series.x.map((x, k) => (!figure.x_log || x > 0) && (!figure.y_log || series.y[k] > 0));
  const kept = (list) => list && list.length ? list.filter((_, k) => keep[k]) : [];
  return { x: kept(series.x), y: kept(series.y), error: kept(series.error) };
}

/** The place of a value between its limits, with an uncertainty bar of ± 2 σ. */
export function bar(canvas) {
  const { value, sigma, minimum, maximum } = Object.fromEntries(Object.entries(canvas.dataset).map(([k, v]) => [k, v === "" ? null : Number(v)]));
  const ends = [minimum, maximum].filter((v) => v !== null), u = sigma || 0, all = [...ends, value - 2 * u, value + 2 * u];
  if (value === null || !ends.length || !all.every(Number.isFinite)) return;
  let low = Math.min(...all), high = Math.max(...all);
  const pad = (high - low || 1) * 0.12, context = canvas.getContext("2d");
  low -= pad; high += pad;
  const x = (v) => (v - low) / (high - low) * canvas.width, mid = canvas.height / 2;
  const from = minimum === null ? 0 : x(minimum), to = maximum === null ? canvas.width : x(maximum);
  context.clearRect(0, 0, canvas.width, canvas.height);
  context.fillStyle = "rgba(22, 163, 74, .25)";
  context.fillRect(from, 3, to - from, canvas.height - 6);
  context.strokeStyle = ink(); context.lineWidth = 1.5;
  context.beginPath(); context.moveTo(x(value - 2 * u), mid); context.lineTo(x(value + 2 * u), mid); context.stroke();
  context.fillStyle = (minimum === null || value >= minimum) && (maximum === null || value <= maximum) ? "#16a34a" : "#dc2626";
  context.beginPath(); context.arc(x(value), mid, 4.5, 0, 2 * Math.PI); context.fill();
}
