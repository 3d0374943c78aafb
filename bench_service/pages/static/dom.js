// Elements, numbers and moments, made for a reader.
import { t } from "./words.js";

/** An element with attributes and children; a child that is null or false is left out. Text is never markup. */
export function h(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (name === "class") element.className = value;
    else if (value === true) element.setAttribute(name, "");
    else element.setAttribute(name, value);
  }
  element.append(...children.flat(3).filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

export const badge = (text, kind = text) => h("span", { class: `badge ${kind}` }, t(text));

const titles = JSON.parse(document.documentElement.dataset.titles || "{}");

/** The title of a procedure or a method, in the page's language; its name where the service has not read it yet. */
export const titled = (name) => titles[name] || name;

/** Replaces the content only where it changes: what a reader has selected or focused stays. */
export function fill(element, ...children) {
  const held = element.contains(document.activeElement) && document.activeElement.matches("input, textarea, select");
  if (!held) element.replaceChildren(...children.flat(3).filter((child) => child !== null && child !== undefined && child !== false));
}

export function span(seconds) {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return "–";
  if (seconds < 120) return `${seconds.toFixed(0)} s`;
  return seconds < 7200 ? `${(seconds / 60).toFixed(0)} min` : `${(seconds / 3600).toFixed(1)} h`;
}

export function bytes(count) {
  for (const [size, unit] of [[1e9, "GB"], [1e6, "MB"], [1e3, "kB"]]) if (count >= size) return `${(count / size).toPrecision(3)} ${unit}`;
  return `${count} B`;
}

const ZONE = Intl.DateTimeFormat().resolvedOptions().timeZone;
const LOCAL = new Intl.DateTimeFormat("sv-SE", { dateStyle: "short", timeStyle: "medium" });
const NAMED = new Intl.DateTimeFormat(undefined, { timeZoneName: "short" });

/** Time of day as in `moment`. */
export const clock = (at) => at.toLocaleTimeString("sv-SE", { hour: "2-digit", minute: "2-digit", second: "2-digit", timeZoneName: "short" });

/** Local time with its zone named; UTC is in the tooltip. */
export function moment(iso) {
  if (!iso) return "–";
  const at = new Date(iso), utc = at.toISOString().slice(0, 19).replace("T", " ");
  const zone = NAMED.formatToParts(at).find((part) => part.type === "timeZoneName");
  return h("time", { datetime: iso, title: `${utc} UTC (${ZONE})` }, `${LOCAL.format(at)} ${zone ? zone.value : ""}`.trim());
}

export function localTimes(within = document) {
  for (const element of within.querySelectorAll("time[datetime]")) {
    if (!element.dataset.local) { const shown = moment(element.getAttribute("datetime")); element.textContent = shown.textContent; element.title = shown.title; element.dataset.local = "1"; }
  }
}

/** SI unit of the API -> the unit people read, and its size in SI. */
export const DISPLAY = {
  "rad/s": ["deg/h", Math.PI / 180 / 3600], "rad": ["arcsec", Math.PI / 180 / 3600], "m/s^2": ["mg", 9.80665e-3],
  "rad/s^2": ["deg/h/s", Math.PI / 180 / 3600],
};
export const shownIn = (unit) => DISPLAY[unit] || [unit, 1];

const places = (sigma) => Number.isFinite(sigma) && sigma > 0 ? 1 - Math.floor(Math.log10(sigma)) : null;

/** A number: to two digits of its standard uncertainty where that is known, else six significant ones. */
export function number(value, sigma = null) {
  if (value === null || value === undefined) return "–";
  if (typeof value !== "number") return String(value);
  const digits = places(sigma);
  if (digits === null) return Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(6)));
  return digits > 12 ? value.toExponential(2) : digits >= 0 ? value.toFixed(digits) : String(Math.round(value * 10 ** digits) / 10 ** digits);
}

export function doubt(sigma) {
  const digits = places(sigma);
  if (digits === null) return "–";
  return digits > 12 ? sigma.toExponential(1) : digits >= 0 ? sigma.toFixed(digits) : String(Math.round(sigma * 10 ** digits) / 10 ** digits);
}

export const short = (id) => id.replace(/[^0-9a-f]/g, "").slice(-6);
