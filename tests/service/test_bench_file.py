"""Bench files and unit files: what is read, and that a mistake is answered with file, line and field."""

from datetime import datetime, timedelta
from pathlib import Path

import pytest

from bench_service.bench.directory import certificates_due
from bench_service.drivers.bench_file.description import described
from bench_service.drivers.bench_file.document import read_bench_file
from bench_service.drivers.bench_file.lines import line_of
from bench_service.drivers.bench_file.unit_files import read_unit, read_units
from bench_service.drivers.interface import registry
from bench_service.drivers.interface.driver import Bound, Found
from bench_service.drivers.interface.registry import SHIPPED
from bench_service.drivers.simulated import SimulatedDriver
from bench_service.model.errors import Misconfigured
from bench_service.settings import Settings
from procedures.bench.device import DeviceIdentity
from procedures.core import units
from tests.kit import line_devices
from tests.kit.line_devices import bench_text

TEXT = bench_text(line_devices.table(), line_devices.supply(), line_devices.chamber()).replace(':0"', ':2049"')
UNIT = """
serial = "GL017"
model = "GL-120"
part = "120-7"
firmware = "3.1"
sample_rate_hz = 400
[[channels]]
name = "gyro_x"
quantity = "angle_increment"
unit = "rad"
scale = 1.9e-6
lag_s = 0.0025
range = [-0.02, 0.02]
[[channels]]
name = "accelerometer_x"
quantity = "velocity_increment"
unit = "m/s"
scale = 2.4e-5
[gyro]
random_walk_deg_sqrt_h = [0.001, 0.002, 0.003]
bias_run_to_run_sd_deg_h = 0.01
[[coefficients]]
state = "as found"
day = 2026-03-02
certificate = "K-112"
gyro = { bias = [1e-7, 0, 0], matrix = [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }
"""


@pytest.fixture(autouse=True)
def _drivers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "SHIPPED", line_devices.SHIPPED)


def _file(tmp_path: Path, text: str = TEXT) -> Path:
    path = tmp_path / "east.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_bench_file_says_which_device_is_real(tmp_path: Path) -> None:
    file = read_bench_file(_file(tmp_path))
    assert set(file.real()) == {"turntable", "supply", "chamber"}
    assert file.simulated("unit_link")
    found = described(file, SimulatedDriver("east").description)
    assert (found.origin, found.simulated) == ("mixed", True)
    assert {d.name: d.simulated for d in found.devices} == {
        "turntable": False,
        "supply": False,
        "unit_link": True,
        "chamber": False,
        "operator": True,
    }
    assert found.accuracy.measured
    assert found.accuracy.pointing_sd_arcsec == 0.5
    assert found.no_thermal_jobs == "", "a simulated unit follows the real chamber's air"


def test_a_real_unit_feels_no_simulated_chamber(tmp_path: Path) -> None:
    text = TEXT[: TEXT.index("[chamber]")]
    link = '[unit_link]\ndriver = "framed"\naddress = "tcp://127.0.0.1:7000"\nframe = "gl017.toml"\n'
    shipped = {**line_devices.SHIPPED, ("unit_link", "framed"): SHIPPED["unit_link", "framed"]}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(registry, "SHIPPED", shipped)
        file = read_bench_file(_file(tmp_path, text + '[chamber]\ndriver = "simulated"\n' + link))
        found = described(file, SimulatedDriver("east").description)
    assert "nothing warms or cools the unit" in found.no_thermal_jobs


def test_commanded_angles_are_used_where_the_encoders_are_not_declared_better(tmp_path: Path) -> None:
    text = TEXT.replace("encoder_sd_arcsec = 0.5", "encoder_sd_arcsec = 2.5")
    accuracy = described(read_bench_file(_file(tmp_path, text)), None).accuracy
    assert (accuracy.measured, accuracy.pointing_sd_arcsec) == (False, 2.0)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("gravity_m_s2 = 9.810553", 'gravity_m_s2 = "fast"', ("line 6", "site.gravity_m_s2 = 'fast'", "valid number")),
        ("gravity_m_s2 = 9.810553", "gravty_m_s2 = 9.8", ("line 6", "site.gravty_m_s2 is no field")),
        ("gravity_m_s2 = 9.810553", "gravity_m_s2 = 98.1", ("line 6", "less than or equal to 9.9")),
        ("gravity_m_s2 = 9.810553", "", ("line 4", "site.gravity_m_s2 is missing")),
        ("gravity_m_s2 = 9.810553", "gravity_m_s2 = ", ("line 6",)),
        (
            'driver = "line"\naddress',
            'driver = "lime"\naddress',
            ("line 8", "turntable.driver = 'lime'", "there is simulated, line"),
        ),
        ('"tcp://127.0.0.1:2049"', '"127.0.0.1:2049"', ("line 9", "turntable.address", "give tcp://host:port")),
        ("minimum_deg = -400, ", "minimum_deg = 500, ", ("line 13", "turntable.outer", "must be below maximum_deg")),
        ("minimum_v = 0", "minimum_v = nan", ("supply.limits.minimum_v",)),
        ("ambient_c = 22", "ambient_c = 99", ("chamber.limits", "ambient_c = 99 must be within -55")),
        ('id = "east"', 'id = "East Side"', ("line 3", "bench.id")),
        ("[supply]", "[suply]", ("suply is no field",)),
        ("[supply]", '[operator]\naddress = "udp://127.0.0.1:9"\n[supply]', ("operator.address", "listens on tcp")),
    ],
)
def test_a_mistake_is_answered_with_line_and_field(tmp_path: Path, old: str, new: str, words: tuple[str, ...]) -> None:
    with pytest.raises(Misconfigured) as refused:
        read_bench_file(_file(tmp_path, TEXT.replace(old, new, 1)))
    text = str(refused.value)
    assert "east.toml" in text
    assert all(word in text for word in words), text
    assert "\n" not in text


def test_the_narrower_limit_of_file_and_device_holds(tmp_path: Path) -> None:
    file = read_bench_file(_file(tmp_path))
    own = {"turntable": (Bound("outer.rate_deg_s", 45.0), Bound("inner.maximum_deg", 720.0))}
    told = {kind: Found(DeviceIdentity("Line", "T3"), (), bounds) for kind, bounds in own.items()}
    found = described(file, SimulatedDriver("east").description, told)  # pyright: ignore[reportArgumentType]
    assert (found.outer.rate_deg_s, found.middle.rate_deg_s, found.inner.maximum_deg) == (45.0, 60.0, 400.0)
    assert found.devices[0].identity == DeviceIdentity("Line", "T3")


@pytest.mark.parametrize(("day", "overdue"), [("2027-03-02", False), ("2027-03-03", True)])
def test_a_certificate_is_overdue_after_its_day(tmp_path: Path, day: str, overdue: bool) -> None:
    certificate = 'certificate = { number = "AT-117", laboratory = "PTB", due = 2027-03-02 }\n'
    text = TEXT.replace("[turntable]\n", "[turntable]\n" + certificate)
    found = described(read_bench_file(_file(tmp_path, text)), None)
    assert found.overdue(day) == (
        ("the certificate AT-117 of the turntable has expired: it was valid until 2027-03-02",) if overdue else ()
    )
    soon = "the certificate AT-117 of the turntable expires soon: it is valid until 2027-03-02"
    assert found.due_between(day, "2027-03-31") == (() if overdue else (soon,))
    at = datetime.fromisoformat(f"{day}T23:59:59+00:00")
    assert certificates_due(found, at) == (found.overdue(day) or (soon,))
    assert certificates_due(found, at - timedelta(days=40)) == ()


def test_a_time_factor_belongs_to_served_simulators_alone(tmp_path: Path) -> None:
    with pytest.raises(Misconfigured, match="the unit_link is simulated in the driving process, which keeps real time"):
        read_bench_file(_file(tmp_path, TEXT + "[simulation]\ntime_factor = 60\n"))
    link = '[unit_link]\ndriver = "framed"\naddress = "tcp://127.0.0.1:7000"\nframe = "gl017.toml"\n'
    shipped = {**line_devices.SHIPPED, ("unit_link", "framed"): SHIPPED["unit_link", "framed"]}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(registry, "SHIPPED", shipped)
        file = read_bench_file(_file(tmp_path, TEXT + link + "[simulation]\ntime_factor = 60\n"))
        found = described(file, None)
        assert (found.origin, found.no_thermal_jobs) == ("simulated", "")
        assert described(read_bench_file(_file(tmp_path, TEXT + link)), None).origin == "real"


def test_the_settings_take_the_benchs_id_from_its_file(tmp_path: Path) -> None:
    path = _file(tmp_path)
    assert Settings(bench_file=path).bench_id == "east"
    assert Settings.from_environ({"BENCH_FILE": str(path)}).bench_id == "east"
    assert Settings.from_environ({"BENCH_FILE": str(path), "BENCH_ID": "west"}).bench_id == "west"
    assert Settings().bench_id == "sim"


def test_a_unit_is_declared_by_its_file(tmp_path: Path) -> None:
    folder = tmp_path / "units"
    assert read_units(folder) == ()
    folder.mkdir()
    (folder / "GL017.toml").write_text(UNIT)
    (unit,) = read_units(folder)
    assert (unit.serial, unit.sample_rate_hz, len(unit.channels), unit.accelerometer) == ("GL017", 400.0, 2, None)
    assert unit.gyro is not None
    assert [n.random_walk for n in unit.gyro.noise] == pytest.approx(
        [0.001 * units.DEG_PER_SQRT_HOUR, 0.002 * units.DEG_PER_SQRT_HOUR, 0.003 * units.DEG_PER_SQRT_HOUR]
    )
    # 0.01 deg/h = 0.01·π/180/3600 rad/s
    assert unit.gyro.bias_run_to_run_sd == pytest.approx(4.84813681e-8)
    assert unit.declaration is not None
    assert (unit.declaration.model, unit.declaration.firmware) == ("GL-120", "3.1")
    assert unit.declaration.lags_s["gyro_x"] == 0.0025
    assert unit.declaration.ranges == {"gyro_x": (-0.02, 0.02)}
    assert [(c.state, c.day, c.triad) for c in unit.declaration.coefficients] == [("as found", "2026-03-02", "gyro")]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('unit = "m/s"', 'unit = "m/s^2"', ("line 14", "channels.1", "unit 'm/s^2' is none of")),
        ("scale = 2.4e-5", "scale = 0", ("channels.1", "not zero")),
        ('name = "accelerometer_x"', 'name = "gyro_x"', ("'gyro_x' is listed twice",)),
        ('state = "as found"', 'state = "as sold"', ("line 23", "coefficients.0.state")),
        ('serial = "GL017"', 'serial = "GL018"', ("its file is GL018.toml",)),
        ("sample_rate_hz = 400", "sample_rate_hz = -1", ("line 6", "sample_rate_hz = -1")),
    ],
)
def test_a_mistake_in_a_units_file_is_answered(tmp_path: Path, old: str, new: str, words: tuple[str, ...]) -> None:
    path = tmp_path / "GL017.toml"
    path.write_text(UNIT.replace(old, new, 1))
    with pytest.raises(Misconfigured) as refused:
        read_unit(path)
    assert all(word in str(refused.value) for word in words), refused.value


def test_a_file_that_is_not_there_or_no_text_is_named(tmp_path: Path) -> None:
    with pytest.raises(Misconfigured, match=r"none\.toml cannot be read"):
        read_bench_file(tmp_path / "none.toml")
    path = tmp_path / "east.toml"
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(Misconfigured, match="not UTF-8"):
        read_bench_file(path)


def test_lines_are_those_of_the_deepest_key_that_is_there() -> None:
    text = '[a]\nx = 1\n[a.b]\ny.z = 2\n[[c]]\nn = 1\n[[c]]\nn = 2\n"q r" = 3\n'
    assert line_of(text, ("a", "x")) == 2
    assert line_of(text, ("a", "b", "y", "z")) == 4
    assert line_of(text, ("a", "missing")) == 1
    assert line_of(text, ("c", 1, "n")) == 8
    assert line_of(text, ("c", 0, "n")) == 6
    assert line_of(text, ("nothing",)) is None
