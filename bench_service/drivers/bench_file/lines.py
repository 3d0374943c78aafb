"""Line of a key in TOML text: the parser that reads it gives values without their places."""

import re
from collections.abc import Sequence

HEADER = re.compile(r"^\s*\[\[?\s*([^\]]+?)\s*\]\]?\s*(#.*)?$")
KEY = re.compile(r"""^\s*((?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*'))*)\s*=""")


def line_of(text: str, path: Sequence[object]) -> int | None:
    """Return the number of the line of the deepest part of a key's path that stands in the text, from 1; None: no part
    does.

    Parts that are numbers count the tables of an array, ``[[channels]]``, and are left out of names.
    """
    names = [str(part) for part in path if not isinstance(part, int)]
    numbers = [part for part in path if isinstance(part, int)]
    best: tuple[int, int] | None = None
    seen: dict[tuple[str, ...], int] = {}
    table: tuple[str, ...] = ()
    skipped = False
    for number, line in enumerate(text.splitlines(), start=1):
        if header := HEADER.match(line):
            table = _parts(header.group(1))
            if line.lstrip().startswith("[["):
                seen[table] = seen.get(table, -1) + 1
            skipped = bool(numbers) and table in seen and seen[table] != numbers[0]
            here = table
        elif key := KEY.match(line):
            here = (*table, *_parts(key.group(1)))
        else:
            continue
        depth = len(here)
        if not skipped and tuple(names[:depth]) == here and (best is None or depth > best[0]):
            best = (depth, number)
    return None if best is None else best[1]


def _parts(name: str) -> tuple[str, ...]:
    return tuple(part.strip().strip("\"'") for part in re.findall(r"""[A-Za-z0-9_-]+|"[^"]*"|'[^']*'""", name))
