// A campaign as a form: steps in order with parameters, limits, gates and what a failure means; the rest stays as it is.
import { busy } from "./act.js";
import { fill, h } from "./dom.js";
import { SchemaForm } from "./form.js";
import { t } from "./words.js";

const number = (text) => text.trim() === "" ? null : Number(text);
const labelled = (text, input) => h("label", {}, text, input);
const select = (name, chosen, options) => h("select", { name }, ...options.map(([value, text]) => h("option", { value, selected: value === chosen }, text)));
const several = (name, chosen, options) => h("select", { name, multiple: true, size: Math.min(4, Math.max(2, options.length)) }, ...options.map((one) => h("option", { value: one, selected: chosen.includes(one) }, one)));
const chosenOf = (input) => input ? [...input.selectedOptions].map((one) => one.value) : [];

class Limits {
  constructor(limits) {
    this.body = h("tbody");
    this.element = h("details", { open: limits.length > 0 }, h("summary", {}, t("Limits of this step, besides the procedure's own")), h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": t("Limits of this step, besides the procedure's own") },
      h("table", {}, h("thead", {}, h("tr", {}, ...["Quantity", "Unit", "Least", "Greatest", "Source", "Do"].map((name) => h("th", {}, t(name))))), this.body)), h("button", { type: "button", onclick: () => this.add({}) }, t("Add a limit")));
    this.rows = [];
    limits.forEach((one) => this.add(one));
  }

  add(one) {
    const inputs = Object.fromEntries([["quantity", "gyro.b_x"], ["unit", "deg/h"], ["minimum", ""], ["maximum", ""], ["source", ""]].map(([name, hint]) => [name, h("input", { value: one[name] ?? "", size: name === "quantity" || name === "source" ? 16 : 7, placeholder: hint, "aria-label": t({ quantity: "Quantity", unit: "Unit", minimum: "Least", maximum: "Greatest", source: "Source" }[name]) })]));
    const row = h("tr", {}, ...Object.values(inputs).map((input) => h("td", {}, input)), h("td", {}, h("button", { type: "button", "aria-label": t("Remove this limit"), onclick: () => { row.remove(); this.rows = this.rows.filter((known) => known.inputs !== inputs); } }, "×")));
    this.rows.push({ one, inputs });
    this.body.append(row);
  }

  values() {
    return this.rows.filter(({ inputs }) => inputs.quantity.value.trim()).map(({ one, inputs }) => ({ ...one, quantity: inputs.quantity.value.trim(), unit: inputs.unit.value.trim(), minimum: number(inputs.minimum.value), maximum: number(inputs.maximum.value), source: inputs.source.value.trim() }));
  }
}

class Step {
  constructor(form, step, earlier) {
    this.form = form;
    this.step = step;
    this.limits = new Limits(step.limits || []);
    this.parameters = h("div");
    const does = step.procedure ? `procedure ${step.procedure}` : `method ${step.method}`, known = form.kinds.some(([value]) => value === does);
    this.does = select("does", does, known ? form.kinds : [[does, `${step.procedure || step.method} (${t("not in the catalogue")})`], ...form.kinds]);
    this.does.addEventListener("change", () => { this.step = { ...this.step, parameters: {} }; form.rebuild(); });
    this.name = h("input", { name: "name", required: true, pattern: "[a-z0-9][a-z0-9_\\-]*", maxlength: 64, value: step.name || "" });
    this.name.addEventListener("change", () => form.rebuild());
    this.onFail = select("on_fail", step.on_fail || "continue", [["continue", t("go on")], ["stop", t("end the campaign")]]);
    this.onError = select("on_error", step.on_error || "stop", [["stop", t("end the campaign")], ["continue", t("go on")]]);
    this.retries = h("input", { type: "number", min: 0, max: 10, value: step.retries || 0 });
    this.gates = earlier.length ? several("gates", (step.gates || []).map((gate) => gate.step), earlier) : null;
    this.calibrations = this.recordings = null;
    if (this.isMethod()) {
      this.calibrations = several("calibrations_of", step.calibrations_of || [], earlier);
      this.recordings = several("recordings_of", step.recordings_of || [], earlier);
    }
    this.showParameters();
    const button = (text, name, work, off = false) => h("button", { type: "button", "aria-label": `${name} ${step.name || ""}`, disabled: off, onclick: work }, text);
    const at = form.steps.length;
    this.element = h("fieldset", { "data-step": step.name || "" }, h("legend", {}, `${t("Step")} ${at + 1}`),
      h("div", { class: "filters" }, labelled(t("Name"), this.name), labelled(t("Does"), this.does), labelled(t("Where it fails"), this.onFail), labelled(t("Where it gives no verdict"), this.onError), labelled(t("Retries"), this.retries),
        this.gates && labelled(t("Only after these have passed"), this.gates), this.calibrations && labelled(t("Calibrations of"), this.calibrations), this.recordings && labelled(t("Recordings of"), this.recordings)),
      h("details", { open: Object.keys(step.parameters || {}).length > 0 }, h("summary", {}, t("Parameters")), this.parameters), this.limits.element,
      h("div", { class: "verbs" }, button("↑", t("Earlier"), () => form.move(this, -1), at === 0), button("×", t("Remove"), () => form.remove(this))));
  }

  isMethod() { return this.does.value.startsWith("method "); }

  showParameters() {
    const [kind, name] = this.does.value.split(" "), known = (kind === "method" ? this.form.methods : this.form.procedures).find((one) => one.name === name);
    this.schema = known ? new SchemaForm(known.parameters, () => {}, `${this.form.steps.length}-`) : null;
    if (this.schema) { this.schema.load(this.step.parameters || {}); for (const field of this.schema.fields) field.mark(); }
    fill(this.parameters, this.schema ? this.schema.element : h("p", { class: "note" }, t("It is not in the catalogue.")));
  }

  values() {
    const [kind, name] = this.does.value.split(" "), { procedure, method, calibrations_of: c, recordings_of: r, gates, ...rest } = this.step;
    const known = new Map((gates || []).map((gate) => [gate.step, gate]));
    return { ...rest, name: this.name.value.trim(), [kind]: name, parameters: this.schema ? this.schema.values() : this.step.parameters, limits: this.limits.values(), on_fail: this.onFail.value, on_error: this.onError.value, retries: Number(this.retries.value),
      ...(this.gates && { gates: chosenOf(this.gates).map((step) => known.get(step) || { step, verdict: "pass" }) }), ...(this.isMethod() && { calibrations_of: chosenOf(this.calibrations), recordings_of: chosenOf(this.recordings) }) };
  }
}

/** The form of a campaign; `save` gets the document, and its refusal is shown. */
export class CampaignForm {
  constructor(campaign, fresh, { procedures, methods }, save) {
    this.campaign = campaign;
    this.procedures = procedures;
    this.methods = methods;
    this.kinds = [...procedures.map((one) => [`procedure ${one.name}`, t(one.title)]), ...methods.map((one) => [`method ${one.name}`, `${t("Method")}: ${t(one.title)}`])];
    this.name = h("input", { required: true, pattern: "[a-z0-9][a-z0-9_\\-]*", maxlength: 64, value: campaign.name, disabled: !fresh });
    this.title = h("input", { maxlength: 200, size: 30, value: campaign.title || "" });
    this.rule = select("rule", (campaign.decision || {}).rule || "simple", [["simple", t("simple: the value within the limit")], ["guarded", t("guarded: the value and its expanded uncertainty")]]);
    this.errors = h("input", { type: "number", min: 1, max: 100, value: campaign.max_errors ?? "" });
    this.window = h("input", { type: "number", min: 0, step: "any", value: campaign.window_h ?? "" });
    this.priority = h("input", { type: "number", min: 1, max: 1000, value: campaign.priority ?? 10 });
    this.place = h("div");
    this.text = h("textarea", { rows: 18, spellcheck: "false", hidden: true, "aria-label": t("The campaign as JSON") });
    const output = h("output", { role: "alert" }), go = h("button", { class: "go" }, fresh ? t("Make the campaign") : t("Change the campaign"));
    const plain = h("button", { type: "button" }, t("As JSON"));
    plain.addEventListener("click", () => this.swap(plain, output));
    this.parts = h("div", {}, h("div", { class: "filters" }, labelled(t("Name"), this.name), labelled(t("Title"), this.title), labelled(t("Decision on its limits"), this.rule), labelled(t("End after so many errors"), this.errors), labelled(t("End after so many hours"), this.window), labelled(t("Priority; smaller goes first"), this.priority)),
      this.place, h("div", { class: "verbs" }, h("button", { type: "button", onclick: () => this.more() }, t("Add a step"))));
    this.element = h("form", {}, h("h2", {}, fresh ? t("New campaign") : `${t("Change")} ${campaign.name}`), h("p", { class: "note" }, t("Steps in order, each with a procedure or a method, parameters and limits. Every step is examined before it is kept.")),
      this.parts, this.text, h("div", { class: "verbs" }, go, plain, output));
    this.element.addEventListener("submit", async (event) => {
      event.preventDefault();
      const made = await busy(go, output, () => save(this.document()));
      if (!made) return;
      if (made.warnings && made.warnings.length) fill(output, ...made.warnings.map((one) => h("p", {}, one))); else location.reload();
    });
    this.show(campaign.steps);
  }

  show(steps) {
    this.steps = [];
    for (const step of steps) this.steps.push(new Step(this, step, this.steps.map((one) => one.step.name)));
    this.place.replaceChildren(...this.steps.map((one) => one.element));
  }

  read() { return this.steps.map((one) => one.values()); }
  rebuild() { this.show(this.read()); }
  remove(step) { if (this.steps.length > 1) { this.steps = this.steps.filter((one) => one !== step); this.rebuild(); } }

  move(step, by) {
    const at = this.steps.indexOf(step), list = this.read();
    [list[at], list[at + by]] = [list[at + by], list[at]];
    this.show(list);
  }

  more() { const list = this.read(); this.show([...list, { name: `step-${list.length + 1}`, procedure: this.procedures[0].name, parameters: {} }]); }

  document() {
    if (!this.text.hidden) return JSON.parse(this.text.value);
    return { ...this.campaign, name: this.name.value.trim(), title: this.title.value.trim(), steps: this.read(), decision: { ...(this.campaign.decision || {}), rule: this.rule.value }, max_errors: number(this.errors.value), window_h: number(this.window.value), priority: Number(this.priority.value) };
  }

  swap(button, output) {
    try {
      const whole = this.document();
      if (this.text.hidden) this.text.value = JSON.stringify(whole, null, 2);
      else { this.campaign = whole; this.name.value = whole.name; this.title.value = whole.title || ""; this.rule.value = (whole.decision || {}).rule || "simple"; this.errors.value = whole.max_errors ?? ""; this.window.value = whole.window_h ?? ""; this.priority.value = whole.priority ?? 10; this.show(whole.steps); }
    } catch (error) { output.className = "refused"; output.textContent = error.message; return; }
    this.text.hidden = !this.text.hidden;
    this.parts.hidden = !this.text.hidden;
    for (const input of this.parts.querySelectorAll("input, select, textarea")) if (input !== this.name) input.disabled = !this.text.hidden;  // a hidden field keeps nobody from sending
    button.textContent = this.text.hidden ? t("As JSON") : t("As a form");
  }
}
