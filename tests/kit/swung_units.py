"""Recordings of sinusoids in closed form, of gyros with a known gain, delay and first-order lag: no simulated table.

The rate ``A·ω·cos(ωt + φ)`` of the table passes a gain, a delay d and a lag T, ``H = G·exp(−iωd)/(1 + iωT)``; a sample
is the mean of it over its interval, an integral of the cosine. The encoder is read at times of its own, with a scatter.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.analysis.response.trace import ENCODER_CHANNELS
from procedures.bench.turntable import EncoderTrace
from procedures.core import units
from procedures.core.noise import NoiseCoefficients
from procedures.core.recording import GYRO, Channel, MemoryRecording, Quantity, RecordingInfo, Station
from procedures.sinusoids import EncoderRows
from simulators.imu.synthesis import synthesise

CHANNELS = tuple(Channel(name, Quantity.ANGLE_INCREMENT, "rad") for name in GYRO)

NOISELESS = NoiseCoefficients()


@dataclass(frozen=True)
class SwungUnit:
    """Truth of a gyro channel and of the encoder beside it."""

    gain: float = 1.0
    delay_s: float = 0.0
    """Pure delay [s]."""
    time_constant_s: float = 0.0
    noise: NoiseCoefficients = NOISELESS
    encoder_sd_arcsec: float = 0.1
    encoder_rate_hz: float = 80.0
    stamp_sd_s: float = 0.0
    """Standard deviation of the stamps' delay from recording to recording [s]."""
    clock_ppm: float = 0.0
    """What the unit's clock is behind the bench's."""
    rate_hz: float = 400.0


def swung(unit: SwungUnit, stations: Sequence[Station], channels: Sequence[int], seed: int) -> list[MemoryRecording]:
    """The recordings of stations, the channel that turns at each given; the other channels are still."""
    return [
        _recording(unit, station, channel, np.random.default_rng((seed, station.index)), seed * 1000 + station.index)
        for station, channel in zip(stations, channels, strict=True)
    ]


def _recording(unit: SwungUnit, station: Station, channel: int, rng: np.random.Generator, seed: int) -> MemoryRecording:
    swing = station.sinusoid
    assert swing is not None
    omega, amplitude = 2.0 * np.pi * swing.frequency_hz, swing.amplitude_deg * units.DEG
    phase, late = rng.uniform(-np.pi, np.pi), unit.delay_s + unit.stamp_sd_s * rng.standard_normal()
    count = round(station.record_s * unit.rate_hz)
    followed = unit.gain / (1.0 + 1j * omega * unit.time_constant_s) * np.exp(-1j * omega * late)
    slow = 1.0 + 1e-6 * unit.clock_ppm
    # ∫A·ω·cos(ωt + φ)dt = A·sin(ωt + φ), of which a sample's increment is the difference at its ends.
    edges = slow * np.arange(count + 1) / unit.rate_hz
    turned = np.imag(amplitude * followed * np.exp(1j * (omega * edges + phase)))
    noise = np.concatenate(list(synthesise(unit.noise, unit.rate_hz, count, seed)))
    bias = 1e-4 * rng.standard_normal()
    raw = np.zeros((count, len(GYRO)))
    raw[:, channel] = np.diff(turned) + (noise + bias) / unit.rate_hz
    read = np.sort(rng.uniform(0.0, slow * station.record_s, round(unit.encoder_rate_hz * station.record_s)))
    angles = np.zeros((len(read), 3))
    scatter = unit.encoder_sd_arcsec * units.ARCSEC * rng.standard_normal(len(read))
    angles[:, 0] = (amplitude * np.sin(omega * read + phase) + scatter) / units.DEG
    rows = EncoderRows(0.0, unit.rate_hz).next_rows(count, EncoderTrace(read, angles, np.zeros(len(read))))
    assert rows.shape == (count, len(ENCODER_CHANNELS))
    info = RecordingInfo(
        f"r{station.index}", "SWUNG", (*CHANNELS, *ENCODER_CHANNELS), unit.rate_hz, count, 0.0, station, simulated=True
    )
    return MemoryRecording(info, np.column_stack([raw, rows]))
