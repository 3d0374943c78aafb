// Interlocks and limiters of a bench's devices as a list: the cause, and since when.

import { h, moment } from "./dom.js";
import { t } from "./words.js";

const began = new Map();  // cause that the chamber's reading says -> when this page saw it first

export function interlocks(place, found) {
  const { chamber } = found, now = new Date().toISOString();
  const open = chamber ? [chamber.door_open && t("the chamber's door is open"), chamber.tripped && t("the over-temperature limiter has tripped")].filter(Boolean) : [];
  for (const cause of [...began.keys()]) if (!open.includes(cause)) began.delete(cause);
  for (const cause of open) if (!began.has(cause)) began.set(cause, now);
  const words = (found.status || []).filter((word) => word.bits.length);
  const rows = [...[...began].map(([cause, since]) => [true, cause, since]), ...words.map((word) => [false, `${word.device} ${word.name}: ${word.bits.join(", ")}`, word.since])];
  const shown = JSON.stringify(rows);
  if (place.dataset.shown === shown) return;
  place.dataset.shown = shown;
  place.replaceChildren(...rows.map(([warned, cause, since]) => h("li", { class: warned ? "warning" : "note" }, cause, ", ", t("since"), " ", moment(since))));
}
