// The samples of a recording over any stretch: the service makes least, mean and greatest of each bin.
import { part, read } from "./api.js";
import { busy } from "./act.js";
import { axis, COLOURS } from "./charts.js";
import { h, number, shownIn } from "./dom.js";
import { t } from "./words.js";

const place = document.getElementById("plot"), form = place.querySelector("form"), length = Number(place.dataset.length), plots = new Map();

function groups(channels) {
  const found = new Map();
  for (const one of channels) { const key = `${one.name.replace(/_[xyz]$/, "")} ${one.unit}`; found.set(key, [...(found.get(key) || []), one]); }
  return found;
}

function draw(key, members, mids) {
  const [unit, size] = shownIn(members[0].unit), scaled = (list) => list.map((v) => v / size);
  const data = [mids, ...members.flatMap((one) => [scaled(one.minimum), scaled(one.mean), scaled(one.maximum)])];
  const known = plots.get(key);
  if (known) { known.setData(data); return; }
  const title = key.split(" ")[0], box = h("section", { class: "chart", "aria-label": title }, h("h3", {}, `${title}, ${unit}`));
  document.getElementById("charts").append(box);
  const value = (_, v) => number(v === null ? null : Number(v.toPrecision(6)));
  const plot = new uPlot({ width: Math.max(240, box.clientWidth - 8), height: 260, scales: { x: { time: false } }, axes: [axis(t("time, s")), axis()],
    series: [{ label: "t" }, ...members.flatMap((one, k) => { const stroke = COLOURS[k % COLOURS.length]; return [
      { label: `${one.name} ${t("least")}`, stroke: `${stroke}55`, width: 1, points: { show: false }, value }, { label: one.name, stroke, width: 1.4, points: { show: false }, value }, { label: `${one.name} ${t("greatest")}`, stroke: `${stroke}55`, width: 1, points: { show: false }, value }]; })],
    bands: members.map((_, k) => ({ series: [3 * k + 3, 3 * k + 1], fill: `${COLOURS[k % COLOURS.length]}22` })),
    hooks: { setSelect: [(u) => { if (u.select.width > 4) { show(u.posToVal(u.select.left, "x"), u.posToVal(u.select.left + u.select.width, "x")); } }] }, cursor: { drag: { x: true, y: false, setScale: false } } }, data, box);
  new ResizeObserver(() => plot.setSize({ width: Math.max(200, box.clientWidth - 8), height: 260 })).observe(box);
  plots.set(key, plot);
}

async function show(start, stop) {
  start = Math.max(0, start); stop = Math.min(length, stop);
  form.elements.start.value = start; form.elements.stop.value = stop;
  const query = new URLSearchParams({ start_s: start, stop_s: stop, bins: 800 });
  const found = await busy(form.querySelector("button"), form.querySelector("output"), () => read(`/api/v1/recordings/${part(place.dataset.recording)}/overview?${query}`, { patience: 120000 }));
  if (!found) return;
  form.querySelector("output").textContent = t("{n} points", { n: found.edges_s.length - 1 });
  const mids = found.edges_s.slice(1).map((edge, k) => (edge + found.edges_s[k]) / 2);
  for (const [key, members] of groups(found.channels)) draw(key, members, mids);
}

form.addEventListener("submit", (event) => { event.preventDefault(); show(Number(form.elements.start.value), Number(form.elements.stop.value)); });
document.getElementById("whole").addEventListener("click", () => show(0, length));
show(0, length);
