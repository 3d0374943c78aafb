// The period of a search: chosen in one go ("last 7 days"), or by its first and last day.

const DAY = (at) => `${at.getFullYear()}-${String(at.getMonth() + 1).padStart(2, "0")}-${String(at.getDate()).padStart(2, "0")}`;

function daysAgo(days) { const at = new Date(); at.setDate(at.getDate() - days); return DAY(at); }

/** Joins the choice of a period to the two days of a form; `again` searches once one is chosen. */
export function choosePeriod(form, again) {
  const period = form.querySelector("select.period"), { since, until } = form.elements;
  const show = () => {
    const known = [...period.options].find((one) => one.value !== "other" && since.value === (one.value && daysAgo(Number(one.value))) && !until.value);
    period.value = known ? known.value : "other";
  };
  period.addEventListener("change", () => {
    if (period.value === "other") { since.focus(); return; }
    since.value = period.value && daysAgo(Number(period.value));
    until.value = "";
    again();
  });
  for (const day of [since, until]) day.addEventListener("change", show);
  return show;
}

/** Conditions of a search with their days as moments: from the begin of the first day to the end of the last, local time. */
export function moments(given) {
  const found = { ...given };
  if (found.since) found.since = new Date(`${found.since}T00:00`).toISOString();
  if (found.until) { const day = new Date(`${found.until}T00:00`); day.setDate(day.getDate() + 1); found.until = day.toISOString(); }
  return found;
}
