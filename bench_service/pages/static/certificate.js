// Check of a calibration certificate: valid or not, by whom, unchanged or not, and what is stored here.
import { ask, part } from "./api.js";
import { busy } from "./act.js";
import { fill, h } from "./dom.js";
import { t } from "./words.js";

const form = document.getElementById("check"), outcome = document.getElementById("outcome");

function triad(one, unit) {
  const kept = !one.stored ? t("not stored here") : one.same ? t("the same coefficients are stored here") : t("other coefficients are stored here");
  return h("tr", {}, h("th", { scope: "row" }, t(one.triad)), h("td", {}, h("code", {}, one.calibration)), h("td", {}, one.stored ? h("a", { href: `/units/${part(unit)}` }, kept) : kept), h("td", {}, one.approval ? t(one.approval) : "–"));
}

form.addEventListener("submit", async (event) => {
  event.preventDefault();
  fill(outcome);
  const found = await busy(form.querySelector("button"), form.querySelector("output"), () => ask("POST", "/api/v1/certificates/check", new FormData(form), { patience: 60000 }));
  if (!found) return;
  form.querySelector("output").textContent = "";
  fill(outcome, h("div", { class: `verdict ${found.valid ? "pass" : "fail"}` }, found.valid ? t("VALID") : t("NOT VALID"),
    h("small", {}, found.signed_by ? `${t("Signed by")} ${found.signed_by}. ` : t("The signature is not valid. "), found.unchanged ? t("The text is as it was signed.") : t("The text is not what was signed, or another key signed it."))),
    ...found.faults.map((text) => h("p", { class: "warning" }, text)),
    found.unit && h("p", {}, t("Unit"), " ", found.unit),
    found.calibrations.length > 0 && h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Calibrations of the certificate") }, h("table", {}, h("thead", {}, h("tr", {}, ...["Triad", "Calibration", "Here", "Approval"].map((name) => h("th", {}, t(name))))), h("tbody", {}, ...found.calibrations.map((one) => triad(one, found.unit))))));
});
