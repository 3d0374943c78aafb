"""A bench file whose every device is a served simulator: a job through the service, over TCP at a time factor."""

from typing import Any

import numpy as np
import pytest

from bench_service.cli.asking.client import connect
from bench_service.settings import Settings
from tests.conformance.served import FACTOR, served
from tests.kit.wired_bench import LANGUAGES, bench_file
from tests.service.client import Client

PLAN = {"positions": [[0, 90, 0, 2], [45, 0, -30, 2]], "delay_from": "rest", "settle_s": 1.0}


@pytest.fixture(scope="module")
def job(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    folder = tmp_path_factory.mktemp("east")
    with served(LANGUAGES) as behind:
        settings = Settings(
            database_url=f"sqlite:///{folder / 'bench.sqlite'}", bench_file=bench_file(folder, behind, FACTOR)
        )
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
