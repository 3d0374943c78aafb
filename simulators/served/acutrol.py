"""Language of an ACUTROL controller over the table: long and short words, lists by semicolon, limits, interlocks."""

from collections.abc import Callable

from simulators.served.table import ControlledTable, Refused

OK = "OK"
IDENTITY = "Acutronic USA, ACT3000, 0000000001, 01.02.12 (Build 1962)"
PREFIX = bytes(range(8))
"""Eight bytes before each answer; their meaning is not known, so they are arbitrary here."""
ROOTS = ("utility", "interlock", "mode", "demand", "read", "limit")
SUBS = (
    *("lockout", "reset", "close", "open", "off", "position", "rate", "acceleration", "absolute", "delta"),
    *("oscillator", "synthesis"),
)
MODE_WORDS = {"off": "Off", "position": "Position", "rate": "Rate", "synthesis": "Synthesis"}
LARGEST_STEP_DEG = 180.0


class AcutrolLanguage:
    """Answers statements. Axes are numbered; `all` names all of them."""

    def __init__(self, table: ControlledTable, numbers: tuple[int, int, int], prefix_bytes: int, ending: bytes) -> None:
        """Set up; `numbers`: of outer, middle and inner axis."""
        self._table, self._numbers = table, numbers
        self._prefix, self._ending = PREFIX[:prefix_bytes].ljust(prefix_bytes, b"\0"), ending
        self.remote = True
        """False while a person operates the controller from its own panel."""
        self._verbs: dict[tuple[str, str], Callable[[list[str]], str]] = {
            ("utility", "lockout"): lambda _arguments: OK,
            ("mode", "off"): lambda a: self._mode(a, "off"),
            ("mode", "position"): lambda a: self._mode(a, "position"),
            ("mode", "rate"): lambda a: self._mode(a, "rate"),
            ("mode", "synthesis"): lambda a: self._mode(a, "synthesis"),
            ("demand", "oscillator"): self._oscillate,
            ("demand", "position"): lambda a: self._load(a, "position"),
            ("demand", "rate"): lambda a: self._load(a, "rate"),
            ("demand", "delta"): self._step,
            ("limit", "rate"): lambda a: self._limit(a, 0),
            ("limit", "acceleration"): lambda a: self._limit(a, 1),
            ("interlock", "reset"): self._reset,
            ("interlock", "close"): self._close,
            ("interlock", "open"): self._open,
        }
        self._queries: dict[tuple[str, str], Callable[[list[str]], str]] = {
            ("mode", ""): lambda a: MODE_WORDS[self._table.axes[self._axis(a[0])].mode],
            ("interlock", ""): lambda a: self._table.axes[self._axis(a[0])].interlock,
            ("read", "position"): lambda a: f"{self._table.encoders_deg()[self._axis(a[0])]:.6f}",
            ("read", "rate"): lambda a: f"{self._rate(self._axis(a[0])):.6f}",
            ("demand", "position"): lambda a: f"{self._table.axes[self._axis(a[0])].position_deg:.6f}",
            ("demand", "rate"): lambda a: f"{self._table.axes[self._axis(a[0])].rate_deg_s:.6f}",
            ("limit", "rate"): lambda a: self._limit_of(a, 0),
            ("limit", "acceleration"): lambda a: self._limit_of(a, 1),
            ("limit", "absolute"): self._absolute,
        }

    def answer(self, request: bytes) -> bytes:
        """Answer one line: queries are joined by semicolons, statements by one acknowledgement."""
        answers, root = list[str](), ""
        try:
            for part in request.decode("ascii").strip().split(";"):
                answer, root = self._statement(part.strip(), root)
                answers.append(answer)
        except (Refused, ValueError, IndexError, KeyError, UnicodeDecodeError) as error:
            words = str(error) if isinstance(error, Refused) else "command not recognised"
            return self._prefix + f"ERROR {words}".encode("ascii") + self._ending
        told = [a for a in answers if a != OK] or [OK]
        return self._prefix + ";".join(told).encode("ascii") + self._ending

    def _statement(self, text: str, root: str) -> tuple[str, str]:
        head, _, rest = text.partition(" ")
        arguments = [part.strip() for part in rest.split(",")] if rest.strip() else []
        query = head.endswith("?")
        words = head.rstrip("?").lower().split(":")
        if words[0].startswith("*"):
            return {"*idn": IDENTITY, "*stb": self._status()}[words[0]], root
        if words[0] == "":
            root, words = _full(words[1], ROOTS), words[2:]
        sub = _full(words[0], SUBS) if words else ""
        # The legacy dialect reads without a question mark, and sets a mode by its second argument.
        if query or root == "read":
            return self._queries[root, sub](arguments), root
        if root == "mode" and not sub:
            return self._mode(arguments[:1], _full(arguments[1].lower(), SUBS)), root
        return self._verbs[root, sub](arguments), root

    def _axis(self, number: str) -> int:
        return self._numbers.index(int(number))

    def _chosen(self, number: str) -> list[int]:
        return [0, 1, 2] if number.lower() == "all" else [self._axis(number)]

    def _status(self) -> str:
        return "65" if any(axis.interlock == "Fault" for axis in self._table.axes) else "0"

    def _rate(self, axis: int) -> float:
        return float(self._table.read_rates_deg_s()[axis])

    def _mode(self, arguments: list[str], mode: str) -> str:
        for axis in self._chosen(arguments[0]):
            self._table.set_mode(axis, mode)
        return OK

    def _load(self, arguments: list[str], kind: str) -> str:
        self._table.load(kind, self._axis(arguments[0]), float(arguments[1]))
        return OK

    def _oscillate(self, arguments: list[str]) -> str:
        amplitude, frequency, phase = map(float, arguments[1:4])
        self._table.load_oscillator(self._axis(arguments[0]), amplitude, frequency, phase)
        return OK

    def _step(self, arguments: list[str]) -> str:
        axis, step = self._axis(arguments[0]), float(arguments[1])
        if abs(step) > LARGEST_STEP_DEG:
            raise Refused("step too large")
        self._table.load("position", axis, self._table.axes[axis].position_deg + step)
        return OK

    def _limit(self, arguments: list[str], which: int) -> str:
        mode = _full(arguments[0].lower(), SUBS)
        self._table.set_limit(mode, self._axis(arguments[1]), which, float(arguments[2]))
        return OK

    def _limit_of(self, arguments: list[str], which: int) -> str:
        mode = _full(arguments[0].lower(), SUBS)
        return f"{self._table.limits[mode, self._axis(arguments[1])][which]:.6f}"

    def _absolute(self, arguments: list[str]) -> str:
        limits = self._table.factory[self._axis(arguments[0])]
        numbers = (limits.rate_deg_s, limits.acceleration_deg_s2, 1e4, limits.minimum_deg, limits.maximum_deg)
        return ",".join(f"{number:.3f}" for number in (*numbers, 1.2 * limits.rate_deg_s))

    def _reset(self, _arguments: list[str]) -> str:
        self._table.reset_interlocks()
        return OK

    def _close(self, arguments: list[str]) -> str:
        for axis in self._chosen(arguments[0]):
            self._table.close_interlock(axis)
        return OK

    def _open(self, arguments: list[str]) -> str:
        for axis in self._chosen(arguments[0]):
            self._table.open_interlock(axis)
        return OK


def _full(word: str, words: tuple[str, ...]) -> str:
    """Return the full form of an abbreviated word. Raises `ValueError`."""
    for full in words:
        if word and full.startswith(word):
            return full
    raise ValueError(word)
