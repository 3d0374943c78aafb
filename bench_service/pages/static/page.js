// What every page does: says at once when the service is away, shows stops and prompts, local times, name and theme.
import { wire } from "./act.js";
import { send, part, me, iAm, Refused } from "./api.js";
import { clock, h, localTimes, moment, titled } from "./dom.js";
import * as feed from "./feed.js";
import { attitude } from "./table3d.js";
import { t } from "./words.js";

const alerts = document.getElementById("alerts"), title = document.title;
const answered = new Set();
let sounded = "";

function away() {
  const box = document.getElementById("away"), logsIn = document.getElementById("log-in") && feed.state.why === "log-in";
  const gone = feed.state.alive === false && !logsIn;
  document.body.classList.toggle("away", gone);
  document.getElementById("main").setAttribute("aria-busy", String(gone));
  box.hidden = logsIn || (!gone && !feed.state.why);
  box.replaceChildren();
  if (gone && feed.state.why === "log-in") {
    box.append(h("strong", {}, t("Your log-in has ended; the stop works without one.")), " ", h("a", { href: `/log-in?next=${part(location.pathname)}` }, t("Log in")));
  } else if (gone) {
    const since = clock(new Date(feed.state.at));
    box.append(h("strong", {}, t("The service does not answer since {since}.", { since })), " ",
      t("What this page shows is old. A stop may not arrive: where there is danger, use the hardware emergency stop."));
  } else if (feed.state.why) {
    box.append(h("strong", {}, t("The service cannot read its database now:")), " ", feed.state.why);
  }
}

function promptBox({ bench, job }) {
  const { prompt } = job, output = h("output", { role: "status" });
  const remark = h("input", { name: "remark", maxlength: 500 });
  const answer = (done) => async (event) => {
    if (!done && !remark.value.trim()) {
      output.className = "refused";
      output.textContent = t("Say in the remark why it cannot be done.");
      remark.focus();
      return;
    }
    event.target.disabled = true;
    try {
      await send(`/api/v1/jobs/${part(job.id)}/answer`, { prompt: prompt.id, done, remark: remark.value });
      answered.add(prompt.id);
      show();
    } catch (error) {
      if (!(error instanceof Refused)) throw error;
      output.className = "refused";
      output.textContent = error.message;
      event.target.disabled = false;
    }
  };
  return h("section", { class: "prompt", "aria-label": t("To be done at the bench"), "data-prompt": prompt.id },
    prompt.angles_deg && h("canvas", { width: 150, height: 120, role: "img", "data-angles": prompt.angles_deg.join(" "),
      "aria-label": t("The table at {angles}", { angles: prompt.angles_deg.map((a) => `${a.toFixed(1)}°`).join(", ") }) }),
    h("div", {}, h("strong", {}, t("To be done at bench {bench}:", { bench: bench.id })), " ",
      h("a", { href: job.page }, `${titled(job.procedure)} ${job.unit}`), ". ", t("{n} of {all} stations are done.", { n: job.progress.station, all: job.progress.stations }), " ", t("Asked"), " ", moment(prompt.asked_at),
      h("p", { class: "big" }, prompt.text),
      h("label", {}, t("Remark"), remark),
      h("div", { class: "verbs" }, h("button", { type: "button", class: "go", onclick: answer(true) }, t("Done")),
        h("button", { type: "button", class: "danger", onclick: answer(false) }, t("It cannot be done")), output)));
}

function stopBox({ bench }) {
  if (!bench.stops.length) return null;
  const [first] = bench.stops;
  return h("section", { class: "stopped", "aria-label": t("Stops") }, h("strong", {}, t("Bench {bench} is stopped", { bench: bench.id })),
    " ", moment(first.at), first.by ? ` ${t("by")} ${first.by}` : "", `: ${first.reason}. `,
    bench.stops.length > 1 ? t("{n} stops stand; each is released by itself.", { n: bench.stops.length }) + " " : "",
    h("a", { href: `/#bench-${bench.id}` }, t("Look and release")));
}

function beep() {
  try {
    if (localStorage.getItem("bench.sound") !== "on") return;
    const audio = new AudioContext(), tone = audio.createOscillator();
    tone.connect(audio.destination);
    tone.start();
    tone.stop(audio.currentTime + 0.4);
  } catch { /* no sound here: the page and its title say it */ }
}

function show() {
  const all = [...feed.benches.values()];
  const asking = all.filter((news) => news.job && news.job.prompt && !answered.has(news.job.prompt.id));
  document.title = asking.length ? `● ${t("To be done at the bench")} – ${title}` : title;
  const newest = asking.map((news) => news.job.prompt.id).join();
  if (newest && newest !== sounded) beep();
  sounded = newest;
  const key = JSON.stringify([asking.map((n) => n.job.prompt.id), all.map((n) => n.bench.stops.map((s) => s.id))]);
  if (alerts.dataset.key === key) return;  // an answer that somebody writes is not taken away
  alerts.dataset.key = key;
  alerts.replaceChildren(...[...asking.map(promptBox), ...all.map(stopBox)].filter(Boolean));
  for (const canvas of alerts.querySelectorAll("canvas")) attitude(canvas, canvas.dataset.angles.split(" ").map(Number));
  for (const news of all) status(news);
}

function status({ bench, job }) {
  const place = document.querySelector(`form.stop[data-bench="${CSS.escape(bench.id)}"] .status`);
  if (!place) return;
  const text = bench.state === "stopped" ? t("stopped") : job ? `${job.prompt && !answered.has(job.prompt.id) ? t("waits for a person") : t("busy")}: ${titled(job.procedure)} #${job.number}` : bench.driven_by ? t("idle") : t("no worker");
  if (place.textContent !== text) place.textContent = text;
  place.className = `status ${bench.state}`;
}

feed.on("state", away);
feed.on("bench", (message) => { status(message.news); show(); });
localTimes();
wire();

const name = document.getElementById("my-name");
if (name) {
  name.value = me();
  name.addEventListener("change", () => iAm(name.value.trim()));
}
const theme = document.getElementById("theme");
if (theme) {
  theme.value = document.documentElement.dataset.theme || "";
  theme.addEventListener("change", () => {
    if (theme.value) { document.documentElement.dataset.theme = theme.value; localStorage.setItem("bench.theme", theme.value); }
    else { delete document.documentElement.dataset.theme; localStorage.removeItem("bench.theme"); }
  });
}
const sound = document.getElementById("sound");
if (sound) {
  sound.checked = localStorage.getItem("bench.sound") === "on";
  sound.addEventListener("change", () => localStorage.setItem("bench.sound", sound.checked ? "on" : "off"));
}
for (const wide of document.querySelectorAll("#main .wide")) {
  if (wide.scrollWidth > wide.clientWidth) { wide.tabIndex = 0; wide.setAttribute("role", "region"); wide.setAttribute("aria-label", wide.dataset.label || t("Table")); }
}
document.documentElement.dataset.ready = "1";
