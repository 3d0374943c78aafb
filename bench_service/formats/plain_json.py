"""JSON that UTF-8 and every database can hold and give back as it was: the one rule, and what breaks it.

`json.loads` takes more than that: NaN and 1e999, half of a surrogate pair (`"\\ud800"`), NUL, a thousand brackets.
"""

import json
import re
from collections.abc import Iterator
from sys import float_info
from typing import Any, NamedTuple

DEPTH = 50
"""Largest depth of nested lists and objects."""
A_TEXT = "text without the character NUL and without half of a surrogate pair is expected"
A_NUMBER = f"a finite number is expected, -{float_info.max:.2g} … {float_info.max:.2g}"
NOT_SO_DEEP = f"at most {DEPTH} lists and objects may lie in each other"

_NESTING, _NUMBERS = (list, dict), (int, float)
"""Tuples of types for `isinstance`: a union would be built again at each of a million calls."""
_UNFIT = re.compile("[\x00\ud800-\udfff]")
_ESCAPED = re.compile(r"\\u(0000|[dD][89a-fA-F])")


class Fault(NamedTuple):
    """One place of a document that breaks the rule."""

    path: tuple[str | int, ...]
    value: object
    """The faulty value; only the kind of a list or an object that is nested too deeply."""
    allowed: str


def fits(text: str) -> bool:
    """Return whether every store and client can hold a text."""
    return _UNFIT.search(text) is None


def is_finite(number: float) -> bool:
    """Return whether a double can hold a number: not NaN, no infinity, no integer of 400 digits."""
    return -float_info.max <= number <= float_info.max


def shown(text: str) -> str:
    """Return a text with the characters escaped that some store or client cannot hold."""
    return _UNFIT.sub(lambda found: f"\\u{ord(found.group()):04x}", text)


def faults(document: Any) -> Iterator[Fault]:
    """Yield the values that break the rule in a document that `json.loads` made, in its order."""
    if isinstance(document, _NESTING):
        yield from _faults_within(document, ())
    elif (allowed := _instead_of(document)) is not None:
        yield Fault((), document, allowed)


def _faults_within(node: list[Any] | dict[str, Any], path: tuple[str | int, ...]) -> Iterator[Fault]:
    for key, child in enumerate(node) if isinstance(node, list) else node.items():
        if isinstance(key, str) and not fits(key):
            yield Fault((*path, key), key, A_TEXT)
        if isinstance(child, _NESTING):
            if len(path) + 2 > DEPTH:
                yield Fault((*path, key), "[…]" if isinstance(child, list) else "{…}", NOT_SO_DEEP)
            else:
                yield from _faults_within(child, (*path, key))
        elif (allowed := _instead_of(child)) is not None:  # no generator for each number: there may be a megabyte
            yield Fault((*path, key), child, allowed)


def _instead_of(scalar: Any) -> str | None:
    """Describe the allowed values in place of one that breaks the rule; None where it does not."""
    if isinstance(scalar, str):
        return None if fits(scalar) else A_TEXT
    return A_NUMBER if isinstance(scalar, _NUMBERS) and not is_finite(scalar) else None


def read_back(stored: str | bytes) -> Any:
    """Return a stored document, parsed. Values that an older version let in against the rule are given as their
    escapes.
    """
    text = stored if isinstance(stored, str) else stored.decode()
    found = json.loads(text)
    return mended(found) if _ESCAPED.search(text) else found


def mended(node: Any, room: int = 2 * DEPTH) -> Any:
    """Return a document with its texts escaped, and branches cut that are nested too deeply for any answer.

    `room`: levels; more than the rule's, as the service nests the documents that clients sent in its own.
    """
    if isinstance(node, str):
        return shown(node)
    if isinstance(node, _NESTING) and room == 0:
        return "…"
    if isinstance(node, list):
        return [mended(child, room - 1) for child in node]
    if isinstance(node, dict):
        return {shown(key): mended(child, room - 1) for key, child in node.items()}
    return node
