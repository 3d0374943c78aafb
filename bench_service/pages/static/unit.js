// Calibrations of a unit side by side: differences, and differences over their uncertainty.
import { ask, part, read } from "./api.js";
import { busy } from "./act.js";
import { fill, h, moment, number, shownIn } from "./dom.js";
import { t } from "./words.js";

const form = document.getElementById("compare");

function differences(a, b) {
  if (a.triad !== b.triad) throw new Error(t("Choose two calibrations of the same triad."));
  const variance = (one, k) => (one.calibration.covariance[k] ? one.calibration.covariance[k][k] : NaN);
  return a.coefficients.map((one, k) => {
    const [unit, size] = k % 4 === 0 ? shownIn(one.unit) : ["ppm", 1e-6], delta = (one.value - b.coefficients[k].value) / size;
    const sigma = Math.sqrt(variance(a, k) + variance(b, k)) / size;
    return { name: `${a.triad} ${one.name}`, delta, sigma, unit, ratio: delta / sigma };
  });
}

if (form) {
  for (const option of form.querySelectorAll("option[data-at]")) option.textContent = `${option.dataset.name} ${moment(option.dataset.at).textContent}`;
  const output = form.querySelector("output");
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const { a, b } = Object.fromEntries(new FormData(form));
    const rows = await busy(form.querySelector("button"), output, async () => {
      const [first, second] = await Promise.all([a, b].map((id) => read(`/api/v1/units/${part(form.dataset.unit)}/calibrations/${part(id)}`)));
      return differences(first, second);
    });
    if (!rows) return;
    output.textContent = t("Shown: the first less the second.");
    fill(document.getElementById("difference"), h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Differences") }, h("table", {},
      h("thead", {}, h("tr", {}, ...["Coefficient", "Difference", "± standard uncertainty", "Unit", "Difference over σ"].map((name) => h("th", {}, t(name))))),
      h("tbody", {}, ...rows.map((row) => h("tr", {}, h("th", { scope: "row" }, row.name), h("td", { class: "n" }, number(row.delta, row.sigma)), h("td", { class: "n" }, number(Number(row.sigma.toPrecision(2)))), h("td", {}, row.unit),
        h("td", { class: "n" }, h("span", { class: Math.abs(row.ratio) > 3 ? "badge fail" : "" }, Number.isFinite(row.ratio) ? row.ratio.toFixed(1) : "–"))))))));
  });
  document.getElementById("run-to-run").addEventListener("click", async (event) => {
    const made = await busy(event.target, output, async () => {
      const page = await read(`/api/v1/units/${part(form.dataset.unit)}/calibrations?limit=500`);
      return ask("POST", "/api/v1/analyses", { method: "run_to_run", calibrations: page.items.map((one) => one.id) });
    });
    if (made) location.href = made.page;
  });
}
