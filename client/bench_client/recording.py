"""A recording of the service: what is known of it, and its samples as arrays."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bench_client.samples import Samples, rates_of, raw_of
from bench_client.transport import Transport
from bench_client.views import RecordingView


class Recording:
    """A recording of the service; `view` has its description, and the methods read its samples."""

    def __init__(self, transport: Transport, view: RecordingView) -> None:
        self._transport = transport
        self.view = view
        self.id = view.id

    def __repr__(self) -> str:
        return f"Recording({self.id}: {self.view.count} samples of {len(self.view.channels)} channels)"

    def raw(
        self, channels: Sequence[str] | None = None, start_s: float | None = None, stop_s: float | None = None
    ) -> NDArray[np.int32] | NDArray[np.float64]:
        """Return the samples as the unit sent them, shape (n, channels). Raises `Refused`."""
        names = None if channels is None else ",".join(channels)
        query = {"format": "npy", "channels": names, "start_s": start_s, "stop_s": stop_s}
        given = {name: value for name, value in query.items() if value is not None}
        return raw_of(self._transport.send("GET", f"/api/v1/recordings/{self.id}/data", params=given).content)

    def rates(
        self, channels: Sequence[str] | None = None, start_s: float | None = None, stop_s: float | None = None
    ) -> Samples:
        """Read the samples as nominal rates in SI units, rad/s and m/s², with their time. Raises `Refused`.

        Nominal: by the scale and offset of each channel's data sheet, not by a calibration. A temperature is in °C.
        """
        known = {channel.name: channel for channel in self.view.channels}
        raw = self.raw(channels, start_s, stop_s)
        chosen = [known[name] for name in (known if channels is None else channels)]
        first = 0 if start_s is None else math.ceil(start_s * self.view.rate_hz - 1e-6)
        return rates_of(raw, chosen, self.view.rate_hz, first)
