// Texts in the page's language: English stands in the scripts, other languages come from the catalogue.
const root = document.documentElement;
const words = root.lang === "en" ? {} : (await import(root.dataset.words)).default;

/** The text in the page's language; `{name}` is replaced by the value of that name. */
export function t(text, values = {}) {
  return (words[text] || text).replace(/\{(\w+)\}/g, (all, name) => name in values ? values[name] : all);
}
