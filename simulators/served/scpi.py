"""Language of a SCPI supply over the simulated one: settings, output, measurements, an error queue."""

from collections import deque
from math import isfinite

from procedures.bench.errors import DeviceFault, OutOfRange
from simulators.served.at_once import at_once
from simulators.supply.device import SimSupply

IDENTITY = "BENCH SIMULATORS,PSU-1,0000000001,1.0"
MOST_ERRORS = 16
ERRORS = {
    -113: "Undefined header",
    -109: "Missing parameter",
    -104: "Data type error",
    -222: "Data out of range",
    -221: "Settings conflict",
    -350: "Queue overflow",
}
LONG = {
    "SYSTEM": "SYST",
    "ERROR": "ERR",
    "VOLTAGE": "VOLT",
    "CURRENT": "CURR",
    "OUTPUT": "OUTP",
    "MEASURE": "MEAS",
    "PROTECTION": "PROT",
    "TRIPPED": "TRIP",
    "STATE": "STAT",
    "LEVEL": "LEV",
    "SOURCE": "SOUR",
}
"""Long form of a word -> its short one."""
OPTIONAL = ("SOUR", "LEV", "IMM", "AMPL", "STAT", "DC")
"""Words of a header that may be left out."""


class ScpiLanguage:
    """Answers statements; a statement that is wrong leaves an error and no answer."""

    def __init__(self, supply: SimSupply) -> None:
        self._supply = supply
        self._errors: deque[int] = deque()

    def answer(self, request: bytes) -> bytes:
        """Answer one line; its statements are parted by semicolons."""
        answers = [told for part in request.decode("latin-1").split(";") if (told := self._statement(part.strip()))]
        return (";".join(answers) + "\n").encode("ascii") if answers else b""

    def _statement(self, text: str) -> str:
        if not text:
            return ""
        head, _, argument = text.partition(" ")
        query = head.endswith("?")
        words = [LONG.get(w, w) for w in head.rstrip("?").upper().removeprefix(":").split(":")]
        key = ":".join(w for w in words if w not in OPTIONAL)
        try:
            if query:
                return self._query(key)
            self._set(key, argument.strip())
        except _Wrong as wrong:
            self._push(wrong.code)
        return ""

    def _query(self, key: str) -> str:
        reading = at_once(self._supply.read())
        told = {
            "*IDN": lambda: IDENTITY,
            "SYST:ERR": self._pop,
            "VOLT": lambda: f"{reading.set_voltage_v:.4f}",
            "CURR": lambda: f"{reading.set_current_a:.4f}",
            "OUTP": lambda: str(int(reading.on)),
            "MEAS:VOLT": lambda: f"{reading.voltage_v:.4f}",
            "MEAS:CURR": lambda: f"{reading.current_a:.4f}",
            "OUTP:PROT:TRIP": lambda: str(int(reading.tripped)),
            "OUTP:MODE": lambda: ("CC" if reading.limiting else "CV") if reading.on else "OFF",
        }.get(key)
        if told is None:
            raise _Wrong(-113)
        return told()

    def _set(self, key: str, argument: str) -> None:
        if key == "*CLS":
            self._errors.clear()
            return
        if key not in ("VOLT", "CURR", "OUTP"):
            raise _Wrong(-113)
        if not argument:
            raise _Wrong(-109)
        if key == "OUTP":
            self._output(argument.upper())
            return
        reading, value = at_once(self._supply.read()), _number(argument)
        setting = (value, reading.set_current_a) if key == "VOLT" else (reading.set_voltage_v, value)
        try:
            at_once(self._supply.set_output(*setting))
        except OutOfRange:
            raise _Wrong(-222) from None

    def _output(self, argument: str) -> None:
        if argument not in ("ON", "OFF", "1", "0"):
            raise _Wrong(-104)
        try:
            at_once(self._supply.switch_on() if argument in ("ON", "1") else self._supply.switch_off())
        except DeviceFault:
            raise _Wrong(-221) from None

    def _push(self, code: int) -> None:
        if len(self._errors) >= MOST_ERRORS:
            self._errors[-1] = -350
        else:
            self._errors.append(code)

    def _pop(self) -> str:
        code = self._errors.popleft() if self._errors else 0
        return f'{code},"{ERRORS[code] if code else "No error"}"'


class _Wrong(Exception):
    def __init__(self, code: int) -> None:
        super().__init__(ERRORS[code])
        self.code = code


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        raise _Wrong(-104) from None
    if not isfinite(value):
        raise _Wrong(-222)
    return value
