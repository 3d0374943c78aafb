"""Drivers against servers and encoders by others."""

import asyncio
import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

from bench_service.drivers.protocols import ixcom
from bench_service.drivers.protocols.ixcom_stream import IxcomDecoder
from procedures.bench.errors import DeviceBusy, DeviceFault, OutOfRange
from tests.conformance.served import opened
from tests.foreign.peer import PEERS, python_of, running, told

LIMITS = {"maximum_v": 20.0, "maximum_a": 2.0, "nominal_v": 12.0, "nominal_a": 1.0}


def test_the_supply_driver_drives_instros_server(tmp_path: Path) -> None:
    async def scene(port: int, process: subprocess.Popen[str]) -> None:
        supply = opened("supply", "scpi", port, tmp_path, limits=LIMITS, answer_s=2.0)
        found = await supply.connect()
        assert found.identity.maker == "NOMINAL"
        with pytest.raises(OutOfRange):
            await supply.set_output(21.0, 1.0)
        await supply.switch_on()
        await supply.switch_on()
        reading = await supply.read()
        assert reading.on
        # The server adds Gaussian noise with a standard deviation of 0.5 %/3 of the value (it calls its 0.005 a
        # percentage and uses it as a fraction): 0.020 V here and 0.0017 A below. Both bounds are six of them.
        assert reading.voltage_v == pytest.approx(12.0, abs=0.12)
        # With its leads of 10 ohm the load would take 12/11 A, more than the limit of 1 A.
        assert told(process, "load 1") == "done"
        limited = await supply.read()
        assert limited.limiting
        assert limited.current_a == pytest.approx(1.0, abs=0.01)
        assert told(process, "load 1000") == "done"
        assert told(process, "trip") == "done"
        tripped = await supply.read()
        assert tripped.tripped
        assert not tripped.on
        with pytest.raises(DeviceFault, match="a person must reset it"):
            await supply.switch_on()
        await supply.make_safe()
        supply.close()

    with running("instro", "instro_server.py") as process:
        asyncio.run(scene(int(told(process)), process))


def test_a_refusal_in_instros_words(tmp_path: Path) -> None:
    async def scene(port: int) -> None:
        wide = {**LIMITS, "maximum_v": 5000.0}
        supply = opened("supply", "scpi", port, tmp_path, limits=wide, answer_s=2.0)
        with pytest.raises(DeviceFault, match=r"refuses a voltage of 4000 V: .*-222"):
            await supply.set_output(4000.0, 1.0)
        supply.close()

    with running("instro", "instro_server.py") as process:
        asyncio.run(scene(int(told(process))))


def test_a_server_that_takes_one_client_leaves_the_second_one_busy(tmp_path: Path) -> None:
    async def scene(port: int) -> None:
        first = opened("supply", "scpi", port, tmp_path, limits=LIMITS, answer_s=2.0)
        await first.connect()
        second = opened("supply", "scpi", port, tmp_path, limits=LIMITS, answer_s=0.3)
        with pytest.raises(DeviceBusy, match="another master may hold it"):
            await second.connect()
        await first.read()
        first.close()
        second.close()

    with running("instro", "instro_server.py") as process:
        asyncio.run(scene(int(told(process))))


def test_frames_of_the_makers_own_encoder_are_decoded() -> None:
    rng = np.random.Generator(np.random.PCG64(5))
    scales = [1e-6, 1e-6, 1e-6, 1e-5, 1e-5, 1e-5]
    counts = rng.integers(-(2**20), 2**20, (50, 6))
    given = [
        json.dumps(
            {
                "counter": int(k) % 256,
                "time_s": 100.0 + k / 400.0,
                "acc": [float(c * 1e-5) for c in row[3:]],
                "omg": [float(c * 1e-6) for c in row[:3]],
                "status": int(k) % 3,
            }
        )
        for k, row in enumerate(counts)
    ]
    command = [str(python_of("ixcom")), str(PEERS / "ixcom_frames.py")]
    done = subprocess.run(command, input="\n".join(given), capture_output=True, text=True, timeout=60.0, check=True)
    frames = [bytes.fromhex(line) for line in done.stdout.split()]
    decoded = IxcomDecoder(scales).feed(b"".join(frames))
    np.testing.assert_array_equal(decoded.counts, counts)
    np.testing.assert_array_equal(decoded.counters, np.arange(50))
    np.testing.assert_array_equal(decoded.status[:, 0], np.arange(50) % 3)
    assert decoded.spoiled == 0
    assert ixcom.frame(frames[7]).time_s == pytest.approx(100.0 + 7 / 400.0, abs=2e-6)
