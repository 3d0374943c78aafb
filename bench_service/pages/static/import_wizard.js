// Import of a recorded file: the service proposes a description, a person corrects and confirms it.
import { ask } from "./api.js";
import { busy } from "./act.js";
import { h, number } from "./dom.js";
import { t } from "./words.js";

const at = (id) => document.getElementById(id), wizard = at("wizard");
const UNITS = { angular_rate: ["rad/s", "deg/s", "deg/h", "count"], specific_force: ["m/s^2", "g", "mg", "µg", "count"], angle_increment: ["rad", "deg", "arcsec", "count"], velocity_increment: ["m/s", "count"], angle: ["rad", "deg", "arcsec", "count"], velocity: ["m/s", "count"], temperature: ["degC", "K", "count"] };
const FIRST_BYTES = 4000, FIRST_ROWS = 8;
let proposal = null, rows = [], doubts = [], byHand = false;

const put = (element, ...children) => element.replaceChildren(...children.flat(3).filter((child) => child));
const files = () => [...at("files").files];
const options = (list, chosen) => list.map((one) => h("option", { value: one, selected: one === chosen }, one === "" ? "–" : one));

async function firstRows(file) {  // of a text file, as it is
  const head = await file.slice(0, FIRST_BYTES).text();
  if (head.includes("\0")) return [];
  const lines = head.split(/\r?\n/).slice(0, FIRST_ROWS + 1).filter(Boolean);
  return lines.map((line) => line.split(line.includes(";") ? ";" : line.includes("\t") ? "\t" : line.includes(",") ? "," : /\s+/));
}

const triadOf = (one) => `${one.channel().replace(/_?[xyz]$/i, "")} ${one.quantity()}`;

/** The other channels of a triad take the unit that one of them was given, unless they were given theirs by hand. */
function triadFollows(changed, before) {
  changed.touched = true;
  for (const { own } of rows) if (own !== changed && !own.touched && triadOf(own) === triadOf(changed) && own.unit() === before) own.take(changed.unit());
}

/** A column of the file: whether it is imported, as which channel, in which unit. */
function row(channel, known, used) {
  const name = (text) => `${text} ${channel.name || channel.column}`;
  const use = h("input", { type: "checkbox", checked: used, "aria-label": name(t("Import")) }), as = h("input", { value: channel.name || "", size: 14, "aria-label": name(t("Channel")) });
  const quantity = h("select", { "aria-label": name(t("Quantity")) }, ...options(Object.keys(UNITS), channel.quantity)), unit = h("select", { "aria-label": name(t("Unit")) }), scale = h("input", { type: "number", step: "any", value: channel.scale ?? 1, size: 8, "aria-label": name(t("Scale")) });
  const units = () => { const list = UNITS[quantity.value] || []; unit.replaceChildren(...options(channel.unit && !list.includes(channel.unit) && quantity.value === channel.quantity ? [channel.unit, ...list] : list, channel.unit)); };
  quantity.addEventListener("change", () => { units(); write(); });
  units();
  for (const input of [use, as, scale]) input.addEventListener("change", write);
  const own = { touched: false, proposed: channel.unit, channel: () => as.value.trim(), quantity: () => quantity.value, unit: () => unit.value, doubt: known && known.unit_doubt, last: unit.value, take: (value) => { unit.value = value; own.last = value; } };
  unit.addEventListener("change", () => { triadFollows(own, own.last); own.last = unit.value; write(); });
  const element = h("tr", {}, h("td", {}, use), h("th", { scope: "row" }, String(channel.column ?? channel.name)), h("td", {}, as), h("td", {}, quantity), h("td", {}, unit), h("td", {}, scale), h("td", { class: "n" }, known && known.mean !== null && known.mean !== undefined ? number(Number(known.mean.toPrecision(4))) : ""), h("td", { class: "note" }, known ? known.source : ""));
  return { own, element, value: () => !use.checked ? null : { ...channel, name: as.value.trim(), quantity: quantity.value, unit: unit.value, scale: Number(scale.value) } };
}

/** The description as it stands in the form; what the form does not show stays as the service proposed it. */
function described() {
  const { channels, time_column: _t, time_unit: _u, rate_hz: _r, ...rest } = proposal.description, time = at("import-time").value;
  return { ...rest, unit: at("import-unit").value.trim(), channels: rows.map((one) => one.value()).filter(Boolean),
    ...(time !== "" && { time_column: /^\d+$/.test(time) && proposal.byIndex ? Number(time) : time, time_unit: at("import-time-unit").value }), ...(at("import-rate").value !== "" && { rate_hz: Number(at("import-rate").value) }) };
}

function write() { byHand = false; at("description").value = JSON.stringify(described(), null, 2); settle(); }

function settle() {  // the questions that a person answers by looking
  for (const { box, text, about, words } of doubts) {
    const changed = about.filter((one) => one.unit() !== one.proposed), said = changed.length ? t("You chose the units: {units}", { units: about.map((one) => `${one.channel()} ${one.unit()}`).join(", ") }) : text;
    if (words.textContent !== said) { words.textContent = said; box.checked = false; }  // what was ticked is no longer what it says
  }
  const open = doubts.some(({ box }) => !box.checked);
  wizard.querySelector("button.go").disabled = open;
}

function asked(text) {
  const box = h("input", { type: "checkbox" }), words = h("span", {}, text);
  box.addEventListener("change", settle);
  doubts.push({ box, text, words, about: rows.map((one) => one.own).filter((one) => one.doubt === text) });
  return h("label", { class: "row warning" }, box, words);
}

function show(found, first) {
  proposal = found;
  const { description } = found, channels = description.channels || [], known = new Map((found.columns || []).map((one) => [one.channel, one]));
  const width = Math.max(0, ...first.map((cells) => cells.length)), named = first.length > 0 && first[0].some((cell) => /[A-Za-z]/.test(cell));
  const names = named ? first[0].map((cell) => cell.trim().replace(/^"|"$/g, "")) : [...Array(width).keys()];
  proposal.byIndex = !named;
  const left = names.filter((name) => name !== description.time_column && !channels.some((one) => (one.column ?? one.name) === name));
  rows = [...channels.map((one) => row(one, known.get(one.name), true)), ...left.map((name) => row({ column: name, name: /^[A-Za-z]\w*$/.test(String(name)) ? name : `column_${name}`, quantity: "angular_rate", unit: "deg/s" }, null, false))];
  doubts = [];
  const columns = [...new Set([...names.map(String), ...(found.clocks || []).map((one) => String(one.column)), ...(description.time_column === undefined ? [] : [String(description.time_column)])])];
  at("import-time").replaceChildren(...options(["", ...columns], String(description.time_column ?? "")));
  at("import-time-unit").replaceChildren(...options(["s", "ms", "us", "ns", "100us", "clock"], description.time_unit || "s"));
  at("import-rate").value = description.rate_hz ?? "";
  if (description.unit) at("import-unit").value = description.unit;
  put(at("looked"), h("p", {}, `${found.title}${found.rows === null ? "" : `, ${found.rows} ${t("rows")}`}. ${found.rate_hz ? `${number(found.rate_hz)} Hz. ` : ""}${(found.notes || []).join(" ")}`),
    found.tables.length > 1 && h("label", {}, t("Table of the file"), tables(found)),
    ...found.suspicious.map((text) => h("p", { class: "warning" }, text)), ...found.clocks.map((one) => h("p", { class: "note" }, `${t("Clock")} ${one.column}: ${one.meaning}${one.rate_hz ? `, ${number(one.rate_hz)} Hz` : ""}${one.problem ? `; ${one.problem}` : ""}`)),
    first.length > 0 && h("details", { open: true }, h("summary", {}, t("First rows of the file")), h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("First rows of the file") }, h("table", {}, h("tbody", {}, ...first.map((cells) => h("tr", {}, ...cells.map((one) => h("td", {}, one)))))))));
  put(at("import-columns"), h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Columns of the file") }, h("table", {}, h("thead", {}, h("tr", {}, ...["Import", "Column", "Channel", "Quantity", "Unit", "Scale", "Mean", "From"].map((name) => h("th", {}, t(name))))), h("tbody", {}, ...rows.map((one) => one.element)))));
  put(at("import-doubts"), found.unknown.length > 0 && h("p", {}, t("The file does not say this. Tick each once it is right above:")), ...found.unknown.map(asked));
  write();
}

function tables(found) {
  const chosen = h("select", {}, ...found.tables.map((one) => h("option", { value: one.name, selected: one.name === found.table }, `${one.name} (${one.rows ?? "?"})`)));
  chosen.addEventListener("change", () => look(chosen.value));
  return chosen;
}

async function look(table = null) {
  if (!files().length) return;
  at("step").hidden = false;
  const sent = new FormData(), output = wizard.querySelector("output");
  sent.append("file", files()[0], files()[0].name);
  if (table) sent.append("table", table);
  const first = await firstRows(files()[0]);
  const found = await busy(wizard.querySelector("button.go"), output, () => ask("POST", "/api/v1/recordings/describe", sent, { patience: 60000 }));
  if (found) { output.textContent = ""; show(found, first); }
}

async function bring(event) {
  event.preventDefault();
  const made = await busy(wizard.querySelector("button.go"), wizard.querySelector("output"), () => {
    let description;
    try { description = JSON.parse(at("description").value); } catch (error) { throw new Error(`${t("The description is not JSON:")} ${error.message}`); }
    if (!byHand) description = described();
    const sent = new FormData();
    for (const file of files()) sent.append("files", file, file.name);
    sent.append("description", JSON.stringify(description));
    return ask("POST", "/api/v1/recordings", sent, { key: crypto.randomUUID(), patience: 600000 });
  });
  if (made) location.href = `/recordings/${made.id}`;
}

at("files").addEventListener("change", () => look());
at("description").addEventListener("input", () => { byHand = true; });
for (const id of ["import-unit", "import-time", "import-rate", "import-time-unit"]) at(id).addEventListener("change", () => { if (proposal) write(); });
wizard.addEventListener("submit", bring);
for (const kind of ["dragover", "drop", "dragleave"]) at("drop").addEventListener(kind, (event) => {
  event.preventDefault();
  at("drop").classList.toggle("over", kind === "dragover");
  if (kind === "drop") { at("files").files = event.dataTransfer.files; look(); }
});
