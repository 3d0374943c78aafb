"""Clients by others drive the simulators that are served."""

from dataclasses import replace

import numpy as np
import pytest

from simulators.served.at_once import at_once
from simulators.served.bench import ServedConfig, ServedDevice
from simulators.truth import default_unit, unit_channels
from simulators.world import WorldConfig
from tests.conformance.served import Served, served
from tests.foreign.peer import asked, python_of


def test_basil_drives_the_served_chamber() -> None:
    python_of("basil")
    device = ServedDevice("simserv", options={"type": "LabEvent T/210/70/5"})
    with Served(ServedConfig(replace(WorldConfig(), thermal=True), {"chamber": device}, 20.0)) as bench:
        told = asked("basil", "basil_client.py", bench.numbers["chamber"])
    assert told["type"] == "LabEvent T/210/70/5"
    assert told["idle"] == "1: Test not running (Idle)"
    assert told["air"] == pytest.approx(22.0, abs=1.0)
    assert told["set_point"] == 41.25
    assert told["running"] == "3: Test running"
    assert told["dryer"] is True
    assert told["compressed_air"] is False
    assert told["stopped"] == "1: Test not running (Idle)"


def test_pyvisa_drives_the_served_supply() -> None:
    python_of("visa")
    with served({"supply": "scpi"}) as bench:
        told = asked("visa", "visa_client.py", bench.numbers["supply"])
    assert told["identity"].startswith("BENCH SIMULATORS,")
    assert (told["on"], told["off"]) == ("1", "0")
    assert told["voltage"] == pytest.approx(27.5, abs=0.01)
    assert told["error"] == '0,"No error"'
    assert told["refused"].startswith("-222,")
    assert told["unknown"].startswith("-113,")
    assert told["kept"] == 27.5


def test_the_makers_own_client_drives_the_served_ixcom_unit() -> None:
    python_of("ixcom")
    with served({"unit_link": "ixcom"}, factor=1.0, valid_after_s=0.0) as bench:
        bench.do(lambda b: at_once(b.bench.supply.switch_on()))
        told = asked("ixcom", "ixcom_client.py", bench.numbers["unit_link"], 400)
        bias, matrix = bench.do(lambda b: b.bench.true_calibration()["accelerometer"])
    assert told["serial"] == default_unit().serial
    assert told["timing"] == 400
    counters = np.array([message[0] for message in told["messages"]])
    times = np.array([message[1] for message in told["messages"]])
    force = np.array([message[2] for message in told["messages"]])
    rate = np.array([message[3] for message in told["messages"]])
    assert len(counters) == 200
    assert np.all(np.diff(counters) % 256 == 1)
    np.testing.assert_allclose(np.diff(times), 1.0 / 400.0, atol=2e-6)
    # At zero angles y is up, and the output is b + K·g. A mean of half a second is off by a pulse over that time, and
    # by the noise, below 1e-3 m/s² for this unit; 0.02 m/s² is far above both.
    expected = np.array(bias) + np.array(matrix) @ [0.0, 9.8105, 0.0]
    pulse = max(c.scale for c in unit_channels(default_unit())[3:]) / 0.5
    np.testing.assert_allclose(force.mean(axis=0), expected, atol=0.02 + pulse)
    assert np.all(np.abs(rate.mean(axis=0)) < 2e-3)
    assert all(message[4] == 0 for message in told["messages"])
