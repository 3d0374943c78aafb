"""Settings of the analysis of a launch at rest; each step can be switched off."""

from dataclasses import dataclass
from typing import Literal

WaveletRule = Literal["thesis", "rescaled"]


@dataclass(frozen=True)
class LaunchSettings:
    """Settings of a launch analysis, in SI. `procedures.launches` sets the same defaults and checks the ranges."""

    cell_s: float = 1.0
    """Length of the cells whose means the slow part of the analysis uses."""
    fast: bool = True
    """Also analyse the part faster than a cell, from every sample."""
    trim_gyros: bool = True
    trim_accelerometers: bool = False
    trim_s: float | None = None
    """Time since the launch to trim, in place of the detected end of the warm-up."""
    heating_gyros: bool = False
    heating_accelerometers: bool = True
    wavelet_rule: WaveletRule | None = "rescaled"
    """Rule of the wavelet thresholds; None: no split."""
    wavelet_levels: int = 6
    confidence: float = 0.95
    level: float = 0.01
    """Probability with which an absent process is reported present."""
    points_per_decade: int = 10
    band_step_decades: float | None = None
    """Step of the band over all starts; None: that of the curves."""
