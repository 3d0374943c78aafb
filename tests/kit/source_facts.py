"""A source file as tests of the house rules read it, parsed once: definitions, docstrings and texts."""

import ast
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
_DEFINED = ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Definition:
    """A class, a function or the file itself, whose name is empty."""

    name: str
    docstring: str
    lines: int
    """Lines of a function's body, without its docstring; 0 of all others."""


@dataclass(frozen=True)
class SourceFacts:
    """One file, in the order of `ast.walk`: the file itself is its first definition."""

    definitions: tuple[Definition, ...]
    docstrings: tuple[tuple[str, str], ...]
    """Place and text of each docstring, also those of fields, in one line each."""
    texts: tuple[str, ...]
    """String constants; an f-string is one text, with "…" for what is put in."""


@cache
def facts(path: Path) -> SourceFacts:
    """Parse a file of the project; half a dozen tests read each of seven hundred."""
    definitions: list[Definition] = []
    docstrings: list[tuple[str, str]] = []
    texts: list[str] = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, _DEFINED):
            definitions.append(_definition(node))
        body = getattr(node, "body", None)
        docstrings += [
            (f"{path.relative_to(ROOT)}:{part.lineno}", " ".join(part.value.value.split()))
            for part in (body if isinstance(body, list) else [])
            if isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant) and isinstance(part.value.value, str)
        ]
        if isinstance(node, ast.JoinedStr):
            parts = (value.value if isinstance(value, ast.Constant) else "…" for value in node.values)
            texts.append("".join(str(part) for part in parts))
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            texts.append(node.value)
    return SourceFacts(tuple(definitions), tuple(docstrings), tuple(texts))


def _definition(node: ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) -> Definition:
    docstring, lines = ast.get_docstring(node) or "", 0
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        first = node.body[1] if docstring and len(node.body) > 1 else node.body[0]
        lines = (node.end_lineno or 0) - first.lineno + 1
    return Definition(getattr(node, "name", ""), docstring, lines)
