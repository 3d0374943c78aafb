"""Descriptions of the fields that the models leave without one: from docstrings of attributes, else from a table.

A field of a schema is explained, in this order, by its own description, by the docstring below the attribute of its
class, and by `field_words.toml`. The unit follows from the end of the name, as everywhere in this product.
"""

import ast
import sys
import tomllib
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any

from bench_service.api.openapi.schemas import Schema, camel

PACKAGES = ("bench_service", "procedures")
UNITS = {
    "_m_s2_c": "m/s²/°C",
    "_rad_s_c": "rad/s/°C",
    "_c_s2": "°C/s²",
    "_deg_s2": "deg/s²",
    "_code_per_ma": "code/mA",
    "_deg_h": "deg/h",
    "_deg_s": "deg/s",
    "_rad_s": "rad/s",
    "_m_s2": "m/s²",
    "_m_s": "m/s",
    "_c_min": "°C/min",
    "_arcsec": "arcsec",
    "_percent": "%",
    "_bytes": "bytes",
    "_hpa": "hPa",
    "_ppm": "ppm",
    "_deg": "deg",
    "_hz": "Hz",
    "_ma": "mA",
    "_s": "s",
    "_h": "h",
    "_c": "°C",
    "_v": "V",
    "_a": "A",
    "_m": "m",
}
"""Unit by the end of a field's name; the first that fits counts, so longer ends stand before their parts."""
_NOT_UNITS = ("_c", "_a", "_v", "_m", "_h")
"""Ends that are units only of numbers: a text may end so by chance."""


def describe(schemas: dict[str, Schema], documents: Mapping[str, type]) -> None:
    """Give every property of every schema a description, in place. One that nothing explains keeps none.

    `documents`: the classes of result documents by the names of their schemas, which differ from the classes' own.
    """
    classes = _classes(frozenset(name.removesuffix("Input") for name in schemas))
    for name, schema in schemas.items():
        fields = schema.get("properties", {})
        named = (documents[name],) if name in documents else classes.get(name.removesuffix("Input"), ())
        own = _of_class(named, fields)
        for field, inside in fields.items():
            text = inside.get("description") or own.get(field) or word(name, field)
            if text.startswith("["):  # a docstring that has the unit alone
                text = f"{word(name, field)} {text.rstrip('.')}".strip()
            if text:
                fields[field] = {**inside, "description": with_unit(field, text, inside)}


def word(schema: str, field: str) -> str:
    """Return the meaning of a field by the table `field_words.toml`: of this schema, of a pattern of schemas, or of the
    name; else empty.
    """
    table = _table()
    exact = table.get(f"{schema}.{field}")
    if exact is not None:
        return exact
    fitting = (text for key, text in table.items() if "*" in key and fnmatchcase(f"{schema}.{field}", key))
    return next(fitting, table.get(field, ""))


def with_unit(field: str, text: str, schema: Mapping[str, Any]) -> str:
    """Return a description with the unit that the field's name ends in, unless it has one in brackets."""
    end = next((end for end in UNITS if field.endswith(end)), None)
    if end is None or "[" in text or (end in _NOT_UNITS and not _has_numbers(schema)):
        return text
    return f"{text.rstrip('.')} [{UNITS[end]}]"


def _has_numbers(schema: Any) -> bool:
    if isinstance(schema, Mapping):
        return schema.get("type") in ("number", "integer") or any(map(_has_numbers, schema.values()))
    return isinstance(schema, list) and any(map(_has_numbers, schema))


@cache
def _table() -> dict[str, str]:
    with (Path(__file__).with_suffix(".toml")).open("rb") as file:
        return tomllib.load(file)


def _of_class(classes: tuple[type, ...], fields: Mapping[str, Any]) -> dict[str, str]:
    """Docstrings of the attributes of the class that has all fields of a schema and the fewest others."""
    every = [
        {
            name: text
            for base in reversed(one.__mro__)
            if _is_ours(base)
            for name, text in _documented(base.__module__).get(base.__name__, {}).items()
        }
        for one in classes
    ]
    fitting = sorted((found for found in every if found.keys() >= set(fields)), key=len)
    return fitting[0] if fitting else {}


def _is_ours(one: type) -> bool:
    return one.__module__.split(".")[0] in PACKAGES


def _classes(wanted: frozenset[str]) -> dict[str, tuple[type, ...]]:
    """Loaded classes by the name of their schema: the class's own, or that with two parts of its module in front."""
    found: dict[str, tuple[type, ...]] = {}
    for module in sorted(name for name in sys.modules if name.split(".")[0] in PACKAGES):
        prefix = "".join(map(camel, module.split(".")[-2:]))
        for one in vars(sys.modules[module]).values():
            if isinstance(one, type) and one.__module__ == module:
                for name in wanted & {one.__name__, prefix + one.__name__}:
                    found[name] = (*found.get(name, ()), one)
    return found


@cache
def _documented(module: str) -> dict[str, dict[str, str]]:
    """Own attributes of each class of a module with their docstrings; the parsed source itself is not kept."""
    file = sys.modules[module].__file__
    body = ast.parse(Path(file).read_text(encoding="utf-8")).body if file is not None else []
    return {node.name: _attributes(node.body) for node in body if isinstance(node, ast.ClassDef)}


def _attributes(body: Sequence[ast.stmt]) -> dict[str, str]:
    """Names of the annotated attributes in a class's body, each with the docstring below it, or empty."""
    found: dict[str, str] = {}
    for statement, after in zip(body, [*body[1:], None], strict=True):
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            text = after.value.value if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant) else ""
            found[statement.target.id] = " ".join(text.split()) if isinstance(text, str) else ""
    return found
