// Verbs of the pages. What cannot be undone asks once, says what is lost, and takes name and reason; a refusal is shown.
import { ask, iAm, me } from "./api.js";
import { h } from "./dom.js";
import { t } from "./words.js";

const BEHIND = ".skip, header, main, footer";  // the stop bar and what people are asked stay within reach
let dialogs = 0;

/** Opens a dialog below the stop bar, not as a modal one: that would take the stop away. Gives what closes it. */
function opened(box) {
  const bar = document.getElementById("stopbar"), behind = [...document.querySelectorAll(BEHIND)];
  const place = () => { box.style.top = `${bar ? bar.getBoundingClientRect().bottom : 0}px`; };
  const watch = new ResizeObserver(place), shut = () => {
    watch.disconnect();
    document.removeEventListener("keydown", escape);
    for (const one of behind) one.inert = false;  // before it closes: the focus goes back to what had it
    box.close();
  };
  const escape = (event) => { if (event.key === "Escape") shut(); };
  document.body.append(box);
  box.show();
  for (const one of behind) one.inert = true;
  document.addEventListener("keydown", escape);
  place();
  if (bar) watch.observe(bar);
  return shut;
}

/** Asks once: gives {by, reason} or null where the person does not want it after all. */
export function confirmed({ title, lost, verb, reason = null, by = false, kind = "danger" }) {
  return new Promise((settle) => {
    const id = `dialog-${++dialogs}`;
    const name = by && h("label", {}, t("Your name"), h("input", { name: "by", required: true, maxlength: 200, autocomplete: "name", value: me() }));
    const why = reason && h("label", {}, reason.label, h("input", { name: reason.name || "reason", maxlength: 500, required: reason.required, placeholder: reason.hint, type: reason.secret ? "password" : "text", autocomplete: reason.secret ? "new-password" : "off" }));
    const form = h("form", { method: "dialog" }, h("h2", { id }, title), lost && h("p", {}, lost), name, why,
      h("div", { class: "verbs" }, h("button", { type: "submit", class: kind }, verb), h("button", { type: "button", class: "quiet", onclick: () => shut() }, t("Back"))));
    const box = h("dialog", { "aria-labelledby": id }, form);
    let given = null;
    form.addEventListener("submit", (event) => {
      event.preventDefault();
      given = Object.fromEntries([...new FormData(form)].filter(([, value]) => value !== ""));
      if (given.by) iAm(given.by);
      shut();
    });
    box.addEventListener("close", () => { box.remove(); settle(given); });
    const shut = opened(box);
  });
}

/** Does something for a button: it is busy meanwhile, and `output` says how it ended. */
export async function busy(button, output, work) {
  button.disabled = true;
  output.className = "note";
  output.textContent = t("Asking …");
  try {
    const done = await work();
    output.className = "done";
    output.textContent = typeof done === "string" ? done : t("Done.");
    return done;
  } catch (error) {
    output.className = "refused";
    output.textContent = error.message;
    return undefined;
  } finally {
    button.disabled = false;
  }
}

/** A button that asks the API; `confirm` asks the person first. */
export function verb(label, { method = "POST", path, body = {}, confirm = null, then = null, kind = "" }) {
  const output = h("output", { role: "status" });
  const button = h("button", { type: "button", class: kind }, label);
  button.addEventListener("click", async () => {
    const given = confirm ? await confirmed(confirm) : {};
    if (given === null) return;
    const sent = { ...(typeof body === "function" ? body() : body), ...given };
    const done = await busy(button, output, () => ask(method, path, Object.keys(sent).length ? sent : undefined));
    if (done !== undefined && then) then(done);
  });
  return h("span", { class: "verb" }, button, output);
}

function documentOf(form) {
  const fields = [...new FormData(form)].filter(([, value]) => value !== "");
  return { ...JSON.parse(form.dataset.document || "{}"), ...Object.fromEntries(fields) };
}

/** Forms that are in the page already: sent as JSON, asked once where they say so. */
export function wire(within = document) {
  for (const form of within.querySelectorAll("form.act")) {
    const name = form.elements.namedItem("by");
    if (name && !name.value) name.value = me();
    form.addEventListener("submit", async (event) => {
      event.preventDefault();
      const { ask: title, lost, verb: label, reason, reasonName, kind } = form.dataset;
      const given = title ? await confirmed({ title, lost, verb: label, kind, by: "by" in form.dataset, reason: reason ? { label: reason, name: reasonName } : null }) : {};
      if (given === null) return;
      const sent = { ...documentOf(form), ...given };
      if (sent.by) iAm(sent.by);
      const done = await busy(form.querySelector("button"), form.querySelector("output"),
        () => ask("POST", form.getAttribute("action"), Object.keys(sent).length ? sent : undefined));
      if (done !== undefined) location.reload();
    });
  }
}
