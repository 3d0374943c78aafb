"use strict";
// One connection for all pages of this browser: reads the feed, and hands it on to each page.
const SILENT_MS = 3000, AGAIN_MS = 1000, GONE_MS = 40000, KEPT = 2000, LATEST_MS = 10000;
const ports = new Map();  // port -> { jobs, at }
const known = { benches: new Map(), lives: new Map(), jobs: new Map(), latest: null };
let source = null, followed = "", beatAt = 0, state = { alive: null, why: "" }, timer = null, latestAt = 0, asking = false;

const all = (message) => { for (const port of ports.keys()) port.postMessage(message); };

function tell(alive, why = "") {
  if (state.alive === alive && state.why === why) return;
  state = { alive, why, at: Date.now() };
  all({ kind: "state", ...state });
}

function open() {
  if (timer) { clearTimeout(timer); timer = null; }
  if (source) source.close();
  const jobs = [...new Set([...ports.values()].flatMap((page) => page.jobs))].sort().slice(0, 16);
  followed = jobs.join(" ");
  source = new EventSource("/api/v1/feed" + (jobs.length ? "?" + jobs.map((job) => `job=${encodeURIComponent(job)}`).join("&") : ""));
  beatAt = Date.now();
  source.addEventListener("bench", (event) => {
    const news = JSON.parse(event.data);
    known.benches.set(news.bench.id, news);
    latestAt = Math.min(latestAt, Date.now() - LATEST_MS + 500);  // soon: a job has begun, ended or joined the queue
    all({ kind: "bench", news });
  });
  source.addEventListener("live", (event) => {
    const live = JSON.parse(event.data);
    known.lives.set(live.bench, live);
    all({ kind: "live", live });
  });
  source.addEventListener("job", (event) => {
    const { job, events } = JSON.parse(event.data), kept = known.jobs.get(job) || [];
    const last = kept.length ? kept[kept.length - 1].sequence : 0, fresh = events.filter((one) => one.sequence > last);
    if (!fresh.length) return;
    known.jobs.set(job, [...kept, ...fresh].slice(-KEPT));
    all({ kind: "job", job, events: fresh });
  });
  source.addEventListener("beat", (event) => {
    beatAt = Date.now();
    tell(true, JSON.parse(event.data).trouble || "");
  });
  source.onerror = () => {
    tell(false, "away");
    source.close();
    fetch("/api/v1/session", { cache: "no-store" }).then((answer) => answer.json()).then((me) => {  // it lives: is it the log-in?
      if (me.log_in_needed && !me.name) tell(false, "log-in");
    }).catch(() => { /* it is away */ });
    if (!timer) timer = setTimeout(open, AGAIN_MS);
  };
}

async function latest() {  // the list of the latest jobs, read once for all pages that show it
  if (asking || state.alive !== true || Date.now() - latestAt < LATEST_MS || ![...ports.values()].some((page) => page.latest)) return;
  asking = true;
  latestAt = Date.now();
  try {
    const answer = await fetch("/api/v1/jobs?limit=20", { signal: AbortSignal.timeout(10000) });
    if (answer.ok) { known.latest = (await answer.json()).items; all({ kind: "latest", items: known.latest }); }
  } catch { /* the state says that the service is away */ }
  asking = false;
}

function look() {
  latest();
  const now = Date.now();
  for (const [port, page] of ports) if (now - page.at > GONE_MS) ports.delete(port);
  if (!ports.size) { if (source) source.close(); source = null; state = { alive: null, why: "" }; return; }
  const wanted = [...new Set([...ports.values()].flatMap((page) => page.jobs))].sort().slice(0, 16).join(" ");
  if (source === null || wanted !== followed) { open(); return; }
  if (now - beatAt > SILENT_MS) {
    tell(false, "silent");
    if (now - beatAt > 3 * SILENT_MS && !timer) open();
  }
}

function heard(port, message) {
  if (message.kind === "bye") { ports.delete(port); return; }
  const page = ports.get(port), first = page === undefined;
  if (message.latest && !(page && page.latest) && known.latest) port.postMessage({ kind: "latest", items: known.latest });
  ports.set(port, { jobs: message.jobs || [], latest: Boolean(message.latest), at: Date.now() });
  if (first) {
    for (const news of known.benches.values()) port.postMessage({ kind: "bench", news });
    for (const live of known.lives.values()) port.postMessage({ kind: "live", live });
    if (state.alive !== null) port.postMessage({ kind: "state", ...state });
    for (const job of message.jobs || []) if (known.jobs.has(job)) port.postMessage({ kind: "job", job, events: known.jobs.get(job) });
  }
  look();
}

function join(port) {
  port.onmessage = (event) => heard(port, event.data);
  if (port.start) port.start();
}

if (typeof SharedWorkerGlobalScope !== "undefined" && self instanceof SharedWorkerGlobalScope) self.onconnect = (event) => join(event.ports[0]);
else join(self);  // a browser without shared workers: one connection a page, while the page is seen
setInterval(look, 500);
