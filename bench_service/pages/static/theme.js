"use strict";
// Sets the chosen theme before the first paint; without a choice the system's counts.
try {
  const chosen = localStorage.getItem("bench.theme");
  if (chosen) document.documentElement.dataset.theme = chosen;
} catch { /* storage is closed: the system's theme counts */ }
