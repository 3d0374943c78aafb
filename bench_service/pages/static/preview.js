// A plan before anything moves: stations, time, data, predicted uncertainty beside the limits, warnings.
import { attitude } from "./table3d.js";
import { bytes, doubt, fill, h, number, shownIn, span } from "./dom.js";
import { t } from "./words.js";

const SHOWN = 40;

const OF_MAGNITUDES = /^(gyro|accelerometer)\.sd after correction$/;  // of a verification: it is held to its limit as δ/√3

/** Limits of the parameters that a predicted uncertainty is about: by triad and kind of coefficient, in the limit's unit. */
function limitsFor({ name }, limits) {
  const magnitude = OF_MAGNITUDES.exec(name);
  if (magnitude) return Object.entries(limits || {}).filter(([key, value]) => key.startsWith(`${magnitude[1]}_bias_in_run_`) && typeof value === "number");
  const found = /^(gyro|accelerometer)\.(b_[xyz]|K([123])\3)$/.exec(name);
  if (!found) return [];
  const stem = `${found[1]}_${found[2].startsWith("b") ? "bias" : "scale"}_`;
  return Object.entries(limits || {}).filter(([key, value]) => key.startsWith(stem) && typeof value === "number");
}
const SIZES = [["_deg_h", Math.PI / 180 / 3600, "deg/h"], ["_ppm", 1e-6, "ppm"], ["_m_s2", 1, "m/s²"]];
function inLimitsUnit(key, value) {
  const [, size, unit] = SIZES.find(([end]) => key.endsWith(end)) || [null, 1, ""];
  return [value / size, unit];
}

function uncertainties(plan) {
  if (!plan.predicted_uncertainties.length) return h("p", { class: "note" }, t("This procedure predicts no uncertainties."));
  const rows = plan.predicted_uncertainties.map((one) => {
    const limits = limitsFor(one, plan.parameters.limits), [unit, size] = shownIn(one.unit);
    const against = limits.map(([key, limit]) => {
      const [value, in_] = inLimitsUnit(key, one.standard_uncertainty / (OF_MAGNITUDES.test(one.name) ? Math.sqrt(3) : 1));
      return h("div", {}, h("span", { class: `badge ${value > limit ? "fail" : "pass"}` }, `${doubt(value)} ${t("of")} ${limit} ${in_}`));
    });
    return h("tr", {}, h("th", { scope: "row" }, one.name), h("td", { class: "n" }, one.unit === "1" ? `${doubt(one.standard_uncertainty * 1e6)} ppm` : `${doubt(one.standard_uncertainty / size)} ${unit}`), h("td", {}, against));
  });
  return h("details", { open: true }, h("summary", {}, t("Predicted standard uncertainty beside its limits")), h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Predicted uncertainties") }, h("table", {},
    h("thead", {}, h("tr", {}, h("th", {}, t("Coefficient")), h("th", { class: "n" }, t("± predicted")), h("th", {}, t("Beside the limit")))), h("tbody", {}, ...rows))));
}

function stations(plan) {
  const canvas = h("canvas", { width: 260, height: 200, role: "img", "aria-label": t("The table at the chosen station") });
  const first = plan.stations.find((one) => one.angles);
  const list = h("select", { size: Math.min(6, Math.max(2, plan.stations.length)), "aria-label": t("Stations") }, ...plan.stations.slice(0, SHOWN).map((one) =>
    h("option", { value: one.index }, `${one.index}: ${one.label}; ${span(one.record_s)}${one.temperature_c === null ? "" : `; ${one.temperature_c} °C`}`)));
  list.addEventListener("change", () => { const one = plan.stations[Number(list.value)]; if (one && one.angles) attitude(canvas, [one.angles.outer_deg, one.angles.middle_deg, one.angles.inner_deg]); });
  const box = h("details", { open: true }, h("summary", {}, t("{n} stations", { n: plan.stations.length })), h("div", { class: "verbs" }, list, first && canvas));
  if (first) attitude(canvas, [first.angles.outer_deg, first.angles.middle_deg, first.angles.inner_deg]);
  return box;
}

export function showPreview(element, plan) {
  fill(element,
    h("p", { class: "big" }, `${span(plan.duration_s)} ${t("of bench time")}, ${bytes(plan.data_bytes)}`),
    ...plan.violations.map((text) => h("p", { class: "stopped" }, t("Beyond a limit of the bench:"), " ", text)),
    ...plan.warnings.map((text) => h("p", { class: "warning" }, text)),
    plan.basis && h("p", { class: "note" }, t("The prediction rests on:"), " ", plan.basis),
    stations(plan), uncertainties(plan));
}

export { number };
