"""The documents hold: links lead somewhere, files exist, pictures are today's, quoted refusals are the code's."""

import re
from pathlib import Path

import pytest

from bench_service.settings import Settings
from procedures import catalog, methods
from tests.kit.documents import PAGES, ROOT, Block, blocks, texts_of_code
from tests.kit.layer_picture import PAGE as ARCHITECTURE
from tests.kit.layer_picture import replaced

_LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
_FILE = re.compile(
    r"`((?:bench_service|procedures|simulators|tests|client|migrations|docs|findings|\.ci)/[\w./-]+\.\w+)`"
)
TROUBLES = ROOT / "docs" / "troubleshooting.md"


def _headings(page: Path) -> set[str]:
    """Anchors of a page's headings, as a forge makes them."""
    bare = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    titles = re.findall(r"^#+ (.+)$", bare, re.MULTILINE)
    anchors = set(re.findall(r'<a id="([\w-]+)">', bare))
    return anchors | {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def test_every_procedure_and_method_is_on_its_page() -> None:
    page = (ROOT / "docs" / "procedures.md").read_text(encoding="utf-8")
    catalogue = {*catalog.discover(), *methods.discover()}
    assert {name for name in catalogue if f"`{name}`" not in page} == set()


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_relative_link_leads_to_a_file_and_a_heading(page: Path) -> None:
    dead = []
    for link in _LINK.findall(page.read_text(encoding="utf-8")):
        if re.match(r"[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        target = (page.parent / name).resolve() if name else page
        if not target.exists() or (anchor and anchor not in _headings(target)):
            dead.append(link)
    assert not dead, f"{page.name} has links that lead nowhere: {dead}"


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_file_that_a_page_names_exists(page: Path) -> None:
    named = set(_FILE.findall(page.read_text(encoding="utf-8")))
    missing = sorted(name for name in named if not (ROOT / name).exists() and "NNNN" not in name)
    # A page shows where files of the reader's own would go; the changelog names files as they were.
    allowed = {"docs/add-a-procedure.md", "docs/add-a-device.md", "docs/changelog.md"}
    assert str(page.relative_to(ROOT)) in allowed or not missing, (
        f"{page.name} names files that are not there: {missing}"
    )


def test_every_page_is_in_the_index() -> None:
    index = ROOT / "docs" / "README.md"
    linked = set(_LINK.findall(re.sub(r"#[\w-]+\)", ")", index.read_text(encoding="utf-8"))))
    pages = {page.name for page in (ROOT / "docs").glob("*.md")} - {index.name}
    assert pages - linked == set(), "docs/README.md lists every page"


def test_the_pictures_of_the_layers_are_those_of_the_contracts() -> None:
    page = ARCHITECTURE.read_text(encoding="utf-8")
    assert replaced(page) == page, "run `make pictures`"


def test_every_message_of_the_troubleshooting_page_is_one_of_the_code() -> None:
    """Fixed words between … must stand in one string of the code, in their order."""
    rows = re.findall(r"^\| `(.+)` \| ", TROUBLES.read_text(encoding="utf-8"), re.MULTILINE)
    assert len(rows) > 30
    texts = texts_of_code()
    absent = [row for row in rows if not re.search(".*".join(map(re.escape, row.split("…"))), texts)]
    assert not absent, f"no such message in the code any more: {absent}"


def test_the_page_of_settings_has_every_setting_and_no_other() -> None:
    page = (ROOT / "docs" / "settings.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`BENCH_.+?) \|", page, re.MULTILINE)
    named = {name for row in rows for name in re.findall(r"BENCH_\w+", row)}
    assert named == set(Settings.variables())


def test_no_entry_of_the_changelog_stands_twice() -> None:
    """Branches are merged by keeping the lines of both: a line that one of them moved comes back."""
    lines = (ROOT / "docs" / "changelog.md").read_text(encoding="utf-8").splitlines()
    entries = [line for line in lines if line.startswith("- ")]
    assert sorted({entry for entry in entries if entries.count(entry) > 1}) == []


@pytest.mark.parametrize("block", [b for page in PAGES for b in blocks(page)], ids=str)
def test_every_block_is_run_or_says_why_not(block: Block) -> None:
    """A block has a mark before it: `<!-- run: FILE -->`, `<!-- checked: FILE -->` or `<!-- not run: REASON -->`."""
    assert block.kind, f"{block}: no mark; a test that runs it, or the reason why none does"
    if block.kind != "not run":
        test = ROOT / block.why
        assert test.is_file(), f"{block}: there is no {block.why}"
        named = block.kind == "checked" or block.page.name in test.read_text(encoding="utf-8")
        assert named, f"{block}: {block.why} does not name this page"
