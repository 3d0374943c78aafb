"""What may be set in the analysis of a launch at rest; each step can be switched."""

from dataclasses import dataclass
from typing import Literal

WaveletRule = Literal["thesis", "rescaled"]


@dataclass(frozen=True)
class LaunchSettings:
    """SI. The defaults are what `procedures.launches` gives; ranges are checked there."""

    cell_s: float = 1.0
    """Cell whose means the slow part of the analysis works on."""
    fast: bool = True
    """Also use what is faster than a cell, from every sample."""
    trim_gyros: bool = True
    trim_accelerometers: bool = False
    trim_s: float | None = None
    """Instead of what is detected: trim so long since the launch."""
    heating_gyros: bool = False
    heating_accelerometers: bool = True
    wavelet_rule: WaveletRule | None = "rescaled"
    """None: no split."""
    wavelet_levels: int = 6
    confidence: float = 0.95
    level: float = 0.01
    """Probability with which a process that is absent is reported present."""
    points_per_decade: int = 10
