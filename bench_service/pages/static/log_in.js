"use strict";
// Sends name and password, and goes on with the page that was wanted. Nothing is kept here: the cookie is the server's.
const form = document.getElementById("log-in");

async function logIn() {
  const output = form.querySelector("output"), button = form.querySelector("button");
  const sent = Object.fromEntries(new FormData(form));
  button.disabled = true;
  output.className = "note";
  output.textContent = "Asking …";
  try {
    const answer = await fetch("/api/v1/session", {
      method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(sent),
    });
    if (answer.ok) {
      location.assign(form.dataset.next);
      return;
    }
    const problem = await answer.json().catch(() => ({}));
    output.textContent = `Refused: ${problem.detail || answer.statusText}`;
  } catch {
    output.textContent = "Nothing answers: the service is not reached.";
  }
  output.className = "refused";
  button.disabled = false;
}

if (form) form.addEventListener("submit", (event) => { event.preventDefault(); logIn(); });
