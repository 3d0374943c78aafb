"use strict";
// Shows what a job sends while it runs; a change of its state loads the page anew.
const about = document.getElementById("live"), source = new EventSource(about.dataset.events), known = Number(about.dataset.known);
const at = (id) => document.getElementById(id), degrees = (x) => x.toFixed(4) + "°";
const span = (s) => s === null ? "?" : s < 120 ? s.toFixed(0) + " s" : s < 7200 ? (s / 60).toFixed(0) + " min" : (s / 3600).toFixed(1) + " h";
source.addEventListener("state", (event) => { if (event.lastEventId > known) { source.close(); location.reload(); } });
source.addEventListener("station", (event) => { at("done").textContent = JSON.parse(event.data).data.station + 1; });
source.addEventListener("live", (event) => {
  const { job, devices, samples } = JSON.parse(event.data);
  at("progress").value = job.fraction;
  at("live").textContent = `${job.label}: ${span(job.eta_s)} of bench time left, about ${span(job.eta_wall_s)} of real time before the analysis`;
  if (devices) at("devices").textContent = `Table ${degrees(devices.outer_deg)} ${degrees(devices.middle_deg)} ${degrees(devices.inner_deg)} ${devices.moving ? "moving" : "at rest"}; unit ${devices.unit_on ? "on" : "off"}`
    + (devices.chamber ? `; chamber ${devices.chamber.air_c.toFixed(1)} °C, set point ${devices.chamber.set_point_c.toFixed(1)} °C` : "");
  if (samples) at("samples").replaceChildren(...[["Channel", "Least", "Mean", "Most", "Unit"], ...samples.channels.map((c) =>
    [c.name, Math.min(...c.minimum), c.mean.at(-1), Math.max(...c.maximum), c.unit])].map((cells) => {
      const row = document.createElement("tr");
      row.append(...cells.map((cell) => Object.assign(document.createElement("td"), { textContent: typeof cell === "number" ? cell.toPrecision(6) : cell })));
      return row;
    }));
});
