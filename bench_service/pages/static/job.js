// A job as it runs: table, chamber, channels, means so far, events; and its result once it is there.
import { read, part, send } from "./api.js";
import { Strip } from "./charts.js";
import { fill, h, moment, doubt, number, shownIn, span } from "./dom.js";
import * as feed from "./feed.js";
import { interlocks } from "./interlocks.js";
import { attitude } from "./table3d.js";
import { reload } from "./turns.js";
import { t } from "./words.js";
import { stationDone } from "./estimates.js";
import "./result.js";

const job = document.getElementById("job").dataset, at = (id) => document.getElementById(id);
const charts = new Map(), means = new Map();
let known = Number(job.known), stations = [], station = -1, seen = -Infinity, chamber = null;

function words(value) {
  if (value === null) return "–";
  if (Array.isArray(value)) return value.map(words).join(", ");
  if (typeof value === "object") return Object.entries(value).map(([k, v]) => `${k}: ${words(v)}`).join("; ");
  return String(value);
}

function happened(events) {
  for (const event of events) {
    if (event.sequence <= known) continue;
    known = event.sequence;
    at("log").append(h("li", { "data-sequence": event.sequence }, moment(event.at), " ", h("strong", {}, event.kind), " ", words(event.data)));
    if (event.kind === "state") { reload(); return; }
    if (event.kind === "station") { at("done").textContent = event.data.station + 1; recordings(); stationDone(); }
  }
}

async function recordings() {
  const page = await read(`/api/v1/recordings?job=${part(job.job)}&limit=500`).catch(() => null);
  if (!page) return;
  const items = page.items.sort((a, b) => (a.station ? a.station.index : 0) - (b.station ? b.station.index : 0));
  fill(at("recordings"), h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Recordings") }, h("table", {}, h("thead", {}, h("tr", {}, ...["Station", "Data", "Samples", "Rate, Hz"].map((name) => h("th", {}, t(name))))),
    h("tbody", {}, ...items.map((one) => h("tr", {}, h("td", {}, h("a", { href: `/recordings/${one.id}` }, one.station ? `${one.station.index}: ${one.station.label}` : one.id)),
      h("td", {}, h("a", { href: `/api/v1/recordings/${one.id}/data?format=csv` }, "csv"), " ", h("a", { href: `/api/v1/recordings/${one.id}/data?format=parquet` }, "parquet")), h("td", { class: "n" }, one.count), h("td", { class: "n" }, number(one.rate_hz))))))));
}

const group = (name) => name.replace(/_[xyz]$/, "");
const chosen = new Set(JSON.parse(localStorage.getItem("bench.hidden") || "[]"));

function strip(key, title, unit, names) {
  const made = new Strip(title, unit, names);
  charts.set(key, made);
  const box = h("input", { type: "checkbox", checked: !chosen.has(key) });
  made.element.hidden = chosen.has(key);
  box.addEventListener("change", () => {
    made.element.hidden = !box.checked;
    if (box.checked) chosen.delete(key); else chosen.add(key);
    localStorage.setItem("bench.hidden", JSON.stringify([...chosen]));
  });
  at("channels").append(h("label", { class: "row" }, box, title));
  at("charts").append(made.element);
  return made;
}

function samples({ start_s, stop_s, channels }) {
  const groups = new Map();
  channels.forEach((channel) => { const key = `${group(channel.name)} ${channel.unit}`; groups.set(key, [...(groups.get(key) || []), channel]); });
  start_s.forEach((start, k) => {
    if (start <= seen) return;
    const x = (start + stop_s[k]) / 2;
    for (const [key, members] of groups) {
      const chart = charts.get(key) || strip(key, group(members[0].name), members[0].unit, members.map((one) => one.name));
      chart.add(x, members.map((one) => one.mean[k]));
    }
    for (const one of channels) {
      const sum = means.get(one.name) || { unit: one.unit, n: 0, mean: 0, m2: 0 }, delta = one.mean[k] - sum.mean;
      sum.n += 1; sum.mean += delta / sum.n; sum.m2 += delta * (one.mean[k] - sum.mean);
      means.set(one.name, sum);
    }
  });
  seen = Math.max(seen, ...start_s);
}

function table() {
  const rows = [...means].map(([name, { unit, n, mean, m2 }]) => {
    const [shown, size] = shownIn(unit), error = n > 1 ? Math.sqrt(m2 / (n - 1) / n) / size : null;
    return h("tr", {}, h("th", { scope: "row" }, name), h("td", { class: "n" }, number(mean / size, error)), h("td", { class: "n" }, error === null ? "–" : doubt(error)), h("td", {}, shown), h("td", { class: "n" }, n));
  });
  if (rows.length) at("samples").replaceChildren(h("thead", {}, h("tr", {}, ...["Channel", "Mean", "± standard error", "Unit", "Stretches"].map((name) => h("th", {}, t(name))))), h("tbody", {}, ...rows));
}

function devices(found, commanded) {
  const angles = [found.outer_deg, found.middle_deg, found.inner_deg];
  if (!document.hidden) attitude(at("table"), angles, commanded);
  const c = found.chamber;
  at("devices").textContent = `${t("Table")} ${angles.map((angle) => `${angle.toFixed(4)}°`).join(" ")} ${found.moving ? t("moving") : t("at rest")}`
    + (commanded ? `; ${t("commanded")} ${commanded.map((angle) => `${angle.toFixed(1)}°`).join(" ")}` : "") + `; ${t("unit")} ${found.unit_on ? t("on") : t("off")}`
    + (c ? `; ${t("chamber")} ${c.air_c.toFixed(1)} °C, ${t("set point")} ${c.set_point_c.toFixed(1)} °C` : "");
  interlocks(at("interlocks"), found);
  if (!c) return;
  chamber = chamber || strip("chamber", t("chamber"), "degC", [t("air"), t("set point"), t("target")]);
  chamber.add(c.time_s, [c.air_c, c.set_point_c, c.target_c]);
}

function live({ live: found }) {
  if (found.bench !== job.bench || !found.job || found.job.id !== job.job || !at("live")) return;
  if (found.job.station !== station) { station = found.job.station; seen = -Infinity; means.clear(); }
  at("progress").value = found.job.fraction;
  const left = { label: found.job.label, bench: span(found.job.eta_s), wall: span(found.job.eta_wall_s) };
  at("live").textContent = found.job.eta_wall_s === null ? t("{label}: {bench} of bench time left", left) : t("{label}: {bench} of bench time left, about {wall} of real time before the analysis", left);
  const planned = stations[station];
  if (found.devices) devices(found.devices, planned && planned.angles ? [planned.angles.outer_deg, planned.angles.middle_deg, planned.angles.inner_deg] : null);
  if (found.samples) samples(found.samples);
}

/** While somebody is asked, the job drives nothing: it waits for the answer. */
function asked({ news }) {
  const place = at("explanation");
  if (!place || news.bench.id !== job.bench || !news.job || news.job.id !== job.job) return;
  place.textContent = news.job.prompt ? t("It waits for a person: what is to be done stands at the top of the page.") : place.dataset.text;
}

if (job.open) {
  feed.on("bench", asked);
  feed.on("job", (message) => { if (message.job === job.job) happened(message.events); });
  feed.on("live", live);
  feed.follow(job.job);
  if (at("live")) {
    setInterval(() => { for (const chart of charts.values()) chart.draw(); table(); }, 250);
    const whole = await read(`/api/v1/jobs/${part(job.job)}`).catch(() => null);
    const plan = whole && await send(`/api/v1/procedures/${part(job.procedure)}/preview`, { unit: job.unit, bench: job.bench, parameters: whole.requested_parameters }).catch(() => null);
    stations = plan ? plan.stations : [];
  }
}
