"""The chamber as its controller has it, and its two languages on one port, SIMSERV and ASCII-2."""

from collections.abc import Callable
from math import isfinite

from procedures.bench.chamber import ChamberReading
from procedures.bench.errors import BenchError
from simulators.chamber.device import SimChamber
from simulators.served.at_once import at_once

PILCROW = b"\xb6"
TYPE, SERIAL, SOFTWARE = "Simulated chamber", "0000000001", "1.0"
DOOR = "Door open"
OUTPUTS = ("Condensation protection", "Spare 2", "Spare 3", "Compressed air", "Dryer", "Spare 6")
"""Names of the digital outputs after the start switch, from 1; the switch of each has the index after it."""


class Controller:
    """Set point, gradients and start switch over the simulated chamber."""

    def __init__(self, chamber: SimChamber) -> None:
        self._chamber = chamber
        self.set_point_c = chamber.limits.ambient_c
        self.gradients = [chamber.limits.ramp_c_min, chamber.limits.ramp_c_min]
        """Up and down [K/min]."""

    @property
    def limits_c(self) -> tuple[float, float]:
        """Input limits of the set point."""
        return self._chamber.limits.minimum_c, self._chamber.limits.maximum_c

    def reading(self) -> ChamberReading:
        """Present state of the chamber."""
        return at_once(self._chamber.read())

    @property
    def running(self) -> bool:
        """True while heater and cooler are on."""
        return self.reading().target_c is not None

    def set(self, temperature_c: float) -> bool:
        """Set the set point. Returns False where it is beyond the limits, or is refused."""
        low, high = self.limits_c
        if not (isfinite(temperature_c) and low <= temperature_c <= high):
            return False
        self.set_point_c = temperature_c
        return not self.running or self._lead()

    def set_gradient(self, which: int, k_min: float) -> bool:
        """Set the gradient up (0) or down (1). Returns False where it is beyond the limits, or is refused."""
        if not 0.0 < k_min <= self._chamber.limits.ramp_c_min:
            return False
        self.gradients[which] = k_min
        return not self.running or self._lead()

    def run(self, on: bool) -> bool:
        """Start or stop the plant. Returns False where that is refused, as after a trip or with an open door."""
        if on:
            return self.running or self._lead()
        self._chamber.plant.switch_off()
        return True

    def _lead(self) -> bool:
        up = self.set_point_c >= self.reading().air_c
        try:
            at_once(self._chamber.command(self.set_point_c, self.gradients[0 if up else 1]))
        except BenchError:
            return False
        return True


class SimservLanguage:
    """Numbered commands, one reply each; arguments that are not needed are ignored."""

    def __init__(self, controller: Controller, kind: str) -> None:
        """Set up; `kind`: type that the chamber reports."""
        self._c, self._type = controller, kind
        self._outputs = [False] * len(OUTPUTS)
        first = self._first
        self._verbs: dict[int, Callable[[list[str]], tuple[str, ...] | int]] = {
            99997: self._information,
            10012: lambda _a: (str(self._status()),),
            11001: lambda a: self._done(self._c.set(float(a[1]))) if first(a) else -6,
            11002: lambda a: (f"{self._c.set_point_c:.2f}",) if first(a) else -6,
            11004: lambda a: (f"{self._c.reading().air_c:.3f}",) if first(a) else -6,
            11007: lambda a: (f"{self._c.limits_c[0]:.1f}",) if first(a) else -6,
            11009: lambda a: (f"{self._c.limits_c[1]:.1f}",) if first(a) else -6,
            11018: lambda _a: ("1",),
            11026: lambda _a: ("Temperature",),
            11066: lambda _a: (f"{self._c.gradients[0]:.2f}",),
            11068: lambda a: self._done(self._c.set_gradient(0, float(a[1]))) if first(a) else -6,
            11070: lambda _a: (f"{self._c.gradients[1]:.2f}",),
            11072: lambda a: self._done(self._c.set_gradient(1, float(a[1]))) if first(a) else -6,
            14001: self._switch,
            14003: lambda a: (str(int(self._c.running if a[0] == "1" else self._outputs[int(a[0]) - 2])),),
            14007: lambda _a: (str(len(OUTPUTS)),),
            14010: lambda a: (OUTPUTS[int(a[0]) - 1],),
            15002: lambda _a: (str(int(self._c.reading().door_open)),),
            15004: lambda _a: ("1",),
            15005: lambda _a: (DOOR,),
            17002: lambda _a: (str(int(self._c.reading().tripped)),),
            17007: lambda _a: ("Over-temperature limiter tripped",),
        }

    def answer(self, request: bytes) -> bytes:
        """Answer a request, its ending left out."""
        command, *fields = request.strip(b"\r\n ").split(PILCROW)
        verb = self._verbs.get(int(command)) if command.isdigit() and len(command) == 5 else None
        if verb is None:
            return b"-5\r\n"
        try:
            told = verb([part.decode("latin-1").strip() for part in fields[1:]])
        except (ValueError, IndexError):
            told = -6
        if isinstance(told, int):
            return b"%d\r\n" % told
        return PILCROW.join([b"1", *(text.encode("latin-1") for text in told)]) + b"\r\n"

    def _first(self, arguments: list[str]) -> bool:
        return arguments[0] == "1"

    def _done(self, accepted: bool) -> int:
        return 1 if accepted else -6

    def _status(self) -> int:
        reading = self._c.reading()
        return (3 if reading.target_c is not None else 1) + (8 if reading.tripped else 0)

    def _information(self, arguments: list[str]) -> tuple[str, ...]:
        known = {"1": self._type, "2": "2026", "3": SERIAL, "4": "0", "8": SOFTWARE}
        return (known.get(arguments[0] if arguments else "1", "0"),)

    def _switch(self, arguments: list[str]) -> int:
        on = float(arguments[1]) != 0.0
        if arguments[0] == "1":
            return self._done(self._c.run(on))
        self._outputs[int(arguments[0]) - 2] = on
        return 1


class Ascii2Language:
    """One line for all fields: seven analogue channels of which the first is the temperature, 32 switches."""

    CHANNELS, SWITCHES, START, DOOR_BIT, ALARM_BIT = 7, 32, 1, 30, 31

    def __init__(self, controller: Controller, address: int = 1) -> None:
        self._c, self._address = controller, address
        self._spare = [0.0] * self.CHANNELS
        self._switches = "0" * self.SWITCHES

    def answer(self, request: bytes) -> bytes:
        """Answer a request, its ending left out."""
        text = request.decode("latin-1").strip()
        if not text.startswith(f"${self._address:02d}") or len(text) < 4:
            return b""
        letter, fields = text[3], text[4:].split()
        if letter == "I":
            return self._state()
        if letter == "E":
            return self._write(fields)
        if letter == "U":
            done = all(self._c.set_gradient(k, float(fields[k])) for k in (0, 1))
            return b"0\r" if done else b"-1\r"
        return b"0\r" if letter in "FQ" else b""

    def _state(self) -> bytes:
        reading = self._c.reading()
        points, actual = [self._c.set_point_c, *self._spare[1:]], [reading.air_c, *self._spare[1:]]
        pairs = [f"{point:06.1f} {value:06.1f}" for point, value in zip(points, actual, strict=True)]
        bits = list(self._switches)
        bits[self.START] = str(int(reading.target_c is not None))
        bits[self.DOOR_BIT], bits[self.ALARM_BIT] = str(int(reading.door_open)), str(int(reading.tripped))
        return f"{' '.join(pairs)} {''.join(bits)}\r".encode("ascii")

    def _write(self, fields: list[str]) -> bytes:
        if len(fields) != self.CHANNELS + 1 or len(fields[-1]) != self.SWITCHES:
            return b"-1\r"
        values = [float(field) for field in fields[:-1]]
        accepted = self._c.set(values[0])
        self._spare, self._switches = values, fields[-1]
        return b"0\r" if accepted and self._c.run(fields[-1][self.START] == "1") else b"-1\r"


class ChamberTalker:
    """Both languages on one port: a dollar sign begins ASCII-2, a digit SIMSERV; anything else is no request."""

    def __init__(self, controller: Controller, kind: str = TYPE) -> None:
        """Set up; `kind`: type that the chamber reports."""
        self._simserv, self._ascii2 = SimservLanguage(controller, kind), Ascii2Language(controller)

    def take(self, buffer: bytearray) -> bytes | None:
        """Take one whole request out of the buffer; None: there is none yet. See `Talker`."""
        while (at := buffer.find(b"\r")) >= 0:
            request = bytes(buffer[:at]).strip(b"\n ")
            del buffer[: at + 1]
            if request:
                return request
        return None

    def answer(self, request: bytes) -> bytes:
        """Answer a request, see `Talker`."""
        try:
            return self._ascii2.answer(request) if request.startswith(b"$") else self._simserv.answer(request)
        except ValueError:
            return b"-6\r\n"
