// Start of a job: unit, procedure, parameters with the preview beside them, one button.
import { part, read, send } from "./api.js";
import { busy } from "./act.js";
import { fill, h, span } from "./dom.js";
import { SchemaForm } from "./form.js";
import { onceAt } from "./once.js";
import { showPreview } from "./preview.js";
import { t } from "./words.js";

const wanted = new URLSearchParams(location.search), at = (id) => document.getElementById(id);
const SOON_MS = 250, CALIBRATE = "calibration_12_orientations", VERIFY = "verification_9_orientations", BOTH = "calibrate_verify";
let procedures = [], benches = [], chosen = null, form = null, key = crypto.randomUUID(), asking = null, timer = null, good = false;

const unit = () => at("unit").value.trim(), bench = () => at("bench").value || undefined;

/** Whether this plan can be started, and the reason beside the buttons where it cannot. */
function ready(can, why = "") {
  good = can;
  for (const id of ["go", "go-both"]) if (at(id)) at(id).disabled = !can;
  at("refusal").className = "refused";
  at("refusal").textContent = why;
}

async function preview() {
  if (asking) asking.abort();
  ready(false, unit() ? "" : t("Choose a unit."));
  if (!chosen || !unit()) return;
  asking = new AbortController();
  let parameters;
  try { parameters = form.values(); } catch { ready(false, t("See the marked fields.")); return; }
  try {
    const plan = await send(`/api/v1/procedures/${part(chosen.name)}/preview`, { unit: unit(), ...(bench() && { bench: bench() }), parameters }, { signal: asking.signal });
    form.resolvedAs(plan.parameters);
    showPreview(at("preview"), plan);
    ready(!plan.violations.length, plan.violations.length ? t("The plan goes beyond a limit of the bench.") : "");
  } catch (error) {
    if (error.name === "AbortError") return;
    const left = form.errors(error.problem && error.problem.errors);
    ready(false, left.length || !(error.problem && (error.problem.errors || []).length) ? error.message : t("See the marked fields."));
    fill(at("preview"), h("p", { class: "note" }, t("There is no preview of this plan.")));
  }
}

function changed() {
  key = crypto.randomUUID();
  ready(false);
  clearTimeout(timer);
  timer = setTimeout(preview, SOON_MS);
}

function choose(procedure, parameters = null) {
  chosen = procedure;
  for (const card of document.querySelectorAll("#cards button")) card.setAttribute("aria-pressed", String(card.dataset.procedure === procedure.name));
  form = new SchemaForm(procedure.parameters, changed);
  if (parameters) form.load(parameters);
  fill(at("form"), h("h2", {}, t(procedure.title)), form.element);
  at("plan").hidden = false;
  at("start").scrollIntoView({ block: "start" });
  at("verify-too").hidden = procedure.name !== CALIBRATE;
  for (const field of form.fields) field.mark();
  preview();
}

async function howLong() {
  const nowhere = at("nowhere");
  nowhere.hidden = true;
  if (!unit()) return;
  const plans = procedures.map((one) => ({ procedure: one.name, unit: unit(), ...(bench() && { bench: bench() }) }));
  const { items } = await send("/api/v1/previews", { plans }).catch(() => ({ items: [] }));
  const common = items.length > 1 && items.every(({ refusal }) => refusal && refusal.detail === items[0].refusal.detail);
  if (common) { nowhere.hidden = false; nowhere.textContent = items[0].refusal.detail; }  // once, not on every card
  items.forEach(({ preview: plan, refusal }, k) => {
    const place = document.querySelector(`#cards [data-procedure="${plans[k].procedure}"] .long`);
    if (place) place.textContent = common ? "" : refusal ? refusal.detail : `${span(plan.duration_s)}, ${t("{n} stations", { n: plan.stations.length })}`;
  });
}

function extras() {
  const given = Object.fromEntries([...new FormData(at("terms"))].filter(([, value]) => value !== "")), out = {};
  for (const name of ["priority", "retries", "seed"]) if (given[name]) out[name] = Number(given[name]);
  if (given.labels) out.labels = Object.fromEntries(given.labels.split(",").map((pair) => pair.split("=").map((word) => word.trim())).filter(([name]) => name).map(([name, value]) => [name, value || "yes"]));
  if (given.deadline) out.deadline_at = new Date(given.deadline).toISOString();
  if (given.not_before) out.not_before = new Date(given.not_before).toISOString();
  return out;
}

async function go() {
  const body = { procedure: chosen.name, unit: unit(), ...(bench() && { bench: bench() }), parameters: form.values(), ...extras() };
  const job = await busy(at("go"), at("refusal"), () => send("/api/v1/jobs", body, { key }));
  if (job) location.href = job.page;
}

async function calibrateThenVerify() {  // a campaign of the service: nothing is stored before the run is accepted
  const parameters = form.values(), { seed, labels } = extras();
  const body = { unit: unit(), ...(bench() && { bench: bench() }), ...(Object.keys(parameters).length && { parameters: { calibrate: parameters } }), seed, labels };
  const later = new FormData(at("terms")).get("not_before");
  if (later && (body.parameters || seed !== undefined)) { at("refusal").textContent = t("A later start of both steps takes their default parameters and a random seed. Reset parameters and seed, clear the time, or schedule a campaign of your own with these steps."); return; }
  const run = await busy(at("go-both"), at("refusal"), () => later ? send("/api/v1/schedules", { campaign: BOTH, unit: body.unit, bench: body.bench, labels, ...onceAt(later) }, { key }) : send(`/api/v1/campaigns/${BOTH}/runs`, body, { key }));
  if (run) location.href = later ? "/campaigns#schedules" : `/campaign-runs/${run.id}`;
}

async function keep() {
  const name = at("plan-name").value.trim();
  const made = await busy(at("keep"), at("kept"), () => send("/api/v1/campaigns", { name, title: name, steps: [{ name: "run", procedure: chosen.name, parameters: form.values() }] }));
  if (made) at("kept").textContent = t("Kept: it stands among the campaigns, to be started or scheduled.");
}

async function begin() {
  let units;
  [procedures, benches, units] = await Promise.all([read("/api/v1/procedures"), read("/api/v1/benches"), read("/api/v1/units")]);
  const serials = [...new Set([...benches.flatMap((one) => one.units), ...units.map((one) => one.serial)])];
  at("serials").append(...serials.map((serial) => h("option", { value: serial })));
  at("bench").append(...benches.map((one) => h("option", { value: one.id }, `${one.id}: ${t(one.state)}`)));
  const from = wanted.get("from") ? await read(`/api/v1/jobs/${part(wanted.get("from"))}`) : null;
  at("unit").value = (from && from.unit) || wanted.get("unit") || sessionStorage.getItem("bench.unit") || (benches[0] && benches[0].units[0]) || serials[0] || "";
  at("bench").value = (from && from.bench) || wanted.get("bench") || (benches[0] && benches[0].id) || "";
  fill(at("cards"), ...procedures.map((procedure) => h("li", {}, h("button", { type: "button", class: "card", "data-procedure": procedure.name, "aria-pressed": "false", onclick: () => choose(procedure) },
    h("strong", {}, t(procedure.title)), h("span", {}, t(procedure.result.description || "").split("\n")[0]), h("span", { class: "note long" })))));
  const name = (from && from.procedure) || wanted.get("procedure"), first = procedures.find((one) => one.name === name);
  if (first) choose(first, from && from.requested_parameters);
  if (!procedures.some((one) => one.name === VERIFY)) at("verify-too").replaceChildren();
  howLong();
}

for (const id of ["unit", "bench"]) at(id).addEventListener("change", () => { sessionStorage.setItem("bench.unit", unit()); if (chosen) preview(); howLong(); });
at("start").addEventListener("submit", (event) => { event.preventDefault(); if (good) go(); });
at("go-both").addEventListener("click", calibrateThenVerify);
at("keep").addEventListener("click", keep);
begin().catch((error) => { at("nowhere").hidden = false; at("nowhere").textContent = error.message; });
