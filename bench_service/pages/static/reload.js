"use strict";
// Loads the page anew every three seconds, unless somebody reads a refusal or fills in a form.
setInterval(() => {
  const busy = document.activeElement instanceof HTMLInputElement || document.querySelector("output.refused");
  if (!busy) location.reload();
}, 3000);
