"""Commands in the documents exist: names and options of `bench`, targets of make, routes of the API, TOML that reads.

What a page's commands do is tested where the command is; here, that a reader who types a line is not refused for it.
"""

import json
import re
import shlex
import tomllib
from urllib.parse import urlsplit

import pytest

from tests.kit.command_words import refused
from tests.kit.documents import PAGES, ROOT, Block, blocks
from tests.kit.rights_page import routes

BLOCKS = [block for page in PAGES for block in blocks(page)]
SHELL = [
    b
    for b in BLOCKS
    if b.language in ("", "sh") and re.search(r"^\s*(\.venv/bin/bench|bench|make|curl) ", b.text, re.M)
]
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
