"""The process that runs a lease of manual mode is killed in a motion or a ramp: safe by read-back over wires.

One of the cases is here, for a service starts for each; `make chaos` has all of them on both databases
(`tests.chaos.kills_over_wires`).
"""

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.kit.killed_on_wires import killed_in

pytestmark = pytest.mark.timeout(240)
MOST_S = 2.0
"""Longest time from the supervisor's notice to safe by read-back."""


def test_killed_in_a_motion_of_manual_mode_it_is_safe_by_its_own_readings(
    tmp_path: Path,
    free_port: int,
    new_postgres_database: Callable[[], str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    found = killed_in("rate", new_postgres_database(), tmp_path, free_port)
    with capsys.disabled():
        print(f"\nrate on postgres: kill to safe {found.to_safe_s:.3f} s, notice to safe {found.noticed_s:.3f} s")
    assert found.world.safe, found.world
    assert found.noticed_s < MOST_S
