"""A bench file whose devices are served simulators, with the files of its unit and of its frames; its driver."""

from pathlib import Path
from typing import Any

from bench_service.bench.driver import BenchDriver
from bench_service.drivers.composition import driver_of
from bench_service.settings import Settings
from simulators.served.unit_frames import CountFrames

LANGUAGES = {"turntable": "acutrol", "supply": "scpi", "unit_link": "framed"}
THERMAL_LANGUAGES = {**LANGUAGES, "chamber": "simserv"}
PERSON = {"operator": "person"}
"""Language of the person, who sets the unit by hand."""
AMBIENT_C = 22.0
CHAMBER = """
[chamber]
driver = "simserv"
address = "tcp://127.0.0.1:{}"
after_set_s = 0.0
limits = {{ minimum_c = -60, maximum_c = 85, ramp_c_min = 3, ambient_c = {} }}
"""
UNIT = """
serial = "GL017"
sample_rate_hz = {}
"""


def bench_file(folder: Path, behind: Any, factor: float, after_demand_s: float | None = None) -> Path:
    """The bench file, the unit's file and the file of its frames; with a chamber where one is served.

    `after_demand_s`: of the turntable; None: the driver's own.
    """
    frames = behind.bench.frames
    assert isinstance(frames, CountFrames)
    (folder / "frame.toml").write_text(frames.description())
    channels = "".join(
        f'[[channels]]\nname = "{c.name}"\nquantity = "{c.quantity.value}"\nunit = "{c.unit}"\nscale = {c.scale!r}\n'
        for c in behind.bench.bench.imu.channels
    )
    (folder / "units").mkdir()
    (folder / "units" / "GL017.toml").write_text(UNIT.format(behind.bench.clock.rate_hz) + channels)
    axis = "minimum_deg = -400, maximum_deg = 400, rate_deg_s = 60, acceleration_deg_s2 = 100"
    numbers = behind.numbers
    chamber = "" if "chamber" not in numbers else CHAMBER.format(numbers["chamber"], AMBIENT_C)
    person = f'[operator]\naddress = "tcp://127.0.0.1:{numbers["operator"]}"' if "operator" in numbers else ""
    pause = "" if after_demand_s is None else f"after_demand_s = {after_demand_s}"
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
outer = {{ number = 1, {axis}, continuous = true }}
middle = {{ number = 2, {axis} }}
inner = {{ number = 3, {axis} }}
accuracy = {{ pointing_sd_arcsec = 2 }}
sinusoidal = true
{pause}
{chamber}
[supply]
driver = "scpi"
address = "tcp://127.0.0.1:{numbers["supply"]}"
limits = {{ maximum_v = 36.0, maximum_a = 5.0, nominal_v = 28.0, nominal_a = 3.0 }}
[unit_link]
driver = "framed"
address = "tcp://127.0.0.1:{numbers["unit_link"]}"
frame = "frame.toml"
{person}
[simulation]
time_factor = {factor}
""")
    return path


def wired_driver(folder: Path, behind: Any, factor: float, after_demand_s: float | None = None) -> BenchDriver:
    """The service's driver of that bench; every job has the operator whom the bench file names."""
    file = bench_file(folder, behind, factor, after_demand_s)
    settings = Settings(database_url=f"sqlite:///{folder / 'b.sqlite'}", bench_file=file, bench_id="east")
    return driver_of(settings, lambda _job, operator: operator)  # pyright: ignore[reportArgumentType]
