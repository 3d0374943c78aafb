"""Citations can be looked up: every key that docstrings, comments and limits use is in docs/sources.md."""

import io
import re
import tokenize
from functools import cache
from pathlib import Path

import pytest

from tests.kit import citations_page
from tests.kit.documents import PACKAGES, ROOT, docstrings, texts_of_code

PAGE = (ROOT / "docs" / "sources.md").read_text(encoding="utf-8")
ENTRIES = re.findall(r"^\| (.+?) \| (.+) \| .+? \|$", PAGE, re.MULTILINE)
KEYS = {key for key, _ in ENTRIES} - {"key", "---"}
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
BARE = re.compile(r"(?<![\w.])(?<!textbook )(?<!Textbook )[TSAC] \d+\.\d|(?<![\w.])(?<![Pp]aper )F \d+(?=[-, )])")
"""A letter that says nothing without the page: "T 4.1", "S 4.119", "F 12"."""
NAMED = re.compile(
    r"[Tt]extbook \w+|[Pp]aper [A-Z]\b|[Tt]hesis\b|IEEE Std \d+|NIST SP \d+|NIST 800-\w+|NIST/SEMATECH e-Handbook"
    r"|RFC \d+|ISO \d+(?:-\d)?|Groves|Western Electric|Titterton"
)
YEAR = re.compile(r"(?<![\d.-])(?:18[5-9]\d|19\d\d|20[0-2]\d)(?![\d.-])")
NO_CITATION = re.compile(r"since 1970|\d{4} (?:Hz|records)|from 2023 to 2026")


def _texts(path: Path) -> list[tuple[str, str]]:
    """Docstrings and comments of a file, each with its place."""
    with io.StringIO(path.read_text(encoding="utf-8")) as lines:
        comments = [
            (f"{path.relative_to(ROOT)}:{token.start[0]}", token.string)
            for token in tokenize.generate_tokens(lines.readline)
            if token.type == tokenize.COMMENT
        ]
    return [*docstrings(path), *comments]


@cache
def _all_texts() -> list[tuple[str, str]]:
    return [entry for path in SOURCES for entry in _texts(path)]


def test_no_citation_is_a_bare_letter() -> None:
    bare = [f"{place}: {found[0]}" for place, text in _all_texts() if (found := BARE.search(text))]
    assert not bare, f"write the key of docs/sources.md, thesis 4.1, textbook S 4.119, paper F 12: {bare}"
    assert not re.search(r"\bT \d\.\d", texts_of_code()), "texts of reports cite the thesis by its name"


def test_every_named_source_is_in_the_bibliography() -> None:
    cited = {found[0].upper() + found[1:] for _, text in _all_texts() for found in NAMED.findall(text)}
    assert len(cited) > 12
    known = {key[0].upper() + key[1:] for key in KEYS}
    missing = {one for one in cited if not any(key == one or key.startswith(f"{one} ") for key in known)}
    assert not missing, f"docs/sources.md lacks {missing}"


def test_every_dated_citation_is_in_the_bibliography() -> None:
    """A year in a docstring is that of a paper: an entry has this year and a surname that stands in the docstring."""
    dated = [
        (place, text, year)
        for place, text in _all_texts()
        for year in YEAR.findall(NO_CITATION.sub("", text))
        if not place.startswith("bench_service")  # its years are of clocks and formats, not of papers
    ]
    assert len(dated) > 15
    unknown = [f"{place}: {year}" for place, text, year in dated if not _is_known(text, year)]
    assert not unknown, f"docs/sources.md lacks these citations: {unknown}"


def _is_known(text: str, year: str) -> bool:
    return any(
        year in entry and any(name in text for name in re.findall(r"[A-ZЁА-Я][\w]{2,}", key) + _authors(entry))
        for key, entry in ENTRIES
    )


def _authors(entry: str) -> list[str]:
    """Surnames before the title of an entry."""
    return re.findall(r"[A-Z]\w{2,}", entry.split("*")[0])


@pytest.mark.parametrize("word", ["design.md", "methods.md", "simulation.md", "facts:", "thesis_acceptance.json"])
def test_no_source_is_a_file_that_is_not_here(word: str) -> None:
    named = [place for place, text in _all_texts() if word in text and "thesis_acceptance.json" not in place]
    assert not named, f"{word} is no source: {named}"


def test_the_page_of_citations_is_that_of_the_docstrings() -> None:
    assert citations_page.PAGE.read_text(encoding="utf-8") == citations_page.text(), "run `make references`"


def test_every_entry_says_how_it_was_checked_and_is_cited() -> None:
    marks = {"original", "title page", "publisher, thesis", "thesis", "others", "no"}
    checked = re.findall(r"^\| (.+?) \| .+ \| (.+?) \|$", PAGE, re.MULTILINE)
    assert {mark for key, mark in checked if key not in ("key", "---")} <= marks
    background = {"paper M", "IEEE Std 1554", "Titterton and Weston"}  # compared with, used for no formula
    of_tests = {"Newey and West 1987", "Champ and Woodall 1987"}
    assert KEYS - set(citations_page.cited()) - background - of_tests == set(), "cite it, or take it off the page"
