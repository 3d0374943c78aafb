"""Plain English, as far as a machine can tell: summaries, names and private words (docs/english.md)."""

import re

from tests.kit.documents import PACKAGES, PAGES, ROOT
from tests.kit.page_texts import of_scripts, of_templates
from tests.kit.source_facts import facts

SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
HEADLESS = ("What ", "Who ", "Whoever ", "Whose ", "Of ")
HEADLESS_DOCSTRING = re.compile(rf'(?:\A|:(?:  #.*)?\n)\s*"""((?:{"|".join(HEADLESS)}).*)')
LEAST_WORDS = 4
MOST_SHORT = 10
"""Summaries that may have fewer words; each is one more than none, and a new one pushes an old one out."""
POETIC = re.compile(
    r"^(Question|Told\w*|\w*Beside\w*|\w*Whoever\w*|\w*Eye|\w*Nobody\w*|in_our_words|\w+Desk|[Pp]atien\w+)$"
)
PRIVATE = re.compile(r"in our words|nobody's|\bthe told\b|\bpatience\b", re.IGNORECASE)


def _summaries() -> list[tuple[str, str]]:
    return [
        (f"{path.relative_to(ROOT)}: {defined.name}", " ".join(defined.docstring.split("\n\n")[0].split()))
        for path in SOURCES
        for defined in facts(path).definitions
        if defined.docstring
    ]


def test_summaries_begin_with_a_noun_or_a_verb_and_have_four_words() -> None:
    summaries = _summaries()
    assert len(summaries) > 2000
    headless = [f"{place}: {text}" for place, text in summaries if text.startswith(HEADLESS)]
    assert headless == []
    short = [f"{place}: {text}" for place, text in summaries if len(text.split()) < LEAST_WORDS]
    assert len(short) <= MOST_SHORT, f"name the thing or the verb in four words at least: {short}"


def test_docstrings_of_tests_and_client_begin_so_too() -> None:
    """By text: to parse six hundred files more takes four seconds."""
    paths = sorted(path for folder in ("tests", "client/bench_client") for path in (ROOT / folder).rglob("*.py"))
    assert len(paths) > 400
    headless = {
        f"{path.relative_to(ROOT)}: {found[1]}"
        for path in paths
        for found in HEADLESS_DOCSTRING.finditer(path.read_text(encoding="utf-8"))
    }
    assert headless == set()


def test_no_class_or_function_has_a_poetic_name() -> None:
    poetic = {
        f"{path.relative_to(ROOT)}: {defined.name}"
        for path in SOURCES
        for defined in facts(path).definitions
        if POETIC.match(defined.name)
    }
    assert poetic == set(), f"name it after its pattern or its thing, see docs/english.md: {poetic}"


def test_pages_and_documents_have_no_private_words() -> None:
    texts = of_templates() | of_scripts()
    assert len(texts) > 100
    assert {text for text in texts if PRIVATE.search(text)} == set()
    quoting = {"english.md", "changelog.md"}  # they show the words that are not to be used, or keep old entries
    lines = [
        f"{page.name}: {line.strip()}"
        for page in PAGES
        if page.name not in quoting
        for line in page.read_text(encoding="utf-8").splitlines()
        if PRIVATE.search(line)
    ]
    assert lines == []


def test_the_names_that_the_page_recommends_are_those_of_the_code() -> None:
    page = (ROOT / "docs" / "english.md").read_text(encoding="utf-8")
    pairs = re.findall(r"^\| `(\w+)` \| `(\w+)`", page, re.MULTILINE)
    assert len(pairs) >= 3
    named = {defined.name for path in SOURCES for defined in facts(path).definitions}
    assert {after for _, after in pairs} - named == set()
    assert {before for before, _ in pairs} & named == set()
