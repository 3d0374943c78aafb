// The one way of the pages to the service: its public API. A refusal becomes a sentence, never silence.
import { inTurn } from "./turns.js";
import { t } from "./words.js";

const NAME = "bench.name";
export const PATIENCE_MS = 15000;

export class Refused extends Error {
  constructor(text, status = 0, problem = {}) { super(text); this.status = status; this.problem = problem; }
}

export const me = () => { try { return localStorage.getItem(NAME) || ""; } catch { return ""; } };
export const iAm = (name) => { try { localStorage.setItem(NAME, name); } catch { /* it is not remembered */ } };

const utf8 = (text) => String.fromCharCode(...new TextEncoder().encode(text));  // a header holds bytes

function sentence(status, problem, fallback) {
  const errors = (problem.errors || []).map((one) => `${one.field}: ${one.message}${one.value !== null && one.value !== undefined ? ` (${one.value})` : ""}`);
  const text = errors.length && errors.every((one) => (problem.detail || "").includes(one.split(": ")[1])) ? [problem.detail] : [problem.detail || fallback, ...errors];
  return `${t("Refused")} (${status}): ${text.join("; ")}`;
}

/** Asks the API; gives the document of a good answer. Raises `Refused` with a sentence for a person. */
export async function ask(method, path, body, { key = null, patience = PATIENCE_MS, signal = null } = {}) {
  const headers = {}, csrf = document.querySelector('meta[name="csrf"]');
  if (csrf && method !== "GET") headers["X-CSRF-Token"] = csrf.content;
  if (body !== undefined && !(body instanceof FormData)) headers["Content-Type"] = "application/json";
  if (key) headers["Idempotency-Key"] = key;
  if (me() && method !== "GET") headers["X-Requested-By"] = utf8(me());
  let answer, text;
  const fetched = async () => {
    const timed = AbortSignal.timeout(patience);
    answer = await fetch(path, {
      method, headers, signal: signal ? AbortSignal.any([signal, timed]) : timed,
      body: body === undefined ? undefined : body instanceof FormData ? body : JSON.stringify(body),
    });
    text = await answer.text();
  };
  try {
    await (method === "GET" ? inTurn(fetched, signal) : fetched());
  } catch (error) {
    if (signal && signal.aborted) throw error;
    throw new Refused(error.name === "TimeoutError"
      ? t("No answer within {s} s: it is not known whether this was done.", { s: patience / 1000 })
      : t("Nothing answers: the service is not reached. This was not done."));
  }
  let document_ = null;
  try { document_ = text ? JSON.parse(text) : null; } catch { /* no JSON: the status alone is shown */ }
  if (!answer.ok) throw new Refused(sentence(answer.status, document_ || {}, answer.statusText), answer.status, document_ || {});
  return document_;
}

export const read = (path, options) => ask("GET", path, undefined, options);
export const send = (path, body, options) => ask("POST", path, body, options);
export const part = (text) => encodeURIComponent(text);
