// Entering known coefficients of a triad: value, standard uncertainty and origin.
import { iAm, me, part, send } from "./api.js";
import { busy } from "./act.js";
import { h } from "./dom.js";
import { t } from "./words.js";

const NAMES = [..."123"].flatMap((row) => [`b_${"xyz"[row - 1]}`, ...[..."123"].map((column) => `K${row}${column}`)]);
const UNITS = { gyro: [["deg/h", "rad/s", "count"], ["1", "ppm", "count/(rad/s)"]], accelerometer: [["µg", "m/s^2", "count"], ["1", "ppm", "count/(m/s^2)"]] };
const form = document.getElementById("enter"), field = (name) => form.elements.namedItem(name), output = form.querySelector("output");
const moment = (text) => text ? new Date(text).toISOString() : null;

function units() {
  const [b, k] = UNITS[field("triad").value];
  for (const [name, list] of [["unit_b", b], ["unit_k", k]]) field(name).replaceChildren(...list.map((one) => h("option", { value: one }, one)));
}

const number = (name, coefficient, value, label, more = {}) => h("input", { type: "number", step: "any", required: true, size: 14, name: `${name}-${coefficient}`, value, "aria-label": `${label} ${coefficient}`, ...more });

document.getElementById("coefficients").append(...NAMES.map((one) => h("tr", { "data-coefficient": one }, h("th", { scope: "row" }, one),
  h("td", {}, number("value", one, /^K([123])\1$/.test(one) ? 1 : 0, t("Value of"))), h("td", {}, number("doubt", one, "", t("Standard uncertainty of"), { min: 0 })))));

function entry() {
  const of = (coefficient) => field(coefficient.startsWith("b") ? "unit_b" : "unit_k").value;
  return { triad: field("triad").value, origin: field("origin").value.trim(), choose: field("choose").checked, remark: field("remark").value.trim(), measured_at: moment(field("measured_at").value), valid_until: moment(field("valid_until").value),
    ...(field("by").value.trim() && { by: field("by").value.trim() }),
    coefficients: NAMES.map((name) => ({ name, value: Number(field(`value-${name}`).value), unit: of(name), standard_uncertainty: Number(field(`doubt-${name}`).value) })) };
}

function wrong(problem) {  // marks the numbers that were refused
  for (const row of form.querySelectorAll("tr.wrong")) row.classList.remove("wrong");
  for (const { field: path } of (problem && problem.errors) || []) {
    const found = /coefficients\.(\d+)/.exec(path), row = found && form.querySelector(`[data-coefficient="${NAMES[Number(found[1])]}"]`);
    if (row) row.classList.add("wrong");
  }
}

field("by").value = me();
units();
field("triad").addEventListener("change", units);
form.addEventListener("submit", async (event) => {
  event.preventDefault();
  if (field("by").value.trim()) iAm(field("by").value.trim());
  const made = await busy(form.querySelector("button.go"), output, async () => {
    try { wrong(null); return await send(`/api/v1/units/${part(form.dataset.unit)}/calibrations`, entry(), { key: crypto.randomUUID() }); }
    catch (error) { wrong(error.problem); throw error; }
  });
  if (made) location.href = `/units/${part(form.dataset.unit)}`;
});
