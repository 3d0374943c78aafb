// The first page, live: each bench with what it does, its stops and their release, and the latest jobs.
import { part, send } from "./api.js";
import { badge, fill, h, moment, number, short, span, titled } from "./dom.js";
import { busy } from "./act.js";
import { iAm, me } from "./api.js";
import * as feed from "./feed.js";
import { reload } from "./turns.js";
import { t } from "./words.js";

function release(bench, stop) {
  const output = h("output", { role: "status" });
  const form = h("form", { class: "release" },
    h("label", {}, t("Your name"), h("input", { name: "by", required: true, maxlength: 200, autocomplete: "name", value: me() })),
    h("label", {}, t("What was looked at"), h("input", { name: "remark", required: true, maxlength: 500 })),
    h("button", {}, t("Release this stop")), output);
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const given = Object.fromEntries(new FormData(form));
    if (!confirmedOnce(form)) return;
    iAm(given.by);
    await busy(form.querySelector("button"), output, () => send(`/api/v1/benches/${part(bench.id)}/stops/${part(stop.id)}/release`, given));
  });
  return form;
}

function confirmedOnce(form) {  // the second press releases: the jobs in the queue begin to move the table
  const button = form.querySelector("button");
  if (button.dataset.sure) return true;
  button.dataset.sure = "1";
  button.className = "danger";
  button.textContent = t("Yes, release: waiting jobs start at once");
  return false;
}

function stops(card, bench) {
  const place = card.querySelector(".stops") || card.insertBefore(h("div", { class: "stops" }), card.querySelector(".state"));
  const key = bench.stops.map((stop) => stop.id).join();
  if (place.dataset.key === key) return;
  place.dataset.key = key;
  place.replaceChildren(...bench.stops.map((stop) => h("div", { class: "stopped", "data-stop": stop.id },
    t("Stopped since"), " ", moment(stop.at), stop.by ? ` ${t("by")} ${stop.by}` : "", `: ${stop.reason}. `, h("code", {}, short(stop.id)), release(bench, stop))));
}

/** The reservation of a bench as it is now: the line stands below its state. */
function reserved(card, kept) {
  let line = card.querySelector("p.reserved");
  if (!kept) { if (line) line.remove(); return; }
  if (!line) card.querySelector(".state").after(line = h("p", { class: "reserved" }));
  fill(line, t("Reserved for {holder} until", { holder: kept.holder }), " ", moment(kept.until), ` (${span(Math.max(0, (new Date(kept.until) - Date.now()) / 1000))}). `, kept.note);
}

function show({ bench, job }) {
  const card = document.getElementById(`bench-${bench.id}`);
  if (!card) { reload(); return; }
  stops(card, bench);
  reserved(card, bench.reserved);
  const live = feed.lives.get(bench.id), progress = live && live.job && job && live.job.id === job.id ? live.job : null;
  const { safety } = bench, free = !job && !["busy", "manual"].includes(bench.state);
  fill(card.querySelector(".state"),
    h("p", {}, badge(bench.state), " ", job
      ? [t("Busy with"), " ", h("a", { href: job.page, title: job.procedure }, titled(job.procedure)), ` ${t("on")} `, h("a", { href: `/units/${part(job.unit)}` }, job.unit), ` (#${job.number}). `, job.prompt ? `${t("It waits for a person.")} ` : "",
        progress ? `${progress.label}. ${t("Left:")} ${span(progress.eta_s)} ${t("of bench time")}${progress.eta_wall_s === null ? "" : `, ${span(progress.eta_wall_s)} ${t("of real time")}`}.` : ""]
      : bench.state === "manual" ? h("a", { href: `/benches/${part(bench.id)}/manual` }, t("In manual mode."))
      : bench.driven_by ? (bench.state === "stopped" ? t("Nothing runs; jobs wait until the stop is released.") : t("Idle.")) : t("No worker drives it now: its jobs wait."), bench.queued ? [" ", h("a", { href: "/queue" }, `${bench.queued} ${t("queued")}`), "."] : ""),
    job && h("progress", { max: 1, value: progress ? progress.fraction : job.progress.fraction, "aria-label": t("Progress") }),
    h("p", { class: safety.safe !== true && free ? "warning" : "note" }, job && !bench.stops.length && safety.safe === false
      ? `${t("It is in use:")} ${safety.devices.unsafe.join(", ")}.` : safety.explanation),
    safety.silent_supervisor && h("p", { class: "warning" }, `${t("Its supervisor gives no heartbeat, so nobody watches over it:")} ${safety.silent_supervisor}`),
    live && live.devices && live.devices.chamber && h("p", { class: "note" }, `${t("Chamber")} ${number(Number(live.devices.chamber.air_c.toFixed(1)))} °C`));
}

function jobs({ items }) {
  fill(document.getElementById("jobs"), h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Latest jobs") }, h("table", {}, h("thead", {}, h("tr", {}, ...["Procedure", "Unit", "State", "Verdict", "Stations", "Submitted", "Labels", "Job"].map((name) => h("th", {}, t(name))))),
    h("tbody", {}, ...items.map((job) => h("tr", {}, h("td", {}, h("a", { href: job.page, title: job.procedure }, titled(job.procedure))), h("td", {}, job.unit), h("td", {}, badge(job.state)), h("td", {}, job.verdict && badge(job.verdict)),
      h("td", { class: "n" }, `${job.progress.station} / ${job.progress.stations}`), h("td", {}, moment(job.created_at)), h("td", {}, Object.entries(job.labels).map(([k, v]) => `${k}: ${v}`).join("; ")), h("td", {}, h("code", { title: job.id }, `#${job.number}`))))))));
}

feed.on("bench", ({ news }) => show(news));
feed.on("latest", jobs);
feed.on("live", ({ live }) => { const news = feed.benches.get(live.bench); if (news && !document.hidden) show(news); });
for (const news of feed.benches.values()) show(news);
feed.latest();
