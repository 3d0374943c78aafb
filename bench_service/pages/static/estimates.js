// Estimates of a running job so far: bias and Allan deviation of the dwell, coefficients after each station.
import { part, read } from "./api.js";
import { Curves } from "./charts.js";
import { doubt, fill, h, number, shownIn, span } from "./dom.js";
import { t } from "./words.js";

const place = document.getElementById("estimates"), EVERY_MS = 10000;
const charts = new Map(), boxes = {};
let timer = null, soon = false;

const triadOf = (channel) => channel.replace(/_[xyz]$/, "");

function chart(key, within, make) {
  if (!charts.has(key)) { charts.set(key, make()); within.append(charts.get(key).element); }
  return charts.get(key);
}

/** The members of each triad, which share an axis of time. */
function triads(list) {
  const found = new Map();
  for (const one of list) found.set(triadOf(one.channel), [...(found.get(triadOf(one.channel)) || []), one]);
  return found;
}

function allan(dwell) {
  for (const [triad, members] of triads(dwell.allan)) {
    const [unit, size] = shownIn(members[0].unit), names = members.flatMap((one) => [one.channel, `${one.channel} −`, `${one.channel} +`]);
    const dashed = names.filter((name) => /[−+]$/.test(name));
    chart(`allan ${triad}`, boxes.charts, () => new Curves(t("Allan deviation so far: {triad}, {unit}", { triad: t(triad), unit }), names, { xLabel: "τ, s", logX: true, logY: true, dashed }))
      .show([members[0].tau_s, ...members.flatMap((one) => [one.deviation, one.lower, one.upper].map((column) => column.map((v) => v / size)))]);
  }
}

function bias(dwell) {
  for (const [triad, members] of triads(dwell.bias)) {
    const [unit, size] = shownIn(members[0].unit), names = members.flatMap((one) => [one.channel, `${one.channel} −`, `${one.channel} +`]);
    const off = (one) => one.estimate;  // the course is shown as the difference from the newest estimate
    chart(`bias ${triad}`, boxes.charts, () => new Curves(t("Kalman estimate so far, less the newest: {triad}, {unit}", { triad: t(triad), unit }), names, { xLabel: t("time in the dwell, s"), dashed: names.filter((name) => /[−+]$/.test(name)) }))
      .show([members[0].at_s, ...members.flatMap((one) => [0, -1, 1].map((sign) => one.course.map((v, k) => (v - off(one) + sign * one.course_uncertainty[k]) / size)))]);
  }
  const rows = dwell.bias.map((one) => {
    const [unit, size] = shownIn(one.unit), odd = one.innovations_rms > 1.5;
    return h("tr", {}, h("th", { scope: "row" }, one.channel), h("td", { class: "n" }, number(one.estimate / size, one.standard_uncertainty / size)), h("td", { class: "n" }, doubt(one.standard_uncertainty / size)), h("td", {}, unit),
      h("td", { class: "n" }, odd ? h("span", { class: "badge error" }, one.innovations_rms.toFixed(2)) : one.innovations_rms.toFixed(2)), h("td", {}, one.noise_known ? t("the unit's noise") : t("noise of this dwell")));
  });
  fill(boxes.bias, h("p", { class: "note" }, t("Of {label}, {span} recorded. A constant output is estimated: the bias and the input of this orientation together. Innovations are about 1 where the noise is as it was taken.", { label: dwell.label, span: span(dwell.recorded_s) })),
    rows.length > 0 && h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Kalman estimates so far") }, h("table", {}, h("thead", {}, h("tr", {}, ...["Channel", "Estimate", "± standard uncertainty", "Unit", "Innovations", "Noise from"].map((name) => h("th", {}, t(name))))), h("tbody", {}, ...rows))),
    ...[...new Set(Object.values(dwell.not_estimated))].map((text) => h("p", { class: "note" }, t("Not yet:"), " ", text)));
}

const shown = (name, unit) => name.startsWith("b") ? shownIn(unit) : ["ppm", 1e-6];

function coefficients(list) {
  for (const { triad, coefficients: all } of list) {
    const names = ["b_x", "b_y", "b_z", "K11", "K22", "K33"].filter((name) => all.some((one) => one.name === name)), chosen = names.map((name) => all.find((one) => one.name === name));
    for (const [kind, title] of [["b", t("biases")], ["K", t("scale factors")]]) {
      const members = chosen.filter((one) => one.name.startsWith(kind)), [unit] = shown(kind, members[0].unit);
      chart(`${triad} ${kind}`, boxes.charts, () => new Curves(`${t("Uncertainty after each station")}: ${t(triad)}, ${title}, ${unit}`, members.map((one) => one.name), { xLabel: t("stations"), logY: true }))
        .show([members[0].values.map((_, k) => k + 1), ...members.map((one) => one.standard_uncertainties.map((v) => v / shown(one.name, one.unit)[1]))]);
    }
  }
  fill(boxes.coefficients, ...list.map(({ triad, coefficients: all }) => h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": `${t("Coefficients so far")}: ${t(triad)}` }, h("table", {}, h("thead", {}, h("tr", {}, h("th", {}, t(triad)), ...["Value", "± standard uncertainty", "Unit"].map((name) => h("th", {}, t(name))))),
    h("tbody", {}, ...all.map((one) => {
      const [unit, size] = shown(one.name, one.unit), n = one.values.length - 1, nominal = /^K([123])\1$/.test(one.name) ? 1 : 0, u = one.standard_uncertainties[n] / size;
      return h("tr", {}, h("th", { scope: "row" }, nominal ? `${one.name} − 1` : one.name), one.determined ? [h("td", { class: "n" }, number((one.values[n] - nominal) / size, u)), h("td", { class: "n" }, doubt(u)), h("td", {}, unit)] : h("td", { colspan: 3, class: "note" }, t("not determined by the stations so far")));
    }))))));
}

async function look() {
  soon = false;
  clearTimeout(timer);
  timer = setTimeout(look, EVERY_MS);
  if (document.hidden) return;
  const found = await read(`/api/v1/jobs/${part(place.dataset.of)}/estimates`).catch(() => null);
  if (!found) return;  // it is asked again; the page says by itself where the service is away
  if (!boxes.charts && (found.dwell || found.coefficients.length)) {
    Object.assign(boxes, { charts: h("div", { class: "charts" }), bias: h("div"), coefficients: h("div", { class: "split" }) });
    place.append(h("h2", {}, t("Estimates so far")), boxes.charts, boxes.bias, boxes.coefficients);
  }
  if (found.dwell) { allan(found.dwell); bias(found.dwell); }
  if (found.coefficients.length) coefficients(found.coefficients);
}

/** Look again within half a second of a station's end; a look that is due is not put off by the next station. */
export function stationDone() {
  if (!place || soon) return;
  soon = true;
  clearTimeout(timer);
  timer = setTimeout(look, 500);
}

if (place) look();
