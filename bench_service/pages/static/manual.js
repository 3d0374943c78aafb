// Manual mode of a bench: the lease, demands with their limits beside them, readings as they come, and the halt by Escape.
import { ask, iAm, me, part, read, send } from "./api.js";
import { busy, verb } from "./act.js";
import { badge, fill, h, moment, number, span } from "./dom.js";
import * as feed from "./feed.js";
import { t } from "./words.js";

const LOOK_MS = 2000, OUTCOME_MS = 200;
const place = document.getElementById("lease"), begin = document.getElementById("begin"), demands = document.getElementById("demands");
const bench = place.dataset.bench, base = `/api/v1/benches/${part(bench)}/manual`;
let lease = null, shown = null, timer = null;

const where = () => `${base}/${part(lease.id)}`;
const left = () => Math.max(0, (new Date(lease.until) - Date.now()) / 1000);

function named() {  // whoever demands is the holder: without a log-in the name that this browser keeps
  return me() ? { by: me() } : {};
}

function head() {
  if (!lease) return [h("p", {}, t("The bench is not in manual mode."), shown && shown.ended_because ? ` ${t("The last lease ended:")} ${shown.ended_because}.` : "")];
  return [
    h("p", {}, badge("running"), " ", t("In manual mode by {holder} until", { holder: lease.holder }), " ", moment(lease.until), ` (${t("Left:")} ${span(left())}). ${lease.reason}. ${t("Unit on the table")}: ${lease.unit}.`),
    h("div", { class: "verbs" },
      verb(t("Ten minutes from now"), { path: `${where()}/renew`, body: () => ({ minutes: 10, ...named() }), then: look }),
      verb(t("End manual mode"), { path: `${where()}/end`, body: named, then: look })),
  ];
}

function show() {
  fill(place, ...head());
  document.getElementById("beginning").hidden = Boolean(lease);
  demands.hidden = !lease;
}

async function look() {
  clearTimeout(timer);
  timer = setTimeout(look, LOOK_MS);
  if (feed.state.alive === false) return;
  try {
    const [newest] = (await read(`${base}?limit=1`)).items;
    shown = newest || null;
    lease = newest && !newest.ended_at ? newest : null;
    show();
    if (newest) made((await read(`${base}/${part(newest.id)}/demands?limit=20`)).items);
  } catch (error) { fill(place, h("p", { class: "warning" }, error.message)); }
}

function made(items) {
  fill(document.getElementById("made"), items.length ? h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Demands so far") }, h("table", {},
    h("thead", {}, h("tr", {}, ...["At", "Demand", "Values", "State", "Outcome"].map((name) => h("th", {}, t(name))))),
    h("tbody", {}, ...items.map((one) => h("tr", { "data-key": one.key }, h("td", {}, moment(one.at)), h("td", {}, one.kind.replaceAll("_", " ")), h("td", {}, Object.entries(one.values).filter(([, value]) => value !== null).map(([name, value]) => `${name} = ${value}`).join(", ")),
      h("td", {}, badge(one.state)), h("td", {}, one.text)))))) : h("p", { class: "note" }, t("None yet.")));
}

/** Makes a demand and waits for what becomes of it; raises where it was not done. */
async function demand(kind, values) {
  if (!lease) throw new Error(t("The bench is not in manual mode."));
  const key = crypto.randomUUID();
  let one = await ask("POST", `${where()}/demands`, { kind, ...values, ...named() }, { key });
  const path = `${where()}/demands/${part(key)}`;
  while (!one.over) {
    await new Promise((go) => setTimeout(go, OUTCOME_MS));
    one = await read(path);
  }
  look();
  if (one.state !== "done") throw new Error(`${t(one.state)}: ${one.text}`);
  return one.text || t("Done.");
}

function valuesOf(form) {
  const given = [...new FormData(form)].filter(([, value]) => value !== "");
  return Object.fromEntries(given.map(([name, value]) => [name, name === "axis" ? value : Number(value)]));
}

for (const form of document.querySelectorAll("form.demand")) {
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const output = form.querySelector("output"), { kind } = form.dataset;
    busy(form.querySelector("button"), output, () => demand(kind, valuesOf(form)));
  });
}

begin.addEventListener("submit", (event) => {
  event.preventDefault();
  const given = Object.fromEntries([...new FormData(begin)].filter(([, value]) => value !== ""));
  busy(begin.querySelector("button"), begin.querySelector("output"), async () => {
    const made = await send(base, { ...given, minutes: Number(given.minutes), ...named() }, { key: crypto.randomUUID() });
    if (!me() && !document.querySelector('meta[name="csrf"]')) iAm(made.holder);
    await look();
  });
});

document.addEventListener("keydown", (event) => {
  if (event.key !== "Escape" || !lease) return;
  const form = document.querySelector('form.demand[data-kind="halt"]');
  busy(form.querySelector("button"), form.querySelector("output"), () => demand("halt", {}));
});

const plain = (value, digits) => (Number(value.toFixed(digits)) || 0).toFixed(digits);  // never -0.0000
const row = (name, value, unit, digits) => h("tr", {}, h("td", {}, name), h("td", { class: "n" }, typeof value === "number" ? plain(value, digits) : value), h("td", {}, unit));

function readings(live) {
  const { devices, manual } = live, rates = devices.rates_deg_s || [];
  const rows = ["outer", "middle", "inner"].flatMap((axis, k) => [row(`${t(axis)}`, devices[`${axis}_deg`], "°", 4), rates[k] !== undefined && row(`${t(axis)}: ${t("rate")}`, rates[k], "°/s", 4)]);
  const { chamber } = devices;
  rows.push(row(t("Table"), devices.moving ? t("moves") : t("rests"), manual ? manual.doing.replaceAll("_", " ") : ""));
  if (chamber) rows.push(row(t("Air"), chamber.air_c, "°C", 2), row(t("Set point"), chamber.target_c === null ? t("off") : chamber.target_c, "°C", 2));
  rows.push(row(t("Supply of the unit"), devices.unit_on ? t("switched on") : t("off"), ""));
  if (devices.voltage_v !== null) rows.push(row(t("Voltage"), devices.voltage_v, "V", 3));
  if (devices.current_a !== null) rows.push(row(t("Current"), devices.current_a, "A", 3));
  for (const sensor of manual ? manual.sensors : []) rows.push(row(sensor.name, number(sensor.value), sensor.unit));
  if (manual && manual.sensors_problem) rows.push(row(t("Unit"), manual.sensors_problem, ""));
  for (const word of devices.status) rows.push(row(`${word.device} ${word.name}`, word.raw, [word.bits.join(", "), " ", moment(word.since)]));
  return h("table", {}, h("thead", {}, h("tr", {}, ...["Reading", "Value", "Measured in"].map((name) => h("th", {}, t(name))))), h("tbody", {}, ...rows.filter(Boolean)));
}

feed.on("live", ({ live }) => {
  if (live.bench !== bench) return;
  const box = document.getElementById("readings");
  fill(box, live.devices ? readings(live) : h("p", { class: "note" }, t("Nobody has the devices open.")));
  if (lease && live.manual && live.manual.lease === lease.id) show();
  else if (Boolean(live.manual) !== Boolean(lease)) look();
});
look();
