"""A bench as a killed process leaves it: the unit on, the table in a move."""

import os
from pathlib import Path

from bench_service.drivers.device_register import DeviceRegister


def abandoned(folder: Path, job: str | None = None) -> DeviceRegister:
    """Leave the register of a bench as a process does that is killed in a move."""
    register = DeviceRegister(folder, "sim")
    link = register.open(by="process 4711 on bench-host", job=job)
    link.note("supply.switch_on", {}, powered=True)
    link.note("turntable.move_to", {}, table="moving")
    assert link._file is not None
    os.close(link._file)  # its death closes the file, and writes nothing
    link._file = None
    return register
