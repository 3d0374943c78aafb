"""The page docs/citations.md: which section or equation of each source is used where, from docstrings and comments."""

import io
import re
import tokenize
from collections import defaultdict
from functools import cache
from pathlib import Path

from tests.kit.documents import PACKAGES, ROOT, docstrings

PAGE = ROOT / "docs" / "citations.md"
SOURCES = ROOT / "docs" / "sources.md"
ENTRY = re.compile(r"^\| (.+?) \| (.+) \|$", re.MULTILINE)
NUMBER = r"(?:[A-ZД]?\d+(?:\.\d+)*(?:[-–]\d+(?:\.\d+)*)?)"
WORDS = r"(?:and|to|or|table|tables|fig\.|figs|equations?|appendix|Annex|section|chapter)"
PLACES = re.compile(rf"(?:[ ,]+(?:{WORDS}|{NUMBER}|[A-ZД](?![\w.])))*")
HEAD = """# Citations: what is used where

Made from docstrings, comments and limits by `make references`; a test compares it. The keys are those of
[sources](sources.md). A place is a section, equation, table or figure as the source numbers it; *as a whole* means that
the text names the source without a place.

"""


@cache
def keys() -> tuple[str, ...]:
    """The keys of the bibliography, in the order of its page."""
    page = SOURCES.read_text(encoding="utf-8")
    return tuple(key for key, _ in ENTRY.findall(page) if key not in ("key", "---"))


def texts(path: Path) -> list[str]:
    """Docstrings and comments of a file."""
    with io.StringIO(path.read_text(encoding="utf-8")) as lines:
        comments = [
            token.string for token in tokenize.generate_tokens(lines.readline) if token.type == tokenize.COMMENT
        ]
    return [*(text for _, text in docstrings(path)), *comments]


@cache
def cited() -> dict[str, dict[str, set[str]]]:
    """Places of each key, and the modules that cite them."""
    found: dict[str, dict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
    for path in sorted(file for package in PACKAGES for file in (ROOT / package).rglob("*.py")):
        for text in texts(path):
            flat = " ".join(text.split())
            for key in keys():
                for match in re.finditer(_pattern(key), flat):
                    place = PLACES.match(flat, match.end())
                    shown = re.sub(rf"(?:[ ,]+{WORDS})+$", "", place[0] if place else "").strip(" ,")
                    found[key][shown if re.search(r"\d|[A-ZД]$", shown) and shown[:3] != "and" else "as a whole"].add(
                        str(path.relative_to(ROOT))
                    )
    return found


@cache
def _pattern(key: str) -> str:
    """How a key stands in a text: a paper of a year by its first author, all others as they are."""
    dated = re.fullmatch(r"([\w ]+?)(?: and .*)? (?:1[89]|20)\d\d", key)
    if dated:
        return rf"\b{dated[1]}\b"
    return rf"(?<![\w-])[{key[0].upper()}{key[0].lower()}]{re.escape(key[1:])}(?![\w-])"


def text() -> str:
    """The whole page."""
    found = cited()
    lines = [HEAD]
    for key in keys():
        if key in found:
            rows = "".join(
                f"| {place} | {', '.join(f'`{module}`' for module in sorted(modules))} |\n"
                for place, modules in sorted(found[key].items(), key=lambda one: _order(one[0]))
            )
            lines.append(f"## {key}\n\n| place | cited in |\n|---|---|\n{rows}\n")
    return "".join(lines).rstrip() + "\n"


def _order(place: str) -> tuple[tuple[int, ...], str]:
    return tuple(int(part) for part in re.findall(r"\d+", place)[:3]), place


if __name__ == "__main__":
    PAGE.write_text(text(), encoding="utf-8")
