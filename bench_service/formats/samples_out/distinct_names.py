"""Names of which no two are equal, for the columns of exported files."""

from collections.abc import Sequence


def distinct(names: Sequence[str], longest: int | None = None, taken: Sequence[str] = ()) -> list[str]:
    """Return names of which no two are equal: a later one that is taken already gets _2, _3, … at its end.

    `longest`: most letters of a name, longer ones are cut; `taken`: names that none may have.
    """
    found: list[str] = []
    used = set(taken)
    for name in names:
        made, number = name[:longest], 1
        while made in used:
            number += 1
            end = f"_{number}"
            made = name[: None if longest is None else longest - len(end)] + end
        used.add(made)
        found.append(made)
    return found
