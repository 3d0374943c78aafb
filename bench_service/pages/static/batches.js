// Batches of analyses: how far each one is, what failed, and its verbs.
import { read } from "./api.js";
import { verb } from "./act.js";
import { badge, h, moment } from "./dom.js";
import { t } from "./words.js";

const BATCHES = "/api/v1/analyses/batches", LOOK_MS = 2000, OPEN = ["waiting", "running", "cancelling"], SHOWN = 20;
const NAMES = { waiting: "wait", running: "run", done: "done", reused: "taken from stored results", failed: "failed", cancelled: "cancelled" };
const place = document.getElementById("batches"), titles = new Map(), opened = new Map(), rows = new Map();
let timer = null, table = null, last = Promise.resolve();

const ended = (batch) => batch.total - batch.counts.waiting - batch.counts.running;
const counted = (counts) => Object.entries(NAMES).filter(([state]) => counts[state]).map(([state, name]) => `${counts[state]} ${t(name)}`).join(", ");

function chosen(selection) {
  const { unit, job, text, ids, ...rest } = selection;
  return [unit && `${t("Unit")} ${unit}`, job && `${t("Job")} ${job}`, text && `“${text}”`, ids && ids.length && t("{n} recordings", { n: ids.length }),
    ...Object.entries(rest).filter(([, value]) => value !== null && value !== undefined && !(Array.isArray(value) && !value.length)).map(([name, value]) => `${name} ${value}`)].filter(Boolean).join(", ") || t("all recordings");
}

/** The tasks of a batch: results of those that ended, reasons of those that failed. */
async function tasks(batch) {
  const found = await read(`${BATCHES}/${batch.id}/tasks?limit=200`);
  const rows = found.items.filter((one) => one.result || one.failure).map((one) => h("li", {}, t("Recording"), " ", one.recordings.map((id, at) => [at ? ", " : "", h("a", { href: `/recordings/${id}` }, h("code", {}, id.slice(-6)))]), ": ",
    one.result ? h("a", { href: `/results/${one.result}` }, t("result")) : `${one.failure.kind}: ${one.failure.message}`));
  return h("ol", {}, ...rows, found.next ? h("li", { class: "note" }, t("More are in the API.")) : null);
}

/** Reads the tasks of a batch anew where they are opened and more of them ended. */
async function refresh(batch) {
  const known = opened.get(batch.id);
  if (!known || known.at === ended(batch)) return;
  known.at = ended(batch);
  known.list.replaceChildren(await tasks(batch).catch((error) => error.message));
}

function look(batch) {
  const list = h("div");
  const details = h("details", { ontoggle: () => {
    if (!details.open) { opened.delete(batch.id); return; }
    opened.set(batch.id, { list, at: null });
    refresh(rows.get(batch.id).batch);
  } }, h("summary", {}, t("Results and failures")), list);
  return details;
}

/** The one verb that a batch can take now. */
function offered(batch) {
  if (OPEN.includes(batch.state)) return "cancel";
  return batch.counts.failed + batch.counts.cancelled ? "retry" : "none";
}

function verbs(batch) {
  const path = `${BATCHES}/${batch.id}`, offer = offered(batch);
  if (offer === "retry") return verb(t("Retry"), { path: `${path}/retry`, then: show });
  return offer === "none" ? "" : verb(t("Cancel"), { path: `${path}/cancel`, kind: "danger", then: show,
    confirm: { title: t("Cancel this batch?"), lost: t("Waiting tasks are not analysed. Running tasks end by themselves, and all results are kept."), verb: t("Cancel the batch") } });
}

const progress = (batch) => [h("progress", { max: Math.max(1, batch.total), value: ended(batch), "aria-label": t("Progress of the batch") }), " ", t("{n} of {all}", { n: ended(batch), all: batch.total }), h("br"), h("span", { class: "note" }, counted(batch.counts))];

/** Cells of a row, each with what it depends on: a cell that stays the same is not made again, and keeps the focus. */
const CELLS = [
  [(batch) => batch.created_at, (batch) => moment(batch.created_at)],
  [(batch) => titles.get(batch.method) || batch.method, (batch) => t(titles.get(batch.method) || batch.method)],
  [() => "", (batch) => chosen(batch.selection)],
  [(batch) => batch.state, (batch) => badge(batch.state)],
  [(batch) => JSON.stringify([batch.total, batch.counts]), progress],
  [() => "", (batch) => batch.requested_by || "–"],
  [() => "", look],
  [offered, verbs],
];

function row(batch) {
  const known = rows.get(batch.id) || { element: h("tr", { "data-batch": batch.id }, CELLS.map(() => h("td"))), keys: [] };
  known.batch = batch;
  rows.set(batch.id, known);
  CELLS.forEach(([key, content], at) => {
    if (known.keys[at] === key(batch)) return;
    known.keys[at] = key(batch);
    known.element.cells[at].replaceChildren(...[content(batch)].flat());
  });
  refresh(batch);
  return known.element;
}

/** Shows the batches; a row that was there is not moved, for it would lose the focus. */
function draw(items) {
  if (!items.length) {
    table = null;
    rows.clear();
    place.replaceChildren(h("p", {}, t("None yet.")));
    return;
  }
  if (!table) {
    table = h("tbody");
    place.replaceChildren(h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Batches of analyses") }, h("table", {}, h("thead", {}, h("tr", {}, ...["Made", "Method", "Recordings", "State", "Progress", "Requested by", "Tasks", "Do"].map((name) => h("th", {}, t(name))))), table)));
  }
  const ids = new Set(items.map((one) => one.id));
  for (const [id, known] of rows) if (!ids.has(id)) { known.element.remove(); rows.delete(id); opened.delete(id); }
  items.map(row).forEach((element, at) => { if (table.rows[at] !== element) table.insertBefore(element, table.rows[at] || null); });
}

function later() {
  clearTimeout(timer);
  timer = setTimeout(() => show().catch(() => {}), LOOK_MS);
}

async function once() {
  let follow = true;
  clearTimeout(timer);
  try {
    if (document.querySelector("dialog[open]")) return;
    const { items } = await read(`${BATCHES}?limit=${SHOWN}`);
    draw(items);
    follow = items.some((one) => OPEN.includes(one.state));
  } finally { if (follow) later(); }
}

/** Shows the batches now, and again while one of them is open or the service does not answer: one look at a time. */
export function show() { return last = last.catch(() => {}).then(once); }

export function named(methods) { for (const one of methods) titles.set(one.name, one.title); }
