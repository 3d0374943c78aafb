// Accounts of people, tokens of programs, and the procedures that operators may run.
import { ask, part, read, send } from "./api.js";
import { busy, confirmed, verb } from "./act.js";
import { fill, h, moment } from "./dom.js";
import { t } from "./words.js";

const ROLES = [["viewer", t("viewer: looks and stops")], ["operator", t("operator: runs approved procedures")], ["engineer", t("engineer: runs, imports, decides")], ["admin", t("admin: accounts too")]];
const NOBODY = t("None yet: nobody has to log in. The first account is made on the host, with `bench user add NAME --role admin`, and switches log-in on.");
const at = (id) => document.getElementById(id);

const roles = (chosen, name) => h("select", { "aria-label": name }, ...ROLES.map(([role, text]) => h("option", { value: role, selected: role === chosen }, text)));
const table = (name, heads, rows) => h("div", { class: "wide", tabindex: 0, role: "region", "aria-label": name }, h("table", {}, h("thead", {}, h("tr", {}, ...heads.map((head) => h("th", {}, head)))), h("tbody", {}, ...rows)));

function person(one) {
  const path = `/api/v1/accounts/${part(one.name)}`, output = h("output", { role: "status" });
  const role = roles(one.role, `${t("Role")} ${one.name}`), team = h("input", { value: one.team, size: 10, maxlength: 64, "aria-label": `${t("Team")} ${one.name}` });
  const save = h("button", { type: "button" }, t("Change"));
  save.addEventListener("click", async () => { if (await busy(save, output, () => ask("PATCH", path, { role: role.value, team: team.value.trim() }))) people(); });
  const word = h("button", { type: "button" }, t("New password"));
  word.addEventListener("click", async () => {
    const given = await confirmed({ title: t("New password of {name}", { name: one.name }), lost: t("Its open sessions end, and a locked name is free again."), verb: t("Set it"), reason: { label: t("New password"), name: "password", required: true, secret: true } });
    if (given && await busy(word, output, () => ask("PATCH", path, { password: given.password }))) people();
  });
  return h("tr", { "data-account": one.name }, h("th", { scope: "row" }, one.name), h("td", {}, role), h("td", {}, team), h("td", {}, one.has_password ? t("password") : t("proxy")), h("td", {}, moment(one.created_at), one.created_by ? ` ${t("by")} ${one.created_by}` : ""),
    h("td", {}, h("div", { class: "verbs" }, save, word, verb(t("Remove"), { method: "DELETE", path, kind: "danger", then: people, confirm: { title: t("Remove the account {name}?", { name: one.name }), lost: t("Its sessions end at once. What it did stays in the audit trail."), verb: t("Remove") } }), output)));
}

async function people() {
  const all = await read("/api/v1/accounts");
  at("accounts").replaceChildren(all.length ? table(t("People"), [t("Name"), t("Role"), t("Team"), t("Known by"), t("Made"), t("Do")], all.map(person))
    : h("p", { class: "note" }, NOBODY));
  at("new-account").hidden = !all.length;
}

function token(one) {
  const over = one.revoked_at || new Date(one.expires_at) < new Date();
  return h("tr", { "data-token": one.name }, h("th", { scope: "row" }, one.name), h("td", {}, t(one.role)), h("td", {}, one.team), h("td", {}, moment(one.created_at), one.created_by ? ` ${t("by")} ${one.created_by}` : ""), h("td", {}, one.revoked_at ? [t("revoked"), " ", moment(one.revoked_at)] : moment(one.expires_at)), h("td", {}, moment(one.last_used_at)),
    h("td", {}, over ? "" : verb(t("Revoke"), { method: "DELETE", path: `/api/v1/tokens/${part(one.id)}`, kind: "danger", then: tokens, confirm: { title: t("Revoke the token {name}?", { name: one.name }), lost: t("Programs that use it are refused within a second. It cannot be made valid again."), verb: t("Revoke") } })));
}

async function tokens() {
  const all = await read("/api/v1/tokens");
  at("tokens").replaceChildren(all.length ? table(t("Tokens of programs"), [t("Name"), t("Role"), t("Team"), t("Made"), t("Ends"), t("Last used"), t("Do")], all.map(token)) : h("p", {}, t("None yet.")));
}

async function approvals() {
  const [all, known] = await Promise.all([read("/api/v1/procedures"), read("/api/v1/approvals")]), by = new Map(known.map((one) => [one.procedure, one]));
  at("approvals").replaceChildren(table(t("Procedures that operators may run"), [t("Procedure"), t("Version"), t("Approved"), t("Do")], all.map((one) => {
    const found = by.get(one.name), path = `/api/v1/procedures/${part(one.name)}/approval`, current = found && found.version === one.version;
    return h("tr", { "data-approval": one.name }, h("th", { scope: "row", title: one.name }, t(one.title)), h("td", {}, one.version),
      h("td", {}, found ? [h("span", { class: `badge ${current ? "pass" : "error"}` }, current ? t("approved") : `${t("only version")} ${found.version}`), " ", moment(found.at), found.by ? ` ${t("by")} ${found.by}` : ""] : t("not approved")),
      h("td", {}, current ? verb(t("Withdraw"), { method: "DELETE", path, then: approvals, confirm: { title: t("Withdraw the approval?"), lost: t("Operators may not start it any more; jobs in the queue stay."), verb: t("Withdraw") } }) : verb(t("Approve"), { method: "PUT", path, then: approvals })));
  })));
}

function sent(id, path, then, shape) {
  const form = at(id), select = form.elements.role;
  select.append(...ROLES.map(([role, text]) => h("option", { value: role }, text)));
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const made = await busy(form.querySelector("button"), form.querySelector("output"), () => send(path, shape(Object.fromEntries(new FormData(form)))));
    if (made) { form.reset(); then(made); }
  });
}

function shown(made) {  // once: the service does not keep it
  const text = h("input", { readonly: true, size: 60, value: made.token, "aria-label": t("The new token") });
  fill(at("secret"), h("div", { class: "warning" }, h("p", {}, t("The token of {name}: copy it now, it is not shown again.", { name: made.name })), h("div", { class: "verbs" }, text,
    h("button", { type: "button", onclick: () => { text.select(); navigator.clipboard.writeText(made.token).catch(() => {}); } }, t("Copy")), h("button", { type: "button", onclick: () => fill(at("secret")) }, t("I have it")))));
  tokens();
}

async function begin() {
  const mine = await read("/api/v1/session");
  at("me").textContent = mine.name ? `${t("You are")} ${mine.name}, ${t(mine.role)}.` : mine.log_in_needed ? "" : t("This service has no accounts: everybody on this host may do everything.");
  sent("new-account", "/api/v1/accounts", people, ({ name, role, team, password }) => ({ name, role, team: team.trim(), ...(password && { password }) }));
  sent("new-token", "/api/v1/tokens", shown, ({ name, role, team, days }) => ({ name, role, team: team.trim(), days: Number(days) }));
  await approvals();
  if (!mine.rights.includes("access")) { at("trouble").textContent = mine.log_in_needed ? t("Accounts and tokens are for an admin.") : NOBODY; return; }
  at("access").hidden = false;
  await Promise.all([people(), tokens()]);
}

begin().catch((error) => { at("trouble").className = "refused"; at("trouble").textContent = error.message; });
