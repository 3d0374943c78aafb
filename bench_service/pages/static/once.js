// A start once: a moment with its date, after which its schedule is off.
import { t } from "./words.js";

/** Fields of a schedule for a local moment of an input. Raises for one that has passed. */
export function onceAt(text) {
  const at = new Date(text);
  if (!(at > new Date())) throw new Error(t("This time has passed: choose a later one."));
  return { at: at.toISOString() };
}
