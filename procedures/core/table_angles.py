"""Commanded angles of the table: a value, without geometry. Simulators and analyses share it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class TableAngles:
    """The three table angles [deg]: outer about the vertical, middle about z, inner about the unit's x."""

    outer_deg: float = 0.0
    middle_deg: float = 0.0
    inner_deg: float = 0.0
