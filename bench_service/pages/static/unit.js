// Calibrations of a unit side by side: differences, and differences over their uncertainty.
import { ask, part, read } from "./api.js";
import { busy } from "./act.js";
import { fill, h, number, shownIn } from "./dom.js";
import { t } from "./words.js";

const form = document.getElementById("compare"), NAMES = ["x", "y", "z"].flatMap((axis, k) => [`b_${axis}`, `K${k + 1}1`, `K${k + 1}2`, `K${k + 1}3`]);

const coefficients = (triad) => triad.bias.flatMap((b, i) => [b, ...triad.matrix[i]]);

function differences(a, b) {
  return a.triads.flatMap((triad) => {
    const other = b.triads.find((one) => one.triad === triad.triad);
    if (!other) return [];
    const before = coefficients(other);
    return coefficients(triad).map((value, k) => {
      const bias = k % 4 === 0, [unit, size] = bias ? shownIn(triad.output_unit) : ["ppm", 1e-6];
      const delta = (value - before[k]) / size, variance = (c) => (c.covariance[k] ? c.covariance[k][k] : NaN);
      const sigma = Math.sqrt(variance(triad) + variance(other)) / size;
      return { name: `${triad.triad} ${NAMES[k]}`, delta, sigma, unit, ratio: delta / sigma };
    });
  });
}

if (form) {
  const output = form.querySelector("output");
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const { a, b } = Object.fromEntries(new FormData(form));
    const page = await busy(form.querySelector("button"), output, () => read(`/api/v1/units/${part(form.dataset.unit)}/calibrations?limit=500`));
    if (!page) return;
    const [first, second] = [a, b].map((id) => page.items.find((one) => one.id === id));
    const rows = differences(first, second);
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
