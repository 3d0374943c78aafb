"""Figures of a navigator's growing errors."""

from collections.abc import Sequence

from procedures.analysis.navigation.growth_summary import Curve
from procedures.core import units
from procedures.core.report import Figure, Series

INTERVAL = 1.959964
"""Half-length of the 95 % interval of a Gaussian, in standard deviations."""


def figures(time_s: Sequence[float], curves: Sequence[Curve]) -> tuple[Figure, ...]:
    """Return the figures of position, velocity and attitude errors over time, half-lengths of the 95 % intervals."""
    hours = tuple(t / units.HOUR for t in time_s)
    kinds = (("Position", "m", "m", 1.0), ("Velocity", "m/s", "m/s", 1.0), ("Attitude", "rad", "arcsec", units.ARCSEC))
    return tuple(
        Figure(
            f"{title}, 95 % interval",
            "time, h",
            f"± {unit}",
            tuple(
                Series(c.name, hours, tuple(INTERVAL * v / size for v in c.sd), style="line")
                for c in curves
                if c.unit == si
            ),
        )
        for title, si, unit, size in kinds
    )
