"""The process that runs a lease of manual mode is killed in a motion or a ramp: safe by read-back over wires.

One of the cases is here, for a service starts for each; `make chaos` has all of them on both databases
(`tests.chaos.kills_over_wires`).
"""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.chaos.journals import NOTICE_LIMIT_S
from tests.kit.killed_on_wires import ask_for_lease, killed_in

pytestmark = pytest.mark.timeout(240)


def test_killed_in_a_motion_of_manual_mode_it_is_safe_by_its_own_readings(
    tmp_path: Path,
    free_port: int,
    new_postgres_database: Callable[[], str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    with killed_in("rate", new_postgres_database(), tmp_path, free_port) as found:
        with capsys.disabled():
            print(f"\nrate on postgres: {found}")
        assert found.world.safe, found.world
        assert found.noticed_s < NOTICE_LIMIT_S
        bench = found.bench
        assert "the supervisor" in bench.state().by
        bench.start()
        bench.until(lambda: bench.client.get(found.lease).json()["ended_at"] is not None, 30)
        over = bench.client.get(found.lease).json()
        assert (over["safe"], "ended or lost its database" in over["ended_because"]) == (True, True)
        demands = bench.client.get(f"{found.lease}/demands").json()["items"]
        assert {demand["state"] for demand in demands} == {"done", "stopped"}
        trail = bench.client.get("/api/v1/audit", params={"limit": 100}).json()["items"]
        assert any("made safe by the supervisor " in str(e["detail"].get("text")) for e in trail)
        assert ask_for_lease(bench) != found.lease
