// Loads the page anew while its campaign runs, unless somebody reads a refusal, fills in a form, or the service is away.
import * as feed from "./feed.js";
import { reload } from "./turns.js";

setInterval(() => {
  const busy = document.activeElement instanceof HTMLInputElement || document.querySelector("output.refused, dialog[open]");
  const reading = document.querySelector("form.stop output:not([hidden])");
  if (!busy && !reading && feed.state.alive === true) reload();
}, 3000);
