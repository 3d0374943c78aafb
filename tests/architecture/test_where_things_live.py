"""The page docs/where-does-it-live.md is true: every file, folder, module and name that it gives is there."""

import re
from pathlib import Path

from tests.kit.documents import ROOT

PAGE = ROOT / "docs" / "where-does-it-live.md"
TREE = re.compile(r"^<!-- not run: a picture of the folders -->\n((?: {4}.*\n)+)", re.MULTILINE)
LISTED = re.compile(r"\[([\w ]+)\](?!\()")
FILE = re.compile(r"[\w./-]+\.(?:py|js|toml|sql|md|po|json|typ|yml)\b")
QUOTED = re.compile(r"`([^`]+)`")
NAME_IN_FILE = re.compile(r"((?:`[\w.]+`(?:, | and )?)+) in `([\w./-]+\.\w+)`")


def _lines() -> list[tuple[Path, str]]:
    """Path and description of each line of the drawn tree; a description goes on in lines without a name."""
    drawn = TREE.search(PAGE.read_text(encoding="utf-8"))
    assert drawn is not None
    found: list[tuple[Path, str]] = []
    folders: list[tuple[int, Path]] = []
    for line in drawn[1].splitlines():
        entry = re.match(r"( {4,12})(\S+) {2,}(.+)$", line)
        if entry is None:
            path, text = found.pop()
            found.append((path, f"{text} {line.strip()}"))
            continue
        depth = len(entry[1])
        folders = [(at, folder) for at, folder in folders if at < depth]
        path = (folders[-1][1] if folders else ROOT) / entry[2]
        if entry[2].endswith("/"):
            folders.append((depth, path))
        found.append((path, entry[3]))
    return found


def _is_there(name: str, folder: Path) -> bool:
    return (folder / name).exists() or (folder / f"{name}.py").exists()


def test_every_file_and_folder_of_the_drawn_tree_is_there() -> None:
    lines = _lines()
    assert len(lines) > 100
    assert {str(path.relative_to(ROOT)) for path, _ in lines if not path.exists()} == set()


def test_every_module_that_a_line_of_the_tree_lists_is_there() -> None:
    listed = 0
    wrong: list[str] = []
    for path, text in _lines():
        folder = path if path.is_dir() else path.parent
        names = [name for words in LISTED.findall(text) for name in words.split()] + FILE.findall(text)
        listed += len(names)
        wrong += [
            f"{path.relative_to(ROOT)}: {name}"
            for name in names
            if not _is_there(name, folder) and not (ROOT / name).exists() and not (ROOT / "docs" / name).exists()
        ]
    assert listed > 150
    assert wrong == []


def test_every_path_of_the_tables_is_there() -> None:
    """A path without a package is one of `bench_service`; a bare name is the name of a file somewhere in it."""
    rows = [row for row in PAGE.read_text(encoding="utf-8").splitlines() if row.startswith("| ")]
    assert len(rows) > 80
    somewhere = {path.name for path in (ROOT / "bench_service").rglob("*.py")}
    quoted = {text for row in rows for text in QUOTED.findall(row)}
    paths = {
        text for text in quoted if re.fullmatch(r"[\w.-]+(?:/[\w.-]+)*/?", text) and ("/" in text or FILE.search(text))
    }
    assert len(paths) > 120
    absent = {
        text
        for text in paths
        if not ((ROOT / text).exists() or (ROOT / "bench_service" / text).exists() or text in somewhere)
    }
    assert absent == set()


def test_every_name_that_is_said_to_be_in_a_file_is_in_it() -> None:
    pairs = [
        (name, file)
        for names, file in NAME_IN_FILE.findall(PAGE.read_text(encoding="utf-8"))
        for name in QUOTED.findall(names)
    ]
    assert len(pairs) > 15
    files = {file: next(p for p in (ROOT / file, ROOT / "bench_service" / file) if p.exists()) for _, file in pairs}
    texts = {file: path.read_text(encoding="utf-8") for file, path in files.items()}
    assert [(name, file) for name, file in pairs if name.split(".")[-1] not in texts[file]] == []
