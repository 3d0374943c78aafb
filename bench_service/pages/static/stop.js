"use strict";
// The stop of every page. It depends on no other script, and without this one its form still works.
(() => {
  const LATE_MS = 1500, GIVE_UP_MS = 30000, LOOK_MS = 200, SAFE_MS = 2000, WATCH_MS = 60000;
  const name = () => { try { return localStorage.getItem("bench.name") || ""; } catch { return ""; } };
  const clock = () => new Date().toLocaleTimeString("sv-SE", { hour: "2-digit", minute: "2-digit", second: "2-digit", timeZoneName: "short" });

  function show(form, kind, ...texts) {
    const output = form.querySelector("output");
    output.className = kind;
    output.textContent = texts.filter(Boolean).join(" ");
    output.hidden = false;
  }

  // The last stop that arrived from this tab: a job's page loads itself anew when the job ends, and its answer must stay.
  const kept = {
    save(stop) { try { sessionStorage.setItem("bench.stop", JSON.stringify(stop)); } catch { /* the answer ends with the page */ } },
    get(bench) {
      try {
        const stop = JSON.parse(sessionStorage.getItem("bench.stop"));
        return stop && stop.bench === bench && Date.now() < stop.from + WATCH_MS ? stop : null;
      } catch { return null; }
    },
  };

  async function watch(form, stop) {  // the safety of the bench after a stop that arrived, and its books
    const texts = form.dataset;
    while (Date.now() < stop.from + WATCH_MS) {
      await new Promise((go) => setTimeout(go, LOOK_MS));
      const patient = Date.now() < stop.from + SAFE_MS;
      try {
        const answer = await fetch(`/api/v1/benches/${encodeURIComponent(texts.bench)}`, { signal: AbortSignal.timeout(3000) });
        const { safety, stops } = await answer.json(), booked = stops.some((one) => one.id === stop.id);
        if (stop.again && !booked) { if (stop.booked || !patient) return; continue; }  // released, or not in the books yet
        if (booked && !stop.booked) kept.save(Object.assign(stop, { booked }));
        const done = safety.safe === true;
        show(form, done ? "safe" : patient ? "asking" : "unsafe", stop.arrived, done || !patient ? safety.explanation : texts.making, !booked && !patient && texts.books);
        if (done && (booked || !patient)) return;
      } catch { show(form, "unsafe", stop.arrived, texts.unknown); }
    }
  }

  async function stop(form) {
    const texts = form.dataset, button = form.querySelector("button"), by = name();
    const late = setTimeout(() => show(form, "unsafe", texts.late), LATE_MS);
    show(form, "asking", texts.asking);
    button.setAttribute("aria-busy", "true");
    try {
      const answer = await fetch(`/api/v1/benches/${encodeURIComponent(texts.bench)}/stop`, {
        method: "POST",
        headers: { "Content-Type": "application/json" },
        body: JSON.stringify({ reason: texts.reason, wait: false, ...(by && { by }) }),
        signal: AbortSignal.timeout(GIVE_UP_MS),
        priority: "high",
      });
      clearTimeout(late);
      const said = await answer.json().catch(() => ({}));
      if (!answer.ok) {
        show(form, "unsafe", texts.refused, `${answer.status}: ${said.detail || answer.statusText}`);
        return;
      }
      const safe = said.safety && said.safety.safe === true, arrived = `${texts.arrived} ${clock()}.`;
      show(form, safe ? "safe" : "asking", arrived, safe ? said.safety.explanation : texts.making);
      const arrival = { bench: texts.bench, arrived, id: said.stop, from: Date.now(), booked: false };
      kept.save(arrival);
      watch(form, arrival);
    } catch {
      clearTimeout(late);
      show(form, "unsafe", texts.silent);
    } finally {
      button.removeAttribute("aria-busy");
    }
  }

  for (const form of document.querySelectorAll("form.stop")) {
    form.addEventListener("submit", (event) => { event.preventDefault(); stop(form); });
    const before = kept.get(form.dataset.bench);
    if (before) watch(form, { ...before, again: true });
  }
})();
