// The page's end of the feed: what the benches do, the events of the jobs that it follows, and whether the service lives.
const PING_MS = 10000;
const listeners = new Map();
const jobs = new Set();
let wantsLatest = false;
const here = new URL("./feed-worker.js", import.meta.url);
let port = null, worker = null;

export const state = { alive: null, why: "" };
export const benches = new Map();
export const lives = new Map();

function heard({ data }) {
  if (data.kind === "bench") benches.set(data.news.bench.id, data.news);
  if (data.kind === "live") lives.set(data.live.bench, data.live);
  if (data.kind === "state") Object.assign(state, data);
  for (const tell of listeners.get(data.kind) || []) {
    try { tell(data); } catch (error) { console.error(error); }
  }
}

function begin() {
  if (port) return;
  if (typeof SharedWorker !== "undefined") {
    port = new SharedWorker(here, { name: "bench" }).port;
  } else {
    worker = new Worker(here);
    port = worker;
  }
  port.onmessage = heard;
  hello();
}

function hello() { if (port) port.postMessage({ kind: "hello", jobs: [...jobs], latest: wantsLatest }); }

function end() {
  if (!port) return;
  port.postMessage({ kind: "bye" });
  if (worker) worker.terminate();
  port = worker = null;
}

/** Calls `tell` with each message of a kind: `bench`, `live`, `job`, `latest`, `state`. */
export function on(kind, tell) {
  listeners.set(kind, [...(listeners.get(kind) || []), tell]);
}

/** Also follow the events of a job, from its first one. */
export function follow(job) { jobs.add(job); hello(); }

/** Also keep up with the latest jobs: one reading for all pages of the browser. */
export function latest() { wantsLatest = true; hello(); }

begin();
setInterval(hello, PING_MS);
addEventListener("pagehide", end);
addEventListener("pageshow", begin);
document.addEventListener("visibilitychange", () => {
  if (!worker && typeof SharedWorker !== "undefined") return;
  if (document.hidden) end(); else begin();
});
