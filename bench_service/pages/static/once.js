// A start once: the next time that a cron line in UTC comes, after which its schedule is switched off.
import { t } from "./words.js";

const FARTHEST_MS = 300 * 86400e3;  // a cron line has no year: one further ahead would come too early

/** Fields of a schedule for a local moment of an input. Raises for one that has passed or is too far ahead. */
export function onceAt(text) {
  const at = new Date(text);
  if (!(at > new Date())) throw new Error(t("This time has passed: choose a later one."));
  if (at - new Date() > FARTHEST_MS) throw new Error(t("A start may be at most 300 days ahead: choose an earlier time."));
  return { cron: `${at.getUTCMinutes()} ${at.getUTCHours()} ${at.getUTCDate()} ${at.getUTCMonth() + 1} *`, time_zone: "UTC", once: true };
}
