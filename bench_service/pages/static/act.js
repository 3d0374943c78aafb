"use strict";
// Sends a form to the API as JSON. Whatever is answered is shown beside the form: nothing fails in silence.
const NAME = "bench.name", PATIENCE_MS = 15000;

function refused(output, text) {
  output.className = "refused";
  output.textContent = text;
}

function documentOf(form) {
  const fields = [...new FormData(form)].filter(([, value]) => value !== "");
  return { ...JSON.parse(form.dataset.document || "{}"), ...Object.fromEntries(fields) };
}

async function problemOf(answer) {
  let problem = {};
  try { problem = await answer.json(); } catch { /* no problem document: the status alone is shown */ }
  const errors = (problem.errors || []).map((one) => `${one.field}: ${one.message}${one.value ? ` (${one.value})` : ""}`);
  return `Refused (${answer.status}): ${[problem.detail || answer.statusText, ...errors].join("; ")}`;
}

async function ask(form) {
  const output = form.querySelector("output"), button = form.querySelector("button");
  const sent = documentOf(form), request = { method: "POST", signal: AbortSignal.timeout(PATIENCE_MS) };
  const csrf = document.querySelector('meta[name="csrf"]');
  request.headers = csrf ? { "X-CSRF-Token": csrf.content } : {};
  if (Object.keys(sent).length) {
    request.headers["Content-Type"] = "application/json";
    request.body = JSON.stringify(sent);
  }
  if (sent.by) localStorage.setItem(NAME, sent.by);
  button.disabled = true;
  output.className = "note";
  output.textContent = "Asking …";
  try {
    const answer = await fetch(form.getAttribute("action"), request);
    if (answer.ok) {
      const said = await answer.json().catch(() => ({}));
      if (said.safety && (said.books || said.safety.safe !== true)) {  // a stop: where the page may not load anew
        refused(output, [said.safety.explanation, said.books && `The database does not have it yet: ${said.books}.`]
          .filter(Boolean).join(" "));
        button.disabled = false;
        return;
      }
      location.reload();
      return;
    }
    refused(output, await problemOf(answer));
  } catch (error) {
    refused(output, error.name === "TimeoutError"
      ? `No answer within ${PATIENCE_MS / 1000} s: it is not known whether this was done. Use the hardware emergency stop where there is danger.`
      : "Nothing answers: the service is not reached. Use the hardware emergency stop where there is danger.");
  }
  button.disabled = false;
}

for (const form of document.querySelectorAll("form.act")) {
  const name = form.elements.namedItem("by");
  if (name && !name.value) name.value = localStorage.getItem(NAME) || "";
  form.addEventListener("submit", (event) => { event.preventDefault(); ask(form); });
}
