"""Makes a value from others: fields of the same name are copied, the others are given by name.

Serves dataclasses, pydantic models and mapped tables alike, so a field that two shapes share is written in no mapper.
Must not know any of these shapes.
"""

from dataclasses import MISSING, Field, fields
from functools import cache
from typing import Any, TypeVar

T = TypeVar("T")


def copied(shape: type[T], *sources: object, **given: Any) -> T:
    """A value of `shape`: the fields that are `given`, and each other one from the first source that has it.

    A property of a source counts as its field. A field that no source has keeps its default; a column of a table has
    none here. Raises `TypeError` naming a field that is left without a value, or a given name that is no field.
    """
    required = _fields(shape)
    unknown = given.keys() - required.keys()
    if unknown:
        raise TypeError(f"{shape.__name__} has no field {', '.join(sorted(unknown))}")
    values = given
    for name, needed in required.items():
        if name in values:
            continue
        for source in sources:
            value = getattr(source, name, MISSING)
            if value is not MISSING:
                values[name] = value
                break
        else:
            if needed:
                has = " or ".join(type(source).__name__ for source in sources) or "nothing"
                raise TypeError(f"{shape.__name__} needs {name}: {has} has no such field, and it is not given")
    return shape(**values)


def field_names(shape: type) -> tuple[str, ...]:
    """Return the names of a shape's fields in their order: of a dataclass, a pydantic model or a mapped table."""
    return tuple(_fields(shape))


@cache
def _fields(shape: Any) -> dict[str, bool]:
    """Map each field to True where it must have a value."""
    if hasattr(shape, "model_fields"):
        return {name: field.is_required() for name, field in shape.model_fields.items()}
    if hasattr(shape, "__mapper__"):
        return dict.fromkeys(shape.__mapper__.column_attrs.keys(), True)
    return {field.name: _required(field) for field in fields(shape) if field.init}


def _required(field: "Field[Any]") -> bool:
    return field.default is MISSING and field.default_factory is MISSING
