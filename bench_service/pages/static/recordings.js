// Recordings: search, methods run on chosen ones, and the import of files.
import { ask, part, read } from "./api.js";
import { busy } from "./act.js";
import * as batches from "./batches.js";
import { bytes, h, fill, moment, number, span, titled } from "./dom.js";
import { SchemaForm } from "./form.js";
import "./import_wizard.js";
import { choosePeriod, moments } from "./period.js";
import { t } from "./words.js";

const at = (id) => document.getElementById(id), search = at("search"), chosen = new Map();
let next = null, shown = null, body = null, methods = [], form = null, key = crypto.randomUUID();

const nameOf = (one) => one.station ? `${one.station.index}: ${one.station.label}` : ((one.source.files || [])[0] || {}).name || one.id;

/** The job of a recording by number and procedure, as the list of recordings has them. */
function jobOf(one) {
  return h("a", { href: `/jobs/${one.job}` }, one.job_number === null ? t("job") : `#${one.job_number} ${titled(one.procedure)}`);
}

function count() { at("chosen").textContent = t("{n} chosen", { n: chosen.size }) + (chosen.size ? `: ${[...new Set([...chosen.values()].map((one) => `${one.unit} ${nameOf(one)}`))].slice(0, 3).join(", ")}${chosen.size > 3 ? ", …" : ""}` : ""); }

function row(one) {
  const name = nameOf(one);
  const box = h("input", { type: "checkbox", "data-recording": one.id, checked: chosen.has(one.id), "aria-label": t("Choose {name}", { name }) });
  box.addEventListener("change", () => { if (box.checked) chosen.set(one.id, one); else chosen.delete(one.id); count(); });
  return h("tr", {}, h("td", {}, box), h("td", {}, h("a", { href: `/recordings/${one.id}` }, name)), h("td", {}, h("a", { href: `/units/${part(one.unit)}` }, one.unit)), h("td", {}, one.job ? jobOf(one) : t("imported")),
    h("td", { class: "n" }, `${number(one.rate_hz)} Hz`), h("td", { class: "n" }, span(one.duration_s)), h("td", { class: "n" }, bytes(one.stored_bytes)), h("td", {}, moment(one.created_at)), h("td", {}, one.warnings.join(" ")));
}

async function find(after = null) {
  const typed = [...new FormData(search)].map(([name, value]) => [name, value.trim()]).filter(([, value]) => value);
  const given = after ? shown : Object.entries(moments(Object.fromEntries(typed)));
  const asked = new URLSearchParams([...given, ["limit", "50"], ...(after ? [["after", after]] : [])]);
  const page = await busy(search.querySelector("button"), search.querySelector("output"), () => read(`/api/v1/recordings?${asked}`));
  if (!page) return;
  shown = given;
  search.querySelector("output").textContent = page.items.length ? "" : t("Nothing found.");
  if (!after) {
    body = h("tbody");
    at("found").replaceChildren(h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Recordings found") }, h("table", {}, h("thead", {}, h("tr", {}, ...["Choose", "Recording", "Unit", "From", "Rate", "Length", "Size", "Made", "Warnings"].map((name) => h("th", {}, t(name))))), body)));
  }
  body.append(...page.items.map(row));
  next = page.next;
  at("older").hidden = !next;
}

/** Chooses recordings that the address names, as another page has asked for; one that the list does not show is put first. */
async function chooseNamed(ids) {
  for (const id of ids) {
    const one = await read(`/api/v1/recordings/${part(id)}`).catch(() => null);
    if (!one) continue;
    chosen.set(id, one);
    const shownAlready = body && body.querySelector(`input[data-recording="${CSS.escape(id)}"]`);
    if (shownAlready) shownAlready.checked = true;
    else if (body) body.prepend(row(one));
  }
  count();
}

function choose(name) {
  const method = methods.find((one) => one.name === name);
  form = new SchemaForm(method.parameters, () => { key = crypto.randomUUID(); });
  at("finds").textContent = t(method.result.description || "");
  fill(at("form"), form.element);
}

/** The recordings of the analysis: the chosen ones together, or in a batch all that the search above shows. */
function evidence() {
  const each = at("each").value;
  if (!each) {
    if (!chosen.size) throw new Error(t("Choose recordings in the list above first."));
    return { recordings: [...chosen.keys()] };
  }
  if (!shown) throw new Error(t("Choose recordings in the list above first."));
  return { each, selection: Object.fromEntries(shown) };
}

async function analyse(event) {
  event.preventDefault();
  const made = await busy(at("go"), at("refusal"), async () => {
    try { return await ask("POST", "/api/v1/analyses", { method: at("method").value, ...evidence(), parameters: form.values() }, { key, patience: 300000 }); }
    catch (error) { form.errors(error.problem && error.problem.errors); throw error; }
  });
  if (!made) return;
  if (made.page) { location.href = made.page; return; }
  key = crypto.randomUUID();
  at("refusal").textContent = t("The batch is queued: its progress is shown below.");
  await batches.show();
  document.getElementById("batches").scrollIntoView({ block: "nearest" });
}

const showPeriod = choosePeriod(search, () => find());
search.addEventListener("submit", (event) => { event.preventDefault(); find(); });
at("older").addEventListener("click", () => find(next));
at("method").addEventListener("change", () => choose(at("method").value));
at("analyse").addEventListener("submit", analyse);
const wanted = new URLSearchParams(location.search);
for (const [name, value] of wanted) if (search.elements[name]) search.elements[name].value = value;
showPeriod();
count();
find().then(() => chooseNamed(wanted.getAll("recording")));
read("/api/v1/methods").then((all) => {
  methods = all;
  batches.named(all);
  at("method").append(...all.map((one) => h("option", { value: one.name }, t(one.title))));
  if (all.length) choose(all[0].name);
  return batches.show();
}).catch((error) => { at("refusal").className = "refused"; at("refusal").textContent = error.message; });
