"""Texts of the pages as they stand in templates and scripts: what the catalogue of another language has to hold."""

import re
from pathlib import Path

from jinja2 import Environment

PAGES = Path(__file__).parents[2] / "bench_service" / "pages"
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
