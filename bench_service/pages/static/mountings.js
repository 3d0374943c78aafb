// Mountings: which unit is on which plate of which bench, with its azimuth; entering and ending one; how well they repeat.
import { iAm, me, part, read, send } from "./api.js";
import { busy, verb } from "./act.js";
import { badge, doubt, fill, h, moment, number, short } from "./dom.js";
import { t } from "./words.js";

const PAGE = 50, ARCSEC = 3600;
const filter = document.getElementById("filter"), enter = document.getElementById("enter"), older = document.getElementById("older");
let items = [], next = null;

const sdDeg = (one) => one.azimuth_sd_arcsec / ARCSEC;

function row(one) {
  return h("tr", { "data-mounting": one.id }, h("td", {}, h("a", { href: `/units/${part(one.unit)}` }, one.unit)), h("td", {}, one.bench), h("td", {}, one.plate),
    h("td", { class: "n" }, `${number(one.azimuth_deg, sdDeg(one))}° ± ${doubt(one.azimuth_sd_arcsec)}″`), h("td", {}, `${one.by}${one.proven ? "" : ` (${t("declared")})`}`), h("td", {}, moment(one.mounted_at)),
    h("td", {}, one.instrument), h("td", {}, one.remark), h("td", {}, one.stands ? badge("stands", "pass") : [t("until"), " ", moment(one.ended_at)]), h("td", {}, h("code", { title: one.id }, short(one.id))),
    h("td", {}, one.stands && verb(t("Taken off"), { path: `/api/v1/mountings/${part(one.id)}/end`, then: search,
      confirm: { title: t("Was the unit taken off?"), lost: t("The bench's declared azimuth counts again for its jobs. A new mounting needs a new reading."), verb: t("It was taken off"), by: true } })));
}

function list() {
  fill(document.getElementById("found"), items.length ? h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Mountings") }, h("table", {},
    h("thead", {}, h("tr", {}, ...["Unit", "Bench", "Plate", "Azimuth", "By", "Mounted", "Instrument of the reading: theodolite and prism", "Remark", "State", "Mounting", "Do"].map((name) => h("th", {}, t(name))))),
    h("tbody", {}, ...items.map(row)))) : h("p", { class: "note" }, t("No mounting was entered yet.")));
  older.hidden = !next;
  repeats();
}

/** Angles near ±180° are spread about one of them, and not about zero. */
function spreadArcsec(group) {
  const first = group[0].azimuth_deg, away = group.map((one) => { const d = one.azimuth_deg - first; return d - 360 * Math.round(d / 360); });
  const mean = away.reduce((a, b) => a + b, 0) / away.length;
  return ARCSEC * Math.sqrt(away.reduce((sum, one) => sum + (one - mean) ** 2, 0) / (away.length - 1));
}

function repeats() {
  const groups = new Map();
  for (const one of items) {
    const key = JSON.stringify([one.unit, one.bench, one.plate]);
    groups.set(key, [...(groups.get(key) || []), one]);
  }
  const several = [...groups.values()].filter((group) => group.length > 1), place = document.getElementById("repeats");
  if (!several.length) {
    fill(place, h("p", { class: "note" }, t("A unit that was mounted twice on the same plate has a spread.")));
    return;
  }
  const heads = h("tr", {}, ...["Unit", "Bench", "Plate", "Mountings", "Spread, ″", "One reading, ″", "Seat"].map((name) => h("th", {}, t(name))));
  fill(place, h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Repeatability") }, h("table", {}, h("thead", {}, heads), h("tbody", {}, ...several.map(repeat)))));
}

function repeat(group) {
  const [{ unit, bench, plate }] = group, reading = Math.sqrt(group.reduce((sum, one) => sum + one.azimuth_sd_arcsec ** 2, 0) / group.length);
  return h("tr", {}, h("td", {}, unit), h("td", {}, bench), h("td", {}, plate), h("td", { class: "n" }, group.length),
    h("td", { class: "n" }, spreadArcsec(group).toFixed(2)), h("td", { class: "n" }, reading.toFixed(2)),
    h("td", {}, verb(t("From the unit's calibrations"), { path: "/api/v1/analyses", body: () => ({ method: "mounting_repeatability", calibrations: chosen(unit) }), then: (made) => { location.href = `/results/${part(made.id)}`; } })));
}

const calibrations = new Map();
const chosen = (unit) => calibrations.get(unit) || [];

async function learn() {
  for (const unit of new Set(items.map((one) => one.unit))) {
    if (calibrations.has(unit)) continue;
    const found = (await read(`/api/v1/units/${part(unit)}/calibrations?limit=100`)).items;
    calibrations.set(unit, found.filter((one) => one.triad === "gyro").map((one) => one.id));
  }
}

async function search(more = false) {
  const query = new URLSearchParams({ limit: PAGE });
  for (const [name, value] of new FormData(filter)) if (value) query.set(name, value);
  if (more === true && next) query.set("after", next);
  try {
    const page = await read(`/api/v1/mountings?${query}`);
    items = more === true ? [...items, ...page.items] : page.items;
    next = page.next;
    await learn();
    list();
  } catch (error) { fill(document.getElementById("found"), h("p", { class: "warning" }, error.message)); }
}

filter.addEventListener("change", () => search());
filter.addEventListener("submit", (event) => { event.preventDefault(); search(); });
older.addEventListener("click", () => search(true));
enter.elements.namedItem("by").value = me();
enter.addEventListener("submit", (event) => {
  event.preventDefault();
  const given = Object.fromEntries([...new FormData(enter)].filter(([, value]) => value !== ""));
  if (given.by) iAm(given.by);
  busy(enter.querySelector("button"), enter.querySelector("output"), async () => {
    await send("/api/v1/mountings", { ...given, azimuth_deg: Number(given.azimuth_deg), azimuth_sd_arcsec: Number(given.azimuth_sd_arcsec) }, { key: crypto.randomUUID() });
    await search();
  });
});
search();
