"""Texts of the pages as they stand in templates and scripts: what the catalogue of another language has to hold."""

import re
from collections.abc import Iterable

from jinja2 import Environment

from tests.kit.source_facts import ROOT

PAGES = ROOT / "bench_service" / "pages"
_STRING = r'"((?:[^"\\]|\\.)*)"'
_CALL = re.compile(rf"\bt\(\s*{_STRING}")
_NAMES = re.compile(r"\.\.\.\[((?:\s*\"[^\"]*\",?)+)\]\.map\(\(name\) => h\(\"th\", \{\}, t\(name\)\)\)")


def of_templates() -> set[str]:
    """Texts in `_("…")` of the templates."""
    environment = Environment(extensions=["jinja2.ext.i18n"])
    found: set[str] = set()
    for file in (PAGES / "templates").glob("*.html"):
        for _, _, text in environment.extract_translations(file.read_text(encoding="utf-8")):
            found |= {text} if isinstance(text, str) else {part for part in text or () if isinstance(part, str)}
    return found


def of_scripts() -> set[str]:
    """Texts in `t("…")` of the scripts, and the headings of tables that are made from a list of names."""
    found: set[str] = set()
    for file in (PAGES / "static").glob("*.js"):
        text = file.read_text(encoding="utf-8")
        found |= {one.replace('\\"', '"') for one in _CALL.findall(text)}
        for names in _NAMES.findall(text):
            found |= set(re.findall(r'"([^"]*)"', names))
    return found - {"t"}


def in_product(texts: Iterable[str]) -> set[str]:
    """Those of the texts that stand in the product's sources as a whole string, in any quotes and over any number of
    lines, or within a docstring: titles, descriptions and values that pages translate when they show them.
    """
    files = (file for package in ("bench_service", "procedures") for file in (ROOT / package).rglob("*"))
    source = "\n".join(file.read_text(encoding="utf-8") for file in files if file.suffix in {".py", ".js", ".html"})
    strings, docstrings = re.sub(r"""["']\s*f?["']""", "", source), re.sub(r"\s+", " ", source)

    def stands(text: str) -> bool:
        written = (text, text.replace('"', '\\"'))
        whole = any(f"{quote}{one}{quote}" in strings for one in written for quote in "\"'`")
        return whole or (" " in text and text in docstrings)

    return {text for text in texts if stands(text)}
