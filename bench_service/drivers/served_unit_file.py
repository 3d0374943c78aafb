"""File of the unit that is served, as a laboratory would declare it: written where the bench file has none."""

from pathlib import Path

from bench_service.drivers.bench_file.unit_files import ACCELEROMETER_SCALES, GYRO_SCALES
from procedures.core import units
from procedures.core.unit import TriadRecord, Unit


def write_unit_file(folder: Path, unit: Unit) -> Path | None:
    """Write ``units/<serial>.toml`` next to a bench file whose `units` folder is empty; None: it has units already."""
    place = folder / "units"
    if any(place.glob("*.toml")):
        return None
    place.mkdir(parents=True, exist_ok=True)
    path = place / f"{unit.serial}.toml"
    path.write_text(_text(unit), encoding="utf-8")
    return path


def _text(unit: Unit) -> str:
    lines = [
        "# Data sheet of the simulated unit: its channels, and its true noise and stability.",
        f'serial = "{unit.serial}"',
        'model = "simulated"',
        f"sample_rate_hz = {unit.sample_rate_hz!r}",
        f"averaging_time_s = {unit.averaging_time_s!r}",
    ]
    if unit.gyro is not None:
        lines += ["[gyro]", *_triad(unit.gyro, GYRO_SCALES)]
        lines.append(f"bias_run_to_run_sd_deg_h = {unit.gyro.bias_run_to_run_sd / units.DEG_PER_HOUR!r}")
    if unit.accelerometer is not None:
        lines += ["[accelerometer]", *_triad(unit.accelerometer, ACCELEROMETER_SCALES)]
        lines.append(f"bias_run_to_run_sd_ug = {unit.accelerometer.bias_run_to_run_sd / units.MICRO_G!r}")
    for channel in unit.channels:
        lines += ["[[channels]]", f'name = "{channel.name}"', f'quantity = "{channel.quantity.value}"']
        lines += [f'unit = "{channel.unit}"', f"scale = {channel.scale!r}", f"offset = {channel.offset!r}"]
    return "\n".join(lines) + "\n"


def _triad(record: TriadRecord, scales: dict[str, float]) -> list[str]:
    fields = ("quantization", "random_walk", "bias_instability", "rate_random_walk")
    lines: list[str] = []
    for field, (key, scale) in zip(fields, scales.items(), strict=True):
        values = ", ".join(repr(float(getattr(noise, field)) / scale) for noise in record.noise)
        lines.append(f"{key} = [{values}]")
    lines.append(f"scale_factor_run_to_run_sd_ppm = {record.scale_factor_run_to_run_sd / units.PPM!r}")
    return lines
