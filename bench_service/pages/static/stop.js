"use strict";
// The stop of every page. It depends on no other script, and without this one its form still works.
(() => {
  const LATE_MS = 1500, GIVE_UP_MS = 30000, LOOK_MS = 500;
  const name = () => { try { return localStorage.getItem("bench.name") || ""; } catch { return ""; } };
  const clock = () => new Date().toLocaleTimeString();

  function show(form, kind, ...texts) {
    const output = form.querySelector("output");
    output.className = kind;
    output.textContent = texts.filter(Boolean).join(" ");
    output.hidden = false;
  }

  async function watch(form, until) {  // the safety of the bench after a stop that arrived
    const texts = form.dataset;
    while (Date.now() < until) {
      await new Promise((go) => setTimeout(go, LOOK_MS));
      try {
        const answer = await fetch(`/api/v1/benches/${encodeURIComponent(texts.bench)}`, { signal: AbortSignal.timeout(3000) });
        const { safety } = await answer.json();
        show(form, safety.safe === true ? "safe" : "unsafe", texts.arrived, safety.explanation);
        if (safety.safe === true) return;
      } catch { show(form, "unsafe", texts.arrived, texts.unknown); }
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
        body: JSON.stringify({ reason: texts.reason, ...(by && { by }) }),
        signal: AbortSignal.timeout(GIVE_UP_MS),
        priority: "high",
      });
      clearTimeout(late);
      const said = await answer.json().catch(() => ({}));
      if (!answer.ok) {
        show(form, "unsafe", texts.refused, `${answer.status}: ${said.detail || answer.statusText}`);
        return;
      }
      const safe = said.safety && said.safety.safe === true;
      show(form, safe ? "safe" : "unsafe", `${texts.arrived} ${clock()}.`, said.safety && said.safety.explanation,
        said.books && `${texts.books} ${said.books}.`);
      document.dispatchEvent(new CustomEvent("bench-stopped", { detail: said }));
      if (!safe) watch(form, Date.now() + 60000);
    } catch {
      clearTimeout(late);
      show(form, "unsafe", texts.silent);
    } finally {
      button.removeAttribute("aria-busy");
    }
  }

  for (const form of document.querySelectorAll("form.stop")) {
    form.addEventListener("submit", (event) => { event.preventDefault(); stop(form); });
  }
})();
