"use strict";
// Ends the session; also where the service has already ended it.
const out = document.getElementById("log-out");

if (out) {
  out.addEventListener("click", async () => {
    const csrf = document.querySelector('meta[name="csrf"]').content;
    const answer = await fetch("/api/v1/session", { method: "DELETE", headers: { "X-CSRF-Token": csrf } }).catch(() => null);
    if (answer && (answer.ok || answer.status === 401)) location.assign("/log-in");
    else out.textContent = "Log out: nothing answers";
  });
}
