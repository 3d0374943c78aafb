"""Noise model of a channel: the coefficients of IEEE Std 952 in SI units."""

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class NoiseCoefficients:
    """Noise of one channel. For a gyro ``rate`` is angular rate [rad/s]; for an accelerometer specific force [m/s²].

    ``σ²(τ) = 3Q²/τ² + N²/τ + (2 ln 2/π)B² + K²τ/3 + R²τ²/2`` (thesis 3.2; IEEE Std 952 Annex C).

    The bias instability is a flicker process whose relaxation times are spread log-uniformly between
    the two of `flicker_band_s`: one-sided power spectral density ``B²/(π f)`` well inside the band, finite
    variance ``(B²/π)·ln(τ₂/τ₁)``. A zero coefficient means that the process is absent.
    """

    quantization: float = 0.0
    """Quantization noise Q [rate·s]: standard deviation of the whole error of one reading of the integrated output:
    LSB/√12 of a plain counter, LSB/2 of one with a triangular dither of ±1 pulse."""
    random_walk: float = 0.0
    """Angle (velocity) random walk N [rate·√s]."""
    bias_instability: float = 0.0
    """Bias instability coefficient B [rate]."""
    rate_random_walk: float = 0.0
    """Rate random walk K [rate/√s]."""
    rate_ramp: float = 0.0
    """Rate ramp coefficient R [rate/s]."""
    flicker_band_s: tuple[float, float] = (0.5, 1.0e5)
    """Shortest and longest relaxation time of the bias instability [s]."""

    def __post_init__(self) -> None:
        for field in fields(self)[:5]:
            value = getattr(self, field.name)
            if not 0.0 <= value < float("inf"):
                raise ValueError(f"noise.{field.name} = {value!r} must be finite and not negative")
        low, high = self.flicker_band_s
        if not 0.0 < low < high < float("inf"):
            raise ValueError(f"noise.flicker_band_s = {self.flicker_band_s!r} must be 0 < shortest < longest")
