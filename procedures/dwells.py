"""Parameters of a stop rule for dwells, shared by procedures that take means at stations."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Self

from pydantic import Field, model_validator

from procedures.analysis.recursive_bias.dwell import DwellsSaved, expected_s, mean_sd
from procedures.core import units
from procedures.core.errors import BadParameter
from procedures.core.recording import TRIADS, Station
from procedures.core.report import Table
from procedures.core.stop_rule import ChannelTarget, StopRule
from procedures.core.unit import Unit
from procedures.parameters import Parameters


class StopAt(Parameters):
    """Target of a dwell: it ends when the mean of every channel is known so well, at the latest after `dwell_s`."""

    gyro_deg_h: float | None = Field(
        None, gt=0.0, le=1e6, description="standard uncertainty of gyro means; null: not asked of gyros"
    )
    accelerometer_m_s2: float | None = Field(
        None,
        gt=0.0,
        le=100.0,
        description="standard uncertainty of accelerometer means; null: not asked of accelerometers",
    )
    check_s: float = Field(
        5.0, ge=0.1, le=3600.0, description="interval of the check; a dwell is a whole number of them"
    )
    level: float = Field(
        1e-3, ge=0.0, lt=0.5, description="level of the test that the unit's noise is as its record has it"
    )
    rule: StopRule | None = Field(None, description="null: made of the unit's own noise when the job is planned")

    @model_validator(mode="after")
    def _asks_something(self) -> Self:
        if self.gyro_deg_h is None and self.accelerometer_m_s2 is None:
            raise ValueError("gyro_deg_h or accelerometer_m_s2 is needed: without a target nothing ends a dwell")
        return self

    def resolved(self, unit: Unit, least_s: float = 0.0) -> "StopAt":
        """Return the target with its rule, by the noise of the unit's record. Raises `BadParameter` where that is
        unknown.

        `least_s`: no dwell ends before it, also under a rule that was given.
        """
        if self.rule is not None:
            rule = replace(self.rule, least_s=max(self.rule.least_s, least_s))
            return self.model_copy(update={"rule": rule})
        asked = {
            "gyro": ("gyro_deg_h", self.gyro_deg_h, units.DEG_PER_HOUR),
            "accelerometer": ("accelerometer_m_s2", self.accelerometer_m_s2, 1.0),
        }
        targets: list[ChannelTarget] = []
        for triad, (field, value, size) in asked.items():
            if value is None:
                continue
            record = unit.triad(triad)
            if record is None:
                way_out = f"left out: the noise of the {triad} triad is not known; a static_run finds it"
                raise BadParameter(f"stop_at.{field}", value, way_out)
            targets += [
                ChannelTarget(n, value * size, noise) for n, noise in zip(TRIADS[triad], record.noise, strict=True)
            ]
        rule = StopRule(tuple(targets), self.check_s, self.level, least_s)
        return self.model_copy(update={"rule": rule})

    def warnings(self, longest_s: float) -> tuple[str, ...]:
        """Return a sentence for each target that the longest dwell does not reach by the unit's noise."""
        beyond = [t for t in (self.rule.targets if self.rule else ()) if mean_sd(t.noise, longest_s) > t.target_sd]
        return tuple(
            f"stop_at: {t.channel} is known to {mean_sd(t.noise, longest_s):.3g} after the longest dwell of "
            f"{longest_s:g} s, and {t.target_sd:.3g} is asked (rad/s or m/s²): no dwell will end before; ask for less, "
            "or give a longer dwell_s"
            for t in beyond
        )


class DwellParameters(Parameters):
    """Base of the parameters of procedures that dwell at rest: an optional rule that ends each dwell."""

    stop_at: StopAt | None = Field(
        None, description="end each dwell once the uncertainty of its means is this small; dwell_s is the longest"
    )

    def with_rule(self, unit: Unit, least_s: float = 0.0) -> Self:
        """Return the parameters with the rule by the unit's own noise; `least_s`: no dwell ends before it.

        Raises `BadParameter` where that noise is not known.
        """
        if self.stop_at is None:
            return self
        return self.model_copy(update={"stop_at": self.stop_at.resolved(unit, least_s)})

    @property
    def until(self) -> StopRule | None:
        """Rule of every station; None: dwells last their time."""
        return None if self.stop_at is None else self.stop_at.rule

    def dwell_warnings(self, stations: Sequence[Station]) -> tuple[str, ...]:
        """Return a sentence for each target that the longest dwell of a schedule does not reach by the unit's noise."""
        longest_s = max((s.record_s for s in stations), default=0.0)
        return () if self.stop_at is None else self.stop_at.warnings(longest_s)


def expected_stations(stations: Sequence[Station]) -> tuple[Station, ...]:
    """Return the stations with the dwells that their rules are expected to make of them, for plans."""
    return tuple(s if s.until is None else replace(s, record_s=expected_s(s.until, s.record_s)) for s in stations)


def saved_tables(saved: DwellsSaved | None) -> tuple[Table, ...]:
    """Return the table of `saved_table` alone; none where `saved` is None, as no station had a stop rule."""
    return () if saved is None else (saved_table(saved),)


def saved_table(saved: DwellsSaved) -> Table:
    """Return the table of the dwells' durations under the rule, and of the time that it saved."""
    rows = tuple((d.label, d.duration_s, d.longest_s, "the rule" if d.by_rule else "its time") for d in saved.dwells)
    note = (
        f"The stop rule saved {saved.saved_s:.0f} s, {100.0 * saved.share:.0f} % of the longest dwells. It looks at "
        "the unit's noise, not at what is measured: the means are not biased by it."
    )
    return Table("Dwells", ("station", "dwell, s", "longest, s", "ended by"), rows, note)
