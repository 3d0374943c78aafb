"""Name of a triad's coefficient: triad and symbol inside, the dotted text "gyro.b_x" at the edges only.

The text appears in results, limits and trends. It is made and parsed in this file and nowhere else.
"""

from collections.abc import Callable
from typing import Any


class CoefficientName(str):
    """Dotted text such as "gyro.b_x", with the triad and the symbol that it names. Made from both; read once from
    stored JSON.
    """

    __slots__ = ("symbol", "triad")
    triad: str
    """Triad by its name, either "gyro" or "accelerometer"."""
    symbol: str
    """"b_x", "K11", "asymmetry_x", …"""

    def __new__(cls, triad: str, symbol: str) -> "CoefficientName":
        name = super().__new__(cls, f"{triad}.{symbol}")
        name.triad, name.symbol = triad, symbol
        return name

    def __getnewargs__(self) -> tuple[str, str]:  # pyright: ignore[reportIncompatibleMethodOverride]  str's has one
        return self.triad, self.symbol

    @classmethod
    def of_text(cls, text: str) -> "CoefficientName":
        """Return the name that a stored text states. Raises `ValueError` where it names no triad."""
        triad, dot, symbol = text.partition(".")
        if not (triad and dot and symbol):
            raise ValueError(f"{text!r} is not the name of a triad's coefficient, such as gyro.b_x")
        return cls(triad, symbol)

    @classmethod
    def __get_pydantic_core_schema__(cls, _source: object, schema_of: Callable[[type], Any]) -> dict[str, Any]:
        """A string in JSON, read by `of_text`; pydantic asks for this, and need not be imported for it."""
        function = {"type": "no-info", "function": cls.of_text}
        return {"type": "function-after", "function": function, "schema": schema_of(str)}
