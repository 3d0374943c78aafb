"""A bench file whose every device is a served simulator: a job through the service, over TCP at a time factor."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench_service.cli.client import connect
from bench_service.settings import Settings
from simulators.served.unit_frames import CountFrames
from tests.conformance.served import FACTOR, Served, served
from tests.service.client import Client

LANGUAGES = {"turntable": "acutrol", "supply": "scpi", "unit_link": "framed"}
PLAN = {"positions": [[0, 90, 0, 2], [45, 0, -30, 2]], "delay_from": "rest", "settle_s": 1.0}
UNIT = """
serial = "GL017"
sample_rate_hz = 400
"""


def bench_file(folder: Path, behind: Served, factor: float = FACTOR) -> Path:
    """The bench file, the unit's file and the file of its frames."""
    frames = behind.bench.frames
    assert isinstance(frames, CountFrames)
    (folder / "frame.toml").write_text(frames.description())
    channels = "".join(
        f'[[channels]]\nname = "{c.name}"\nquantity = "{c.quantity.value}"\nunit = "{c.unit}"\nscale = {c.scale!r}\n'
        for c in behind.bench.bench.imu.channels
    )
    (folder / "units").mkdir()
    (folder / "units" / "GL017.toml").write_text(UNIT + channels)
    axis = "minimum_deg = -400, maximum_deg = 400, rate_deg_s = 60, acceleration_deg_s2 = 100"
    numbers = behind.numbers
    path = folder / "east.toml"
    path.write_text(f"""
[bench]
id = "east"
[site]
latitude_deg = 50.45
gravity_m_s2 = 9.810553
[turntable]
driver = "acutrol"
address = "tcp://127.0.0.1:{numbers["turntable"]}"
outer = {{ number = 3, {axis}, continuous = true }}
middle = {{ number = 2, {axis} }}
inner = {{ number = 1, {axis} }}
accuracy = {{ pointing_sd_arcsec = 2 }}
[supply]
driver = "scpi"
address = "tcp://127.0.0.1:{numbers["supply"]}"
limits = {{ maximum_v = 36.0, maximum_a = 5.0, nominal_v = 28.0, nominal_a = 3.0 }}
[unit_link]
driver = "framed"
address = "tcp://127.0.0.1:{numbers["unit_link"]}"
frame = "frame.toml"
[simulation]
time_factor = {factor}
""")
    return path


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("east")
    with served(LANGUAGES) as behind:
        settings = Settings(database_url=f"sqlite:///{folder / 'bench.sqlite'}", bench_file=bench_file(folder, behind))
        with connect(settings, None, drive=True) as http:
            client = Client(http)
            found = client.wait(client.submit("table_program", unit="GL017", parameters=PLAN)["id"])
            powered = behind.do(lambda bench: bench.bench.supply.is_on())
            return {"job": found, "recordings": client.recordings(found["id"]), "powered": powered}


def test_it_ends_with_the_unit_off(job: dict[str, Any]) -> None:
    assert job["job"]["state"] == "succeeded", job["job"]
    assert job["powered"] is False


def test_its_recordings_are_whole_and_know_their_launch(job: dict[str, Any]) -> None:
    assert [r["count"] for r in job["recordings"]] == [800, 800]
    launched = {r["launched_s"] for r in job["recordings"]}
    assert len(launched) == 1
    assert None not in launched


def test_served_simulators_at_a_time_factor_never_count_as_real(job: dict[str, Any]) -> None:
    assert job["job"]["simulated"] is True
    source = job["recordings"][0]["source"]
    assert source["origin"] == "simulated"
    assert source["devices"]["turntable"]["identity"]["model"] == "ACT3000"


def test_the_encoders_are_beside_the_commanded_angles(job: dict[str, Any]) -> None:
    for recording in job["recordings"]:
        mean, asked = recording["measured"]["angles"]["mean"], recording["station"]["angles"]
        axes = ("outer_deg", "middle_deg", "inner_deg")
        # The driver and the controller have five decimals of a degree.
        np.testing.assert_allclose([mean[a] for a in axes], [asked[a] for a in axes], atol=2e-4)
        assert recording["measured"]["supply"]["voltage_v"] == pytest.approx(28.0, abs=0.1)
