// Batches of analyses: how far each one is, what failed, and its verbs.
import { read } from "./api.js";
import { verb } from "./act.js";
import { badge, fill, h, moment } from "./dom.js";
import { t } from "./words.js";

const BATCHES = "/api/v1/analyses/batches", LOOK_MS = 2000, OPEN = ["waiting", "running", "cancelling"], SHOWN = 20;
const NAMES = { waiting: "wait", running: "run", done: "done", reused: "taken from stored results", failed: "failed", cancelled: "cancelled" };
const place = document.getElementById("batches"), titles = new Map(), opened = new Map();
let timer = null;

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

function look(batch) {
  const known = opened.get(batch.id), list = known ? known.list : h("div");
  const refresh = async () => {
    opened.set(batch.id, { list, at: ended(batch) });
    list.replaceChildren(await tasks(batch).catch((error) => error.message));
  };
  if (known && known.at !== ended(batch)) refresh();
  const details = h("details", { open: Boolean(known), ontoggle: () => {
    if (!details.open) opened.delete(batch.id);
    else if (!opened.has(batch.id)) refresh();
  } }, h("summary", {}, t("Results and failures")), list);
  return details;
}

function verbs(batch) {
  const path = `${BATCHES}/${batch.id}`;
  if (OPEN.includes(batch.state)) {
    return verb(t("Cancel"), { path: `${path}/cancel`, kind: "danger", then: show,
      confirm: { title: t("Cancel this batch?"), lost: t("What waits is not analysed. What runs ends by itself, and results stay."), verb: t("Cancel the batch") } });
  }
  return batch.counts.failed + batch.counts.cancelled ? verb(t("Once more"), { path: `${path}/retry`, then: show }) : "";
}

function row(batch) {
  return h("tr", { "data-batch": batch.id }, h("td", {}, moment(batch.created_at)), h("td", {}, t(titles.get(batch.method) || batch.method)), h("td", {}, chosen(batch.selection)),
    h("td", {}, badge(batch.state)), h("td", {}, h("progress", { max: Math.max(1, batch.total), value: ended(batch), "aria-label": t("Progress of the batch") }), " ", t("{n} of {all}", { n: ended(batch), all: batch.total }), h("br"), h("span", { class: "note" }, counted(batch.counts))),
    h("td", {}, batch.requested_by || "–"), h("td", {}, look(batch)), h("td", {}, verbs(batch)));
}

export async function show() {
  clearTimeout(timer);
  if (document.querySelector("dialog[open]")) { timer = setTimeout(show, LOOK_MS); return; }
  const { items } = await read(`${BATCHES}?limit=${SHOWN}`);
  fill(place, items.length ? h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Batches of analyses") }, h("table", {}, h("thead", {}, h("tr", {}, ...["Made", "Method", "Recordings", "State", "Progress", "Requested by", "Tasks", "Do"].map((name) => h("th", {}, t(name))))), h("tbody", {}, ...items.map(row)))) : h("p", {}, t("None yet.")));
  if (items.some((one) => OPEN.includes(one.state))) timer = setTimeout(() => show().catch(() => { timer = setTimeout(show, LOOK_MS); }), LOOK_MS);
}

export function named(methods) { for (const one of methods) titles.set(one.name, one.title); }
