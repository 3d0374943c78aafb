"""The example of docs/bench-file.md is read as it stands."""

import re
from pathlib import Path

from bench_service.drivers.bench_file.description import described
from bench_service.drivers.bench_file.document import read_bench_file
from bench_service.drivers.bench_file.unit_files import read_units

PAGE = Path(__file__).parents[2] / "docs" / "bench-file.md"


def test_the_pages_example_is_a_bench_and_a_unit(tmp_path: Path) -> None:
    bench, unit = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "units").mkdir()
    (tmp_path / "units" / "GL017.toml").write_text(unit, encoding="utf-8")
    path = tmp_path / "east.toml"
    path.write_text(bench, encoding="utf-8")
    file = read_bench_file(path)
    found = described(file, None)
    assert set(file.real()) == {"turntable", "chamber", "supply", "unit_link"}
    assert (found.id, found.origin, found.simulated) == ("east", "real", False)
    assert (found.accuracy.measured, found.accuracy.pointing_sd_arcsec) == (True, 0.3)
    assert {d.name for d in found.devices if d.certificate is not None} == {"turntable", "chamber", "site"}
    assert found.overdue("2027-03-03") == (
        "the certificate AT-117 of the turntable has expired: it was valid until 2027-03-02",
    )
    (declared,) = read_units(tmp_path / "units")
    assert (declared.serial, declared.averaging_time_s) == ("GL017", 70.0)
    assert declared.gyro is not None
    assert declared.accelerometer is not None
