// Campaigns and schedules: made, changed, previewed, started, switched on and off.
import { ask, part, read, send } from "./api.js";
import { busy, verb } from "./act.js";
import { CampaignForm } from "./campaign_form.js";
import { fill, h, span } from "./dom.js";
import { onceAt } from "./once.js";
import { t } from "./words.js";

const place = document.getElementById("campaign"), zone = Intl.DateTimeFormat().resolvedOptions().timeZone;
const NEW = { name: "my-campaign", title: "", steps: [{ name: "calibrate", procedure: "calibration_12_orientations" }, { name: "verify", procedure: "verification_9_orientations" }] };
let units = [], benches = [], catalogue = { procedures: [], methods: [] };

function target() {
  const unit = h("input", { name: "unit", required: true, list: "known-units", value: (benches[0] && benches[0].units[0]) || units[0] || "" });
  const bench = h("select", { name: "bench" }, ...benches.map((one) => h("option", { value: one.id }, one.id)));
  return { unit, bench, labels: [h("label", {}, t("Unit"), unit, h("datalist", { id: "known-units" }, ...units.map((serial) => h("option", { value: serial })))), h("label", {}, t("Bench"), bench)], values: () => ({ unit: unit.value.trim(), ...(bench.value && { bench: bench.value }) }) };
}

function start(name) {
  const on = target(), output = h("output", { role: "status" }), seen = h("div", { "aria-live": "polite" }), go = h("button", { class: "go" }, t("Start the campaign"));
  const look = h("button", { type: "button" }, t("Preview"));
  look.addEventListener("click", async () => {
    const found = await busy(look, output, () => send(`/api/v1/campaigns/${part(name)}/preview`, on.values()));
    if (found) fill(seen, h("p", {}, found.duration_s !== undefined ? `${span(found.duration_s)} ${t("of bench time")}` : ""), ...(found.warnings || []).map((text) => h("p", { class: "warning" }, text)),
      h("ul", {}, ...(found.steps || []).map((step) => h("li", {}, `${step.name}${step.duration_s !== undefined && step.duration_s !== null ? `: ${span(step.duration_s)}` : ""} ${(step.warnings || []).join(" ")}`))));
  });
  const day = h("input", { type: "datetime-local" });
  const form = h("form", {}, h("h2", {}, `${t("Start")} ${name}`), h("div", { class: "filters" }, ...on.labels, h("label", {}, t("Start at; empty: as soon as the bench is free"), day), look, go, output), seen);
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const key = crypto.randomUUID(), made = await busy(go, output, () => day.value ? send("/api/v1/schedules", { ...onceAt(day.value), campaign: name, ...on.values() }, { key }) : send(`/api/v1/campaigns/${part(name)}/runs`, on.values(), { key }));
    if (made && day.value) location.reload();
    else if (made) location.href = `/campaign-runs/${made.id}`;
  });
  open(form);
}

function open(element) { fill(place, element); place.scrollIntoView({ block: "nearest" }); const first = place.querySelector("input, textarea"); if (first) first.focus(); }

function edit(campaign, fresh) {
  open(new CampaignForm(campaign, fresh, catalogue, (body) => fresh ? send("/api/v1/campaigns", body) : ask("PUT", `/api/v1/campaigns/${part(campaign.name)}`, body)).element);
}

const WEEKDAY = new Intl.DateTimeFormat(document.documentElement.lang, { weekday: "long", timeZone: "UTC" });
const HOW_OFTEN = [["* * *", t("every day")], ["* * 1-5", t("from Monday to Friday")], ...[1, 2, 3, 4, 5, 6, 0].map((day) => [`* * ${day}`, WEEKDAY.format(new Date(Date.UTC(2024, 0, 7 + day)))]), ["1 * *", t("on the first of each month")], ["once", t("once")], ["", t("by a cron line")]];

function schedule(name) {
  const on = target(), output = h("output", { role: "alert" }), often = h("select", {}, ...HOW_OFTEN.map(([value, text]) => h("option", { value }, text))), time = h("input", { type: "time", value: "01:00", required: true });
  const cron = h("input", { name: "cron", value: "0 1 * * *" }), where = h("input", { name: "zone", required: true, value: zone }), day = h("input", { type: "datetime-local" }), dayLabel = h("label", { hidden: true }, t("Start at"), day), zoneLabel = h("label", {}, t("Time zone"), where), cronLabel = h("label", { hidden: true }, t("Minute hour day month weekday"), cron), timeLabel = h("label", {}, t("At"), time);
  const missed = h("select", {}, h("option", { value: "run_once" }, t("one run makes up for it")), h("option", { value: "skip" }, t("it is left out"))), overlap = h("select", {}, h("option", { value: "skip" }, t("the new start is left out")), h("option", { value: "queue" }, t("the new one waits")));
  often.addEventListener("change", () => { cronLabel.hidden = often.value !== ""; timeLabel.hidden = ["", "once"].includes(often.value); dayLabel.hidden = often.value !== "once"; day.required = often.value === "once"; zoneLabel.hidden = often.value === "once"; });
  const times = () => {
    if (often.value === "once") return onceAt(day.value);
    if (often.value === "") return { cron: cron.value, time_zone: where.value };
    const [hour, minute] = time.value.split(":").map(Number);
    return { cron: `${minute} ${hour} ${often.value}`, time_zone: where.value };
  };
  const form = h("form", {}, h("h2", {}, `${t("Schedule")} ${name}`), h("div", { class: "filters" }, h("label", {}, t("How often"), often), timeLabel, dayLabel, cronLabel, zoneLabel, ...on.labels,
    h("label", {}, t("Where a start was missed"), missed), h("label", {}, t("While the run before is open"), overlap), h("button", { class: "go" }, t("Schedule")), output));
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const made = await busy(form.querySelector("button"), output, () => send("/api/v1/schedules", { ...times(), campaign: name, missed: missed.value, overlap: overlap.value, ...on.values() }, { key: crypto.randomUUID() }));
    if (made) location.reload();
  });
  open(form);
}

async function begin() {
  [units, benches, catalogue.procedures, catalogue.methods] = await Promise.all([read("/api/v1/units").then((all) => all.map((one) => one.serial)), read("/api/v1/benches"), read("/api/v1/procedures"), read("/api/v1/methods")]);
  for (const cell of document.querySelectorAll("td.do[data-campaign]")) {
    const name = cell.dataset.campaign;
    cell.append(h("div", { class: "verbs" }, h("button", { type: "button", onclick: () => start(name) }, t("Start")), h("button", { type: "button", onclick: () => schedule(name) }, t("Schedule")),
      h("button", { type: "button", onclick: async () => edit(await plain(name), false) }, t("Change"))));
  }
  for (const cell of document.querySelectorAll("td.do[data-schedule]")) {
    const path = `/api/v1/schedules/${part(cell.dataset.schedule)}`, on = cell.dataset.on === "1";
    cell.append(h("div", { class: "verbs" }, verb(on ? t("Switch off") : t("Switch on"), { method: "PATCH", path, body: { enabled: !on }, then: () => location.reload() }),
      verb(t("Remove"), { method: "DELETE", path, kind: "danger", then: () => location.reload(), confirm: { title: t("Remove this schedule?"), lost: t("It starts nothing more. Its runs so far stay."), verb: t("Remove") } })));
  }
  place.before(h("div", { class: "verbs" }, h("button", { type: "button", onclick: () => edit(NEW, true) }, t("New campaign"))));
}

async function plain(name) {
  const view = await read(`/api/v1/campaigns/${part(name)}`);
  return view.campaign;
}

begin().catch((error) => fill(place, h("p", { class: "refused" }, error.message)));

