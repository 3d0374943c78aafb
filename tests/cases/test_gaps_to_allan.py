"""Gaps that were asked for at the import reach the deviation that leaves them out."""

import numpy as np
import pytest

from procedures.core.errors import UnfitRecording
from procedures.core.recording import MemoryRecording, RecordingInfo
from procedures.methods.allan_deviation import METHOD
from procedures.procedure import Evidence
from tests.cases.tables import chance, read, samples, table

RATE_HZ = 100.0


def test_gaps_are_refused_by_default_and_left_out_on_request() -> None:
    noise = chance(31).normal(0.0, 1.0, 20_000)
    kept = np.delete(np.arange(len(noise)), np.concatenate([np.arange(p, p + 30) for p in range(500, 19_000, 900)]))
    channel = {"name": "gyro_x", "column": "x", "quantity": "angular_rate", "unit": "rad/s"}
    text = table(["t", "x"], [(f"{i / RATE_HZ:.2f}", repr(float(noise[i]))) for i in kept])
    imported = read(text, time_column="t", channels=[channel], gaps="mark")
    info = RecordingInfo("r", "U", imported.channels, imported.rate_hz, imported.count)
    evidence = Evidence((MemoryRecording(info, samples(imported)),), ())
    with pytest.raises(UnfitRecording, match="sample 500 is missing"):
        METHOD.analyse(evidence, METHOD.params.model_validate({}), None)
    result = METHOD.analyse(evidence, METHOD.params.model_validate({"gaps": "leave_out"}), None)
    (curve,) = result.curves
    # White noise of 1 rad/s: deviation 1/√m at m samples; 20 samples a cluster have about 900 degrees of freedom, so
    # 4 sd of the estimate are 4/√1800 = 9.4 %.
    at = int(np.argmin(np.abs(np.array(curve.tau_s) * RATE_HZ - 20.0)))
    m = curve.tau_s[at] * RATE_HZ
    assert curve.deviation[at] == pytest.approx(1.0 / np.sqrt(m), rel=0.094)
    assert curve.terms[at] < imported.count - 2 * m
