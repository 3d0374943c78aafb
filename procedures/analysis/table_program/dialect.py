"""Reads a position program in the language of the table's controller (thesis, appendix Д).

The thesis shows one program and no grammar; this is the least grammar that has it. A line is empty or one of::

    % a comment; it may also follow a statement
    :mode:position all
    :demand:position axis,degrees; p axis,degrees; p axis,degrees
    delay seconds

By default axis 1 is the inner one, 2 the middle, 3 the outer; a controller that numbers them otherwise is a setting.
The thesis does not name them; the other way round its program would be no calibration: the accelerometers' design would
have rank 3 of 4.

Letters may be large or small, blanks stand where they like between words. A demand sets the axes that it names, and the
others stay; a delay is a dwell at what was demanded. Nothing else is understood, and nothing is skipped: a line outside
the dialect is refused with its number and what was expected.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

from procedures.core.errors import BadParameter
from procedures.core.table_angles import TableAngles

MODE, DEMAND, DELAY = ":mode:position", ":demand:position", "delay"
AXES = ("inner", "middle", "outer")
"""Axes 1, 2 and 3 of a program, unless it is said otherwise."""
NUMBERS = ("1", "2", "3")
DEGREES_MAX = 3600.0
"""Greatest angle of a program, ten turns [deg]; the bench checks the range of its axes. This program's own limit."""
DELAY_MAX_S = 86_400.0
"""Greatest delay of a program, one day [s]. This program's own limit."""
DWELLS_MAX = 500
"""Greatest number of dwells in a program. This program's own limit."""
SHOWN = 80
"""Characters of a line that a refusal repeats."""

_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)")
_STATEMENT = f"a comment (%), '{MODE} all', '{DEMAND} axis,degrees; p axis,degrees' or '{DELAY} seconds'"


@dataclass(frozen=True)
class Dwell:
    """A rest of the table: where, how long from the demand on, and the line of the program that asks for it."""

    angles: TableAngles
    delay_s: float
    line: int = 0


@dataclass
class _Reader:
    """Demands accumulated from the lines read so far."""

    axes: Sequence[str]
    """Names of the axes 1, 2 and 3."""
    at: dict[str, float] = field(default_factory=dict[str, float])
    """Axis -> degrees, of axes that have a position."""
    pending: dict[str, int] = field(default_factory=dict[str, int])
    """Axis -> line of a demand that no delay has followed yet."""
    dwells: list[Dwell] = field(default_factory=list[Dwell])

    def statement(self, line: int, code: str) -> None:
        word, _, rest = " ".join(code.split()).partition(" ")
        known = {MODE: self._mode, DEMAND: self._demand, DELAY: self._delay}
        if word.casefold() not in known:
            raise refusal(line, code, _STATEMENT)
        known[word.casefold()](line, code, rest)

    def _mode(self, line: int, code: str, rest: str) -> None:
        if rest.casefold() != "all":
            raise refusal(line, code, f"'all' after '{MODE}': the three axes are positioned together")

    def _demand(self, line: int, code: str, rest: str) -> None:
        for i, part in enumerate(rest.split(";")):
            named = part.strip()
            if i > 0:
                word, _, named = named.partition(" ")
                if word.casefold() != "p":
                    raise refusal(line, code, f"'p axis,degrees' after ';', not {part.strip()!r}")
            axis, comma, degrees = (piece.strip() for piece in named.partition(","))
            if axis not in NUMBERS:
                names = [f"{number} ({name})" for number, name in zip(NUMBERS, self.axes, strict=True)]
                raise refusal(line, code, f"an axis, {names[0]}, {names[1]} or {names[2]}, not {axis!r}")
            if not comma:
                raise refusal(line, code, f"a comma and degrees after axis {axis}")
            if axis in self.pending:
                before = "in this line" if self.pending[axis] == line else f"in line {self.pending[axis]}"
                raise refusal(line, code, f"'{DELAY} seconds' first: axis {axis} was demanded {before} already")
            what = f"degrees of axis {axis}, within ±{DEGREES_MAX:g},"
            self.at[axis] = _number(line, code, degrees, what, -DEGREES_MAX, DEGREES_MAX)
            self.pending[axis] = line

    def _delay(self, line: int, code: str, rest: str) -> None:
        delay_s = _number(line, code, rest, f"seconds, above 0 and at most {DELAY_MAX_S:g},", 0.0, DELAY_MAX_S)
        if delay_s == 0.0:
            raise refusal(line, code, f"seconds, above 0 and at most {DELAY_MAX_S:g}")
        missing = [axis for axis in NUMBERS if axis not in self.at]
        if missing:
            raise refusal(line, code, f"'{DEMAND}' of axis {', '.join(missing)} first: its angle is not known")
        if len(self.dwells) == DWELLS_MAX:
            raise refusal(line, code, f"no more: {DWELLS_MAX} delays are the most")
        self.dwells.append(Dwell(self._angles(), delay_s, line))
        self.pending.clear()

    def _angles(self) -> TableAngles:
        degrees = {name: self.at[axis] for axis, name in zip(NUMBERS, self.axes, strict=True)}
        return TableAngles(degrees["outer"], degrees["middle"], degrees["inner"])


def read_program(text: str, axes: Sequence[str] = AXES) -> tuple[Dwell, ...]:
    """The dwells of a program in order, one a delay; `axes` names its axes 1, 2 and 3.

    Raises `BadParameter` "program" with the line that is not understood as its value, the line's number and what was
    expected there; also where a demand has no delay, an axis no position, or the program no dwell.
    """
    reader, lines = _Reader(axes), text.split("\n")
    for number, whole in enumerate(lines, start=1):
        if any(not c.isprintable() and c not in "\t\r" for c in whole):
            raise refusal(number, whole.strip(), "printable text")
        code = whole.partition("%")[0].strip()
        if code:
            reader.statement(number, code)
    if reader.pending:
        last = max(reader.pending.values())
        raise refusal(last, lines[last - 1].strip(), f"'{DELAY} seconds' after this demand: nothing rests at it")
    if not reader.dwells:
        raise refusal(len(lines), lines[-1].strip(), f"'{DELAY} seconds': the program has no dwell")
    return tuple(reader.dwells)


def refusal(line: int, code: str, expected: str) -> BadParameter:
    """Return the error to raise for a line that cannot be read: its text, its number, and the expected form."""
    shown = code if len(code) <= SHOWN else code[:SHOWN] + "…"
    return BadParameter("program", shown, f"line {line}: expected {expected}")


def _number(line: int, code: str, text: str, what: str, low: float, high: float) -> float:
    if not _NUMBER.fullmatch(text) or not low <= float(text) <= high:
        raise refusal(line, code, f"{what} not {text[:SHOWN]!r}")
    return float(text) + 0.0  # "-0" is no position of its own
