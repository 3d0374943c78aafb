"""Transients to be put into noise, with the end each of them has: a stop, or where it crosses a level."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from procedures.core.noise import NoiseCoefficients
from simulators.truth import Array
from tests.validation.conditioning_noise import HOURS_6

AVERAGING_S, FRACTION = 70.0, 0.1


@dataclass(frozen=True)
class Curve:
    """1 at power-up. `kind` "cosine", "straight" or "cut exponential" ends at `times`; "exponentials" never does."""

    kind: str
    times: tuple[float, ...]
    """The end [s]; of exponentials the time constants."""
    shares: tuple[float, ...] = (1.0,)

    @property
    def name(self) -> str:
        return f"{self.kind} {' + '.join(f'{t:g}' for t in self.times)} s"

    def at(self, t: Array) -> Array:
        u = np.minimum(t / self.times[0], 1.0)
        match self.kind:
            case "cosine":
                return 0.5 * (1.0 + np.cos(np.pi * u))
            case "straight":
                return 1.0 - u
            case "cut exponential":  # a quarter of the end for time constant
                return (np.exp(-4.0 * u) - np.exp(-4.0)) / (1.0 - np.exp(-4.0))
            case _:
                parts = zip(self.shares, self.times, strict=True)
                return np.sum([share * np.exp(-t / tau) for share, tau in parts], axis=0)

    def cells(self) -> Array:
        """Values at the middles of 6 h of one-second cells."""
        return self.at(np.arange(HOURS_6, dtype=np.float64) + 0.5)

    def end_s(self, level: float) -> float:
        """Its stop, or its last crossing of a level relative to the amplitude."""
        if self.kind != "exponentials":
            return self.times[0]
        longest = max(self.times)
        return float(brentq(lambda t: float(self.at(np.array([t]))[0]) - level, longest, 50.0 * longest))


STOPPING = tuple(Curve(kind, (end,)) for kind in ("cosine", "straight") for end in (600.0, 11_700.0))
CUT = tuple(Curve("cut exponential", (end,)) for end in (600.0, 11_700.0))
DECAYING = (
    Curve("exponentials", (120.0,)),
    Curve("exponentials", (2000.0,)),
    Curve("exponentials", (300.0, 2000.0), (0.6, 0.4)),
)


def level_of(noise: NoiseCoefficients) -> float:
    """A tenth of the Allan deviation at 70 s, from the true coefficients, written out once more."""
    q, n, b, t = noise.quantization, noise.random_walk, noise.bias_instability, AVERAGING_S
    return FRACTION * float(
        np.sqrt(3.0 * q**2 / t**2 + n**2 / t + 0.441271 * b**2 + noise.rate_random_walk**2 * t / 3.0)
    )
