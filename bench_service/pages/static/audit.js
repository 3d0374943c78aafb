// The audit trail: who did what to what, with its outcome.
import { read } from "./api.js";
import { busy } from "./act.js";
import { h, moment } from "./dom.js";
import { t } from "./words.js";

const form = document.getElementById("search"), older = document.getElementById("older");
let next = null, body = null;

async function search(after = null) {
  const asked = new URLSearchParams([...new FormData(form)].filter(([, value]) => value.trim() !== ""));
  asked.set("limit", "50");
  if (after) asked.set("after", after);
  const page = await busy(form.querySelector("button"), form.querySelector("output"), () => read(`/api/v1/audit?${asked}`));
  if (!page) return;
  form.querySelector("output").textContent = page.items.length ? "" : t("Nothing found.");
  if (!after) {
    body = h("tbody");
    document.getElementById("found").replaceChildren(h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Who did what") }, h("table", {}, h("thead", {}, h("tr", {}, ...["When", "Who", "What", "To what", "Outcome", "Details"].map((name) => h("th", {}, t(name))))), body)));
  }
  body.append(...page.items.map((one) => h("tr", {}, h("td", {}, moment(one.at)), h("td", {}, one.who), h("td", {}, one.action), h("td", {}, h("code", {}, one.target)), h("td", {}, one.outcome),
    h("td", {}, h("details", {}, h("summary", {}, t("show")), h("pre", {}, JSON.stringify(one.detail, null, 1)))))));
  next = page.next;
  older.hidden = !next;
}
form.addEventListener("submit", (event) => { event.preventDefault(); search(); });
older.addEventListener("click", () => search(next));
search();
