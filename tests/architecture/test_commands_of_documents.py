"""Commands in the documents exist: names and options of `bench`, targets of make, routes of the API, TOML that reads.

What a page's commands do is tested where the command is; here, that a reader who types a line is not refused for it.
"""

import json
import re
import shlex
import tomllib
from urllib.parse import urlsplit

import pytest

from bench_service.settings import Settings
from tests.kit.command_words import refused, unknown
from tests.kit.documents import PAGES, ROOT, Block, blocks, texts_of_code
from tests.kit.rights_page import routes

BLOCKS = [block for page in PAGES for block in blocks(page)]
SHELL = [
    b
    for b in BLOCKS
    if b.language in ("", "sh") and re.search(r"^\s*(\.venv/bin/bench|bench|make|curl) ", b.text, re.M)
]
HISTORY = ("changelog.md", "decisions.md")
"""Pages that name commands as they were."""
_TARGETS = set(re.findall(r"^([a-z.$()/-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))


def _lines(block: Block) -> list[str]:
    """Commands of a block, without comments; continued lines are one."""
    return [line.strip() for line in re.sub(r"\\\n", " ", block.text).splitlines() if line.strip()]


@pytest.mark.parametrize("block", SHELL, ids=str)
def test_every_command_of_bench_is_one_with_these_options(block: Block) -> None:
    for line in _lines(block):
        words = shlex.split(line.split(" > ")[0], comments=True)
        if words and words[0] in ("bench", ".venv/bin/bench") and words[1:2] != ["stop"]:
            assert refused(words[1:]) == "", line


@pytest.mark.parametrize("block", SHELL, ids=str)
def test_every_target_of_make_is_one(block: Block) -> None:
    named = {t for line in _lines(block) for t in re.findall(r"^make (?:-C \S+ )?([a-z][a-z-]*)", line)}
    assert named <= _TARGETS


def test_every_address_of_the_commands_is_a_route() -> None:
    paths = {re.sub(r"\{[^}]+\}", "[^/]+", route.path) for route in routes()}
    addresses = [a for block in SHELL for a in re.findall(r"curl[^\n]*?\$API(/[^\s\"']*)", block.text)]
    assert len(addresses) > 10
    wrong = [
        a
        for a in addresses
        if not any(re.fullmatch(path, prefix + urlsplit(a).path) for path in paths for prefix in ("", "/api/v1"))
    ]
    assert not wrong, f"the API has no such route: {wrong}"


@pytest.mark.parametrize("block", [b for b in BLOCKS if b.language in ("toml", "json")], ids=str)
def test_toml_and_json_can_be_read(block: Block) -> None:
    (tomllib if block.language == "toml" else json).loads(block.text)


INLINE = [
    (page, " ".join(text.split()))
    for page in PAGES
    if page.name not in HISTORY
    for text in re.findall(r"(?<!`)`([^`]+)`(?!`)", re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.M | re.S))
]


def test_every_command_that_a_sentence_or_a_message_quotes_exists() -> None:
    quoted = {text for _, text in INLINE if text.startswith("bench ")}
    quoted |= {" ".join(text.split()) for text in re.findall(r"`(bench [a-z][^`]*)`", texts_of_code())}
    quoted = {text for text in quoted if not text.startswith("bench …")}
    assert len(quoted) > 60
    wrong = {text: why for text in quoted if (why := unknown(text.replace("…", " X ")))}
    assert not wrong


def test_every_target_of_make_that_a_sentence_names_is_one() -> None:
    named = {m[1] for _, text in INLINE if (m := re.match(r"make (?:-\S+ )?([a-z][a-z-]+)", text))}
    assert len(named) > 10
    assert named <= _TARGETS


def test_every_route_that_a_sentence_names_is_one() -> None:
    """A page about one noun may leave out the beginning of its paths; a value may stand for a part in braces."""
    known = [(route.method, re.sub(r"\{[^}]+\}", "[^/]+", route.path)) for route in routes()]
    named = {m.groups() for _, text in INLINE if (m := re.match(r"(GET|POST|PUT|PATCH|DELETE) (/[^\s?#…]*)$", text))}
    assert len(named) > 20
    wrong = {
        (method, path)
        for method, path in named
        if not any(method == verb and _ends_so(path, pattern) for verb, pattern in known)
    }
    assert not wrong, f"the API has no such route: {wrong}"


def _ends_so(path: str, pattern: str) -> bool:
    """True where a path fits the last parts of a route's pattern, as many as the path has."""
    parts = path.strip("/").split("/")
    last = pattern.strip("/").replace("[^/]+", "*").split("/")[-len(parts) :]
    fits = [part == own or own == "*" for part, own in zip(parts, last, strict=False)]
    return len(last) == len(parts) and all(fits) and any(own != "*" for own in last)


def test_every_variable_that_a_sentence_names_is_a_setting() -> None:
    named = {name for _, text in INLINE for name in re.findall(r"\bBENCH_[A-Z_]+\b", text)}
    assert len(named) > 20
    assert named - set(Settings.variables()) - {"BENCH_"} == set(), "docs/settings.md lists the settings"
