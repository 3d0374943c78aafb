// A form from a JSON Schema: units from the field's name, bounds, descriptions, and what differs from the default.
import { h } from "./dom.js";
import { t } from "./words.js";

const UNITS = [["_deg_per_sqrt_h", "deg/√h"], ["_deg_sqrt_h", "deg/√h"], ["_ug_sqrt_s", "µg·√s"], ["_codes_per_c", "codes/°C"], ["_rad_s", "rad/s"], ["_deg_s2", "deg/s²"], ["_c_s2", "°C/s²"], ["_c_s", "°C/s"], ["_ms", "ms"], ["_arcsec", "″"], ["_deg_h", "deg/h"], ["_deg_s", "deg/s"], ["_m_s2", "m/s²"], ["_c_min", "°C/min"], ["_hz", "Hz"], ["_ppm", "ppm"], ["_deg", "°"], ["_ma", "mA"], ["_ug", "µg"], ["_mg", "mg"], ["_nt", "nT"], ["_v", "V"], ["_c", "°C"], ["_s", "s"], ["_h", "h"], ["_m", "m"]];

export function unitOf(name) {
  const found = UNITS.find(([end]) => name.endsWith(end));
  return found ? found[1] : "";
}

export function plainName(name) {
  const found = UNITS.find(([end]) => name.endsWith(end)), stem = found ? name.slice(0, -found[0].length) : name;
  const words = stem.replaceAll("_", " ");
  return t(words.charAt(0).toUpperCase() + words.slice(1));
}

/** A description for a person: what a program calls None or null is a field left empty. */
const plain = (description) => t(description).replace(/\b(?:None|null)(?=:)/g, t("empty"));

const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

function resolved(schema, whole) {
  if (!schema.$ref) return schema;
  const target = schema.$ref.split("/").slice(1).reduce((place, key) => place[key], whole);
  return { ...target, ...Object.fromEntries(Object.entries(schema).filter(([key]) => key !== "$ref")) };
}

/** The kinds that a value may have; `nullable` where null is one of them. */
function kindOf(schema, whole) {
  const one = resolved(schema, whole), options = one.anyOf ? one.anyOf.map((option) => resolved(option, whole)) : [one];
  const nullable = options.some((option) => option.type === "null"), real = options.filter((option) => option.type !== "null");
  return { ...one, ...(real.length === 1 ? real[0] : {}), description: one.description, default: "default" in one ? one.default : undefined, nullable, mixed: real.length > 1 };
}

function bounds(kind) {
  const low = kind.minimum ?? kind.exclusiveMinimum, high = kind.maximum ?? kind.exclusiveMaximum;
  if (low === undefined && high === undefined) return "";
  if (low !== undefined && high !== undefined) return `${low} … ${high}`;
  return low !== undefined ? `${kind.exclusiveMinimum !== undefined ? ">" : "≥"} ${low}` : `≤ ${high}`;
}

const shown = (value) => value === null || value === undefined ? "" : typeof value === "object" ? JSON.stringify(value) : String(value);

class Field {
  constructor(path, schema, whole, changed, prefix = "") {
    this.path = path;
    this.kind = kindOf(schema, whole);
    this.standard = this.kind.default === undefined ? null : this.kind.default;
    const name = path[path.length - 1], id = `field-${prefix}${path.join("-")}`, unit = unitOf(name), range = bounds(this.kind);
    const describe = [this.kind.description && plain(this.kind.description), range && t("allowed: {range}", { range: `${range} ${unit}`.trim() })].filter(Boolean).join("; ");
    this.input = this.control(id);
    this.message = h("span", { class: "message", role: "alert" });
    this.back = h("button", { type: "button", class: "quiet", hidden: true, "aria-label": t("Back to the default of {name}", { name: plainName(name) }), onclick: () => { this.set(this.standard); changed(); } }, "↺");
    this.note = h("span", { class: "note", id: `${id}-note` }, describe);
    this.element = h("div", { class: "field", "data-field": path.join(".") }, h("label", { for: id }, `${plainName(name)}${unit ? `, ${unit}` : ""}`), this.input, " ", this.back, this.note, this.message);
    this.input.setAttribute("aria-describedby", `${id}-note`);
    this.input.addEventListener(this.input.matches("select, [type=checkbox]") ? "change" : "input", changed);
    this.set(this.standard);
  }

  control(id) {
    const { kind } = this;
    if (kind.enum) return h("select", { id }, ...(kind.nullable ? [h("option", { value: "" }, "–")] : []), ...kind.enum.map((one) => h("option", { value: String(one) }, t(String(one)))));
    if (kind.type === "boolean" && !kind.nullable) return h("input", { id, type: "checkbox" });
    if ((kind.type === "number" || kind.type === "integer") && !kind.mixed) return h("input", { id, type: "number", step: kind.type === "integer" ? 1 : "any", inputmode: "decimal" });
    if (kind.type === "string" && !kind.mixed && (kind.maxLength || 0) <= 200) return h("input", { id, type: "text" });
    return h("textarea", { id, spellcheck: "false" });
  }

  get() {
    const { input, kind } = this;
    if (input.type === "checkbox") return input.checked;
    const text = input.value.trim();
    if (text === "") return kind.nullable ? null : kind.type === "string" ? "" : this.standard;
    if (kind.enum) return kind.enum.find((one) => String(one) === text);
    if (input.type === "number") return Number(text);
    if (input.tagName === "TEXTAREA" && kind.type !== "string") {
      try { return JSON.parse(text); } catch { if (kind.mixed) return text; throw new SyntaxError(t("This is no list or object in JSON.")); }
    }
    return text;
  }

  set(value) {
    if (this.input.type === "checkbox") this.input.checked = Boolean(value);
    else this.input.value = shown(value);
    this.mark();
  }

  /** Marks what differs from the default; true where it does. */
  mark() {
    let value;
    try { value = this.get(); } catch { value = undefined; }
    const differs = !same(value, this.standard);
    this.element.classList.toggle("changed", differs);
    this.back.hidden = !differs;
    if (differs) this.back.title = `${t("Default")}: ${shown(this.standard) || t("chosen by the service")}`;
    return differs;
  }

  error(text) {
    this.element.classList.toggle("wrong", Boolean(text));
    this.message.textContent = text || "";
    this.input.setAttribute("aria-invalid", text ? "true" : "false");
  }

  /** What the service takes where the field is left open. */
  filled(value) {
    if (value !== null && value !== undefined && this.input.tagName !== "SELECT" && this.input.type !== "checkbox") this.input.placeholder = shown(value).slice(0, 200);
  }
}

export class SchemaForm {
  constructor(schema, changed, prefix = "") {
    this.fields = [];
    this.prefix = prefix;
    this.changed = () => { for (const field of this.fields) field.mark(); changed(); };
    this.element = h("div", { class: "fields" }, ...this.part(schema, schema, [], {}));
    if (!this.fields.length) this.element.append(h("p", { class: "note" }, t("It has no parameters.")));
  }

  part(schema, whole, path, defaults) {
    const bare = ([, given]) => { const kind = kindOf(given, whole); return kind.mixed || kind.type === "array" || (kind.type === "object" && (kind.nullable || !kind.properties)); };
    const all = Object.entries(schema.properties || {}), ordered = [...all.filter((one) => !bare(one)), ...all.filter(bare)];  // what is typed as JSON comes last
    return ordered.map(([name, given]) => {
      const own = defaults && name in defaults ? { ...given, default: defaults[name] } : given, kind = kindOf(own, whole);
      if (kind.type === "object" && kind.properties && !kind.mixed && !kind.nullable) {
        return h("fieldset", {}, h("legend", {}, plainName(name)), ...this.part(kind, whole, [...path, name], kind.default));
      }
      const field = new Field([...path, name], own, whole, () => this.changed(), this.prefix);
      this.fields.push(field);
      return field.element;
    });
  }

  /** The parameters that differ from the defaults. Raises `SyntaxError` for a text that is no value. */
  values() {
    const out = {};
    for (const field of this.fields) {
      field.error("");
      let value;
      try { value = field.get(); } catch (error) { field.error(error.message); throw error; }
      if (same(value, field.standard)) continue;
      const last = field.path.length - 1;
      const place = field.path.slice(0, last).reduce((inner, key) => (inner[key] = inner[key] || {}), out);
      place[field.path[last]] = value;
    }
    return out;
  }

  load(parameters) {
    for (const field of this.fields) {
      const value = field.path.reduce((inner, key) => inner === undefined || inner === null ? undefined : inner[key], parameters);
      if (value !== undefined) field.set(value);
    }
  }

  resolvedAs(parameters) {
    for (const field of this.fields) field.filled(field.path.reduce((inner, key) => inner === undefined || inner === null ? undefined : inner[key], parameters));
  }

  /** Shows the errors of a problem document at their fields; gives those that belong to none. */
  errors(list) {
    const left = [];
    for (const one of list || []) {
      const name = one.field.replace(/^(parameters|body)\./, "").replace(/^parameters\./, "");
      const field = this.fields.find((known) => name === known.path.join(".") || name.startsWith(`${known.path.join(".")}.`)) || this.fields.find((known) => known.path[known.path.length - 1] === name.split(".")[0]);
      if (field) field.error(one.message); else left.push(one);
    }
    return left;
  }
}
