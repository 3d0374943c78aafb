// Search over the whole history of jobs.
import { part, read } from "./api.js";
import { busy } from "./act.js";
import { badge, h, moment, titled } from "./dom.js";
import { choosePeriod, moments } from "./period.js";
import { t } from "./words.js";

const form = document.getElementById("search"), found = document.getElementById("found"), older = document.getElementById("older");
let next = null, body = null;

export function jobRow(job) {
  return h("tr", {}, h("td", {}, h("a", { href: job.page, title: job.procedure }, titled(job.procedure))), h("td", {}, h("a", { href: `/units/${part(job.unit)}` }, job.unit)), h("td", {}, badge(job.state)), h("td", {}, job.verdict && badge(job.verdict)),
    h("td", {}, moment(job.created_at)), h("td", {}, job.requested_by), h("td", {}, Object.entries(job.labels).map(([k, v]) => `${k}: ${v}`).join("; ")), h("td", {}, h("code", { title: job.id }, `#${job.number}`)),
    h("td", {}, h("a", { href: `/start?from=${job.id}` }, t("again"))));
}

function query() {
  const given = Object.fromEntries([...new FormData(form)].filter(([, value]) => value.trim() !== ""));
  return new URLSearchParams(moments(given));
}

async function search(after = null) {
  const asked = query();
  asked.set("limit", "50");
  if (after) asked.set("after", after);
  const page = await busy(form.querySelector("button"), form.querySelector("output"), () => read(`/api/v1/jobs?${asked}`));
  if (!page) return;
  form.querySelector("output").textContent = after ? "" : page.items.length ? t("{n} found{more}", { n: page.items.length, more: page.next ? "+" : "" }) : t("Nothing found.");
  if (!after) {
    body = h("tbody");
    found.replaceChildren(h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Jobs found") }, h("table", {}, h("thead", {}, h("tr", {}, ...["Procedure", "Unit", "State", "Verdict", "Submitted", "By", "Labels", "Job", "Do"].map((name) => h("th", {}, t(name))))), body)));
  }
  body.append(...page.items.map(jobRow));
  next = page.next;
  older.hidden = !next;
}

function searchAnew() {
  const kept = new URLSearchParams([...new FormData(form)].filter(([, value]) => value.trim() !== ""));
  history.replaceState(null, "", kept.size ? `?${kept}` : location.pathname);
  search();
}

const showPeriod = choosePeriod(form, searchAnew);
form.addEventListener("submit", (event) => { event.preventDefault(); searchAnew(); });
older.addEventListener("click", () => search(next));
read("/api/v1/procedures").then((all) => {
  form.elements.procedure.append(...all.map((one) => h("option", { value: one.name }, t(one.title))));
  for (const [name, value] of new URLSearchParams(location.search)) if (form.elements[name]) form.elements[name].value = value;
  showPeriod();
  search();
}).catch((error) => { form.querySelector("output").textContent = error.message; });
