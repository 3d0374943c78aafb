"""Overview of a recording for a plot, against the plain definition over all samples at once."""

from itertools import pairwise

import numpy as np
import pytest

from bench_service.formats.export import Extract
from bench_service.formats.overview import overview
from procedures.core.recording import Channel, Quantity, RecordingInfo

CHANNELS = (
    Channel("gyro_x", Quantity.ANGLE_INCREMENT, "rad", -2e-6, 3.0),
    Channel("case", Quantity.TEMPERATURE, "degC", 0.5, 0.0),
)


@pytest.mark.parametrize(("count", "bins", "block"), [(1000, 7, 64), (1000, 1000, 33), (10, 50, 3), (997, 1, 997)])
def test_bins_have_the_least_the_mean_and_the_greatest_of_their_samples(count: int, bins: int, block: int) -> None:
    raw = np.random.default_rng(1).integers(-50, 50, (count, 2)).astype(np.int32)
    info = RecordingInfo("r", "U", CHANNELS, 10.0, count, 0.0, "", True)
    made = overview(Extract(info, 0, count, "int32"), (raw[k : k + block] for k in range(0, count, block)), bins)
    values = np.column_stack([-2e-6 * 10.0 * (raw[:, 0] - 3.0), 0.5 * raw[:, 1]])
    edges = [k * count // min(bins, count) for k in range(min(bins, count) + 1)]
    parts = [values[a:b] for a, b in pairwise(edges)]
    np.testing.assert_allclose(made.edges, np.array(edges) / 10.0)
    np.testing.assert_allclose(made.minimum, [p.min(axis=0) for p in parts], atol=1e-15)
    np.testing.assert_allclose(made.mean, [p.mean(axis=0) for p in parts], rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(made.maximum, [p.max(axis=0) for p in parts], atol=1e-15)
