"""Tables of a TOML file: keys with units and ranges, refusals with field, value and range; and back to text."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from json import dumps
from math import isinf
from typing import Any, TypeVar, cast

from simulators.truth.ranges import TruthError, within

Table = Mapping[str, Any]
T = TypeVar("T")


@dataclass(frozen=True)
class Key:
    """One key of a table: the attribute it fills, the size of its unit in SI, its range, its shape."""

    attribute: str
    size: float
    low: float
    high: float
    shape: str = "vector"


def check_keys(where: str, table: Table, known: set[str], needed: set[str]) -> None:
    """Check the keys of a table: no unknown key, and every required one. Raises `TruthError`."""
    for key in table:
        if key not in known:
            raise TruthError(f"{where}.{key} = {table[key]!r} is not known; known are {', '.join(sorted(known))}")
    for key in sorted(needed - set(table)):
        raise TruthError(f"{where}.{key} is missing")


def read_value(where: str, value: Any, key: Key) -> Any:
    """Read the value of a key in SI, each number inside the key's range. Raises `TruthError`."""
    if key.shape == "flag":
        if not isinstance(value, bool):
            raise TruthError(f"{where} = {value!r} must be true or false")
        return value
    if key.shape == "number":
        return within(where, value, key.low, key.high) * key.size
    length = 2 if key.shape == "pair" else 3
    if not isinstance(value, list) or len(value) != length:
        raise TruthError(f"{where} = {value!r} must be a list of {length}")
    if key.shape == "matrix":
        row = Key(key.attribute, key.size, key.low, key.high)
        return tuple(read_value(f"{where}[{i}]", item, row) for i, item in enumerate(value))
    return tuple(within(f"{where}[{i}]", item, key.low, key.high) * key.size for i, item in enumerate(value))


def read_record(kind: type[Any], where: str, table: Any, needed: set[str]) -> Any:
    """Read a flat record of numbers and flags from a table of the same names. Raises `TruthError`."""
    numbers = _numbers(where, table, kind, needed)
    try:
        return kind(**numbers)
    except ValueError as refusal:
        raise TruthError(str(refusal)) from refusal


def read_changes(default: T, where: str, table: Any, keys: Mapping[str, Key] | None = None) -> T:
    """Return a copy of a record with the values that a table gives. `keys` by name; None: numbers by the record's own
    names. Raises `TruthError`.
    """
    if keys is None:
        changes = _numbers(where, table, cast(Any, default), set())
    else:
        check_keys(where, _table(where, table), set(keys), set())
        changes = {keys[k].attribute: read_value(f"{where}.{k}", v, keys[k]) for k, v in table.items()}
    try:
        return cast(T, replace(cast(Any, default), **changes))
    except ValueError as refusal:
        raise TruthError(f"{where}: {refusal}") from refusal


def _numbers(where: str, table: Any, record: Any, needed: set[str]) -> dict[str, float | bool]:
    types = {f.name: f.type for f in fields(record)}
    check_keys(where, _table(where, table), set(types), needed)
    return {k: _flag_or_number(f"{where}.{k}", v, types[k] in (bool, "bool")) for k, v in table.items()}


def _flag_or_number(where: str, value: Any, is_flag: bool) -> float | bool:
    if not is_flag:
        return within(where, value, -1e6, 1e6)
    if not isinstance(value, bool):
        raise TruthError(f"{where} = {value!r} must be true or false")
    return value


def _table(where: str, table: Any) -> Table:
    if not isinstance(table, dict):
        raise TruthError(f"{where} = {table!r} must be a table")
    return cast(Table, table)


def read_document(text: str) -> dict[str, Any]:
    """Parse the tables of a TOML text. Raises `TruthError`."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as refusal:
        raise TruthError(f"not a TOML file: {refusal}") from refusal


def record_lines(name: str, record: Any) -> list[str]:
    """Write a flat record as a table; infinite values, "never", are left out."""
    values = {f.name: getattr(record, f.name) for f in fields(record)}
    return ["", f"[{name}]", *(f"{k} = {_number_text(v)}" for k, v in values.items() if not isinf(v))]


def keyed_lines(name: str, record: Any, keys: Mapping[str, Key]) -> list[str]:
    """Write a record as a table of its keys, in their units."""
    return ["", f"[{name}]", *(f"{k} = {_value_text(getattr(record, v.attribute), v.size)}" for k, v in keys.items())]


def _number_text(value: float | bool) -> str:
    return str(value).lower() if isinstance(value, bool) else repr(float(value))


def _value_text(value: Any, size: float) -> str:
    if isinstance(value, bool):
        return dumps(value)
    if isinstance(value, tuple):
        return "[" + ", ".join(_value_text(item, size) for item in cast(tuple[Any, ...], value)) + "]"
    return repr(float(value) / size)
