// Queues of the benches: order, priority, hold, cancel, and why each job waits; reservations with holder and time left.
import { ask, me, part, read } from "./api.js";
import { busy, verb } from "./act.js";
import { fill, h, moment, span } from "./dom.js";
import * as feed from "./feed.js";
import { t } from "./words.js";

const LOOK_MS = 5000;
const waits = { timer: null };

function cancel(job) {
  return verb(t("Cancel"), { path: `/api/v1/jobs/${part(job)}/cancel`, kind: "danger", then: all,
    confirm: { title: t("Cancel this job?"), lost: t("It leaves the queue for good. Hold keeps its place open."), verb: t("Cancel the job"), by: true, reason: { label: t("Why") } } });
}

function row(entry, index, entries) {
  const output = h("output", { role: "status" });
  const to = (priority) => async (event) => { if (await busy(event.target, output, () => ask("PATCH", `/api/v1/jobs/${part(entry.job)}`, { priority }))) all(); };
  const before = entries[index - 1], priority = h("input", { type: "number", min: 1, max: 1000, value: entry.priority, "aria-label": t("Priority of job {job}", { job: `#${entry.number}` }) });
  priority.addEventListener("change", (event) => to(Number(priority.value))(event));
  return h("tr", { "data-job": entry.job }, h("td", { class: "n" }, index + 1), h("td", {}, h("a", { href: `/jobs/${entry.job}` }, h("code", {}, `#${entry.number}`))), h("td", {}, entry.unit), h("td", {}, priority),
    h("td", {}, entry.waiting || ""), h("td", {}, h("div", { class: "verbs" },
      before && h("button", { type: "button", onclick: to(Math.max(1, before.priority - 1)), "aria-label": t("Move job {job} up", { job: `#${entry.number}` }) }, "↑"),
      verb(t("Hold"), { path: `/api/v1/jobs/${part(entry.job)}/pause`, then: all }), cancel(entry.job), output)));
}

function reserve(bench, reservations) {
  const minutes = h("input", { name: "minutes", type: "number", min: 1, max: 10080, value: 60 }), holder = h("input", { name: "holder", required: true, maxlength: 100, value: me() });
  const output = h("output", { role: "status" }), form = h("form", { class: "filters" }, h("label", {}, t("Reserve for"), holder), h("label", {}, t("Minutes"), minutes), h("button", {}, t("Reserve")), output);
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    if (await busy(form.querySelector("button"), output, () => ask("POST", "/api/v1/reservations", { bench, holder: holder.value, minutes: Number(minutes.value) }))) all();
  });
  return [...reservations.map((one) => h("p", { class: "note" }, t("Reserved for {holder} until", { holder: one.holder }), " ", moment(one.until), ` (${span((new Date(one.until) - Date.now()) / 1000)}) `,
    verb(t("Give back"), { method: "DELETE", path: `/api/v1/reservations/${part(one.id)}`, then: all, confirm: { title: t("Give the reservation back?"), lost: t("Jobs of others may start at once."), verb: t("Give back") } }))), reservations.length ? null : form];
}

async function one(section) {
  const { bench } = section.dataset, queue = await read(`/api/v1/benches/${part(bench)}/queue`);
  const held = (await read("/api/v1/reservations?active=true&limit=100")).items.filter((kept) => kept.bench === bench);
  const running = queue.running;
  if (document.querySelector("dialog[open]")) return;
  fill(section.querySelector(".reservations"), ...reserve(bench, held));
  fill(section.querySelector(".list"), h("p", {}, running ? [t("Now:"), " ", h("a", { href: `/jobs/${running}` }, `#${queue.running_number}`)] : queue.driven_by ? t("Nothing runs.") : t("No worker drives it now: its jobs wait.")),
    queue.entries.length ? h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Waiting jobs") }, h("table", {}, h("thead", {}, h("tr", {}, ...["№", "Job", "Unit", "Priority", "Why it waits", "Do"].map((name) => h("th", {}, t(name))))), h("tbody", {}, ...queue.entries.map(row))))
      : h("p", { class: "note" }, t("Nothing waits.")));
}

async function all() {
  clearTimeout(waits.timer);
  waits.timer = setTimeout(all, LOOK_MS);
  if (feed.state.alive === false) return;
  for (const section of document.querySelectorAll("section.queue")) await one(section).catch((error) => { section.querySelector(".list").textContent = error.message; });
}

let key = "";
feed.on("bench", () => {
  const now = JSON.stringify([...feed.benches.values()].map((news) => [news.bench.state, news.bench.job, news.bench.queued]));
  if (now !== key) { key = now; all(); }
});
all();
