"""Lost links of a simulated bench's devices, set by simulation or by hand: one file for each, next to the register.

A cable that is out is out for every process, and for the next one too. `bench-<id>.<device>.lost` marks the cable of
that device as out; a person plugs it in by deleting the file, and pulls it out by making one (`touch`).
"""

import json
from datetime import datetime, timedelta
from pathlib import Path

from bench_service import wall_clock
from procedures.bench.errors import Disconnected


class DeviceCables:
    """Files that mark the links of one simulated bench's devices as lost; devices are named as in the journal:
    "turntable", "imu", …
    """

    def __init__(self, folder: Path, bench_id: str) -> None:
        self._folder = folder
        self._bench_id = bench_id

    def file(self, device: str) -> Path:
        """Return the path of the file that exists while a device's link is lost."""
        return self._folder / f"bench-{self._bench_id}.{device}.lost"

    def cut(self, device: str, why: str, lasts_s: float | None = None) -> None:
        """Lose a device's link, for `lasts_s` of real time or until its file is deleted.

        One that is lost for good stays so, whatever else happens to it.
        """
        until = None if lasts_s is None else wall_clock.now() + timedelta(seconds=lasts_s)
        path = self.file(device)
        lost = self._lost(path)
        if lost is not None and lost[0] is None:
            return
        partial = path.with_name(f"{path.name}.part")
        partial.write_text(json.dumps({"until": None if until is None else until.isoformat(), "why": why}))
        partial.replace(path)

    def need(self, device: str) -> None:
        """Check that a device's link is not lost. Raises `Disconnected` naming the device."""
        lost = self._lost(self.file(device))
        if lost is not None and (lost[0] is None or wall_clock.now() < lost[0]):
            why = f" ({lost[1]})" if lost[1] else ""
            raise Disconnected(f"the {device} cannot be reached: its link is lost{why}")

    def _lost(self, path: Path) -> tuple[datetime | None, str] | None:
        """Read the loss's end (None: for good) and its reason; None without a file. A handmade file may be empty."""
        try:
            text = path.read_text(encoding="utf-8")
        except FileNotFoundError:
            return None
        try:
            document = json.loads(text)
            until = document["until"]
            return None if until is None else datetime.fromisoformat(until), str(document["why"])
        except (ValueError, TypeError, KeyError):
            return None, ""
