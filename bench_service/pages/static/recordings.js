// Recordings: search, methods run on chosen ones, and the import of files.
import { ask, part, read } from "./api.js";
import { busy } from "./act.js";
import { bytes, h, fill, moment, number, span } from "./dom.js";
import { SchemaForm } from "./form.js";
import { t } from "./words.js";

const at = (id) => document.getElementById(id), search = at("search"), chosen = new Map();
let next = null, body = null, methods = [], form = null, key = crypto.randomUUID();

function count() { at("chosen").textContent = t("{n} chosen", { n: chosen.size }) + (chosen.size ? `: ${[...new Set([...chosen.values()].map((one) => one.unit))].join(", ")}` : ""); }

function row(one) {
  const name = one.station ? `${one.station.index}: ${one.station.label}` : ((one.source.files || [])[0] || {}).name || one.id;
  const box = h("input", { type: "checkbox", checked: chosen.has(one.id), "aria-label": t("Choose {name}", { name }) });
  box.addEventListener("change", () => { if (box.checked) chosen.set(one.id, one); else chosen.delete(one.id); count(); });
  return h("tr", {}, h("td", {}, box), h("td", {}, h("a", { href: `/recordings/${one.id}` }, name)), h("td", {}, h("a", { href: `/units/${part(one.unit)}` }, one.unit)), h("td", {}, one.job ? h("a", { href: `/jobs/${one.job}` }, t("job")) : t("imported")),
    h("td", { class: "n" }, `${number(one.rate_hz)} Hz`), h("td", { class: "n" }, span(one.duration_s)), h("td", { class: "n" }, bytes(one.stored_bytes)), h("td", {}, moment(one.created_at)), h("td", {}, one.warnings.join(" ")));
}

async function find(after = null) {
  const asked = new URLSearchParams([...new FormData(search)].filter(([, value]) => value.trim() !== ""));
  asked.set("limit", "50");
  if (after) asked.set("after", after);
  const page = await busy(search.querySelector("button"), search.querySelector("output"), () => read(`/api/v1/recordings?${asked}`));
  if (!page) return;
  search.querySelector("output").textContent = page.items.length ? "" : t("Nothing found.");
  if (!after) {
    body = h("tbody");
    at("found").replaceChildren(h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Recordings found") }, h("table", {}, h("thead", {}, h("tr", {}, ...["Choose", "Recording", "Unit", "From", "Rate", "Length", "Size", "Made", "Warnings"].map((name) => h("th", {}, t(name))))), body)));
  }
  body.append(...page.items.map(row));
  next = page.next;
  at("older").hidden = !next;
}

function choose(name) {
  const method = methods.find((one) => one.name === name);
  form = new SchemaForm(method.parameters, () => { key = crypto.randomUUID(); });
  at("finds").textContent = t(method.result.description || "");
  fill(at("form"), form.element);
}

async function analyse(event) {
  event.preventDefault();
  const made = await busy(at("go"), at("refusal"), async () => {
    if (!chosen.size) throw new Error(t("Choose recordings in the list above first."));
    try { return await ask("POST", "/api/v1/analyses", { method: at("method").value, recordings: [...chosen.keys()], parameters: form.values() }, { key, patience: 300000 }); }
    catch (error) { form.errors(error.problem && error.problem.errors); throw error; }
  });
  if (made) location.href = made.page;
}

const TEMPLATE = { unit: "", rate_hz: 100, channels: [{ name: "gyro_x", column: 0, quantity: "angular_rate", unit: "deg/s" }] };

function looked(found) {
  const columns = found.columns || [], doubts = [...(found.unknown || []), ...(found.suspicious || [])];
  fill(at("looked"), found.title && h("p", {}, `${found.title}. ${found.rate_hz ? `${number(found.rate_hz)} Hz. ` : ""}${(found.notes || []).join(" ")}`),
    ...doubts.map((text) => h("p", { class: "warning" }, text)),
    columns.length && !found.first && h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Columns of the file") }, h("table", {}, h("thead", {}, h("tr", {}, ...Object.keys(columns[0]).map((name) => h("th", {}, name)))),
      h("tbody", {}, ...columns.map((one) => h("tr", {}, ...Object.values(one).map((value) => h("td", {}, value === null ? "–" : Array.isArray(value) ? value.join(", ") : String(value)))))))),
    found.first && h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("First rows of the file") }, h("table", {}, h("thead", {}, h("tr", {}, ...columns.map((one) => h("th", {}, one)))),
      h("tbody", {}, ...found.first.slice(0, 8).map((cells) => h("tr", {}, ...cells.map((one) => h("td", {}, String(one)))))))));
}

async function firstRows(file) {  // a text file, read here: the service proposes more where it can
  const head = await file.slice(0, 4000).text(), lines = head.split(/\r?\n/).slice(0, 9);
  if (head.includes("\0")) return { columns: [], suspicious: [t("The file is no text: its columns are named by the file itself, or by the service.")] };
  const split = (line) => line.split(line.includes(";") ? ";" : line.includes("\t") ? "\t" : line.includes(",") ? "," : /\s+/);
  const rows = lines.filter(Boolean).map(split), width = Math.max(0, ...rows.map((cells) => cells.length));
  return { columns: [...Array(width).keys()], first: rows, suspicious: [] };
}

async function dropped() {
  const files = [...at("files").files];
  if (!files.length) return;
  at("step").hidden = false;
  const sent = new FormData();
  sent.append("file", files[0], files[0].name);
  if (at("import-unit").value.trim()) sent.append("unit", at("import-unit").value.trim());
  let found;
  try { found = await ask("POST", "/api/v1/recordings/describe", sent, { patience: 60000 }); }
  catch (error) {
    found = await firstRows(files[0]);
    if (error.status !== 404 && error.status !== 405) found.suspicious.push(error.message);
  }
  looked(found);
  at("description").value = JSON.stringify(found.description || TEMPLATE, null, 2);
}

async function bring(event) {
  event.preventDefault();
  const output = at("wizard").querySelector("output");
  const made = await busy(at("wizard").querySelector("button"), output, () => {
    let description;
    try { description = JSON.parse(at("description").value); } catch (error) { throw new Error(`${t("The description is no JSON:")} ${error.message}`); }
    if (at("import-unit").value.trim()) description.unit = at("import-unit").value.trim();
    const sent = new FormData();
    for (const file of at("files").files) sent.append("files", file, file.name);
    sent.append("description", JSON.stringify(description));
    return ask("POST", "/api/v1/recordings", sent, { key: crypto.randomUUID(), patience: 600000 });
  });
  if (made) location.href = `/recordings/${made.id}`;
}

search.addEventListener("submit", (event) => { event.preventDefault(); find(); });
at("older").addEventListener("click", () => find(next));
at("method").addEventListener("change", () => choose(at("method").value));
at("analyse").addEventListener("submit", analyse);
at("files").addEventListener("change", dropped);
at("wizard").addEventListener("submit", bring);
for (const kind of ["dragover", "drop", "dragleave"]) at("drop").addEventListener(kind, (event) => {
  event.preventDefault();
  at("drop").classList.toggle("over", kind === "dragover");
  if (kind === "drop") { at("files").files = event.dataTransfer.files; dropped(); }
});
for (const [name, value] of new URLSearchParams(location.search)) if (search.elements[name]) search.elements[name].value = value;
count();
find();
read("/api/v1/methods").then((all) => {
  methods = all;
  at("method").append(...all.map((one) => h("option", { value: one.name }, t(one.title))));
  if (all.length) choose(all[0].name);
}).catch((error) => { at("refusal").className = "refused"; at("refusal").textContent = error.message; });
