"""Truth files: TOML in the units people read, each key with its unit, each refusal with field, value and range."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from importlib.resources import files
from json import dumps
from pathlib import Path
from typing import Any

from procedures.bench.chamber import ChamberLimits
from procedures.bench.description import AxisLimits, BenchDescription, TableAccuracy
from procedures.core import units
from procedures.core.site import Site
from simulators.truth.ranges import TruthError, within
from simulators.truth.values import BenchTruth, SiteTruth, TableTruth, TriadTruth, UnitTruth

Table = Mapping[str, Any]


@dataclass(frozen=True)
class Key:
    """One key of a triad's table: the attribute it fills, the size of its unit in SI, its range, its shape."""

    attribute: str
    size: float
    low: float
    high: float
    shape: str = "vector"


def _triad_keys(
    rate: str, rate_s: float, integral: str, integral_size: float, pulse: tuple[float, float]
) -> dict[str, Key]:
    """Keys whose names are alike in both triads. `rate` is the suffix of a rate and `rate_s` its size in SI."""
    return {
        f"bias_{rate}": Key("bias", rate_s, -1e5, 1e5),
        "matrix": Key("matrix", 1.0, -10.0, 10.0, "matrix"),
        f"quantization_{integral}": Key("quantization", integral_size, *pulse),
        f"startup_{rate}": Key("startup", rate_s, -1e5, 1e5),
        "startup_time_s": Key("startup_time_s", 1.0, 1.0, 1e6, "number"),
        "self_heating_1_time_s": Key("self_heating_1_time_s", 1.0, 1.0, 1e6, "number"),
        "self_heating_2_time_s": Key("self_heating_2_time_s", 1.0, 1.0, 1e6, "number"),
        "dithered": Key("dithered", 1.0, 0.0, 1.0, "flag"),
        f"dither_residue_{integral}": Key("dither_residue", integral_size, 0.0, pulse[1]),
        "dither_frequency_hz": Key("dither_frequency_hz", 1.0, 0.0, 1e5),
        "scale_factor_asymmetry_ppm": Key("scale_factor_asymmetry_ppm", 1.0, -1e5, 1e5),
        "scale_factor_nonlinearity_ppm": Key("scale_factor_nonlinearity_ppm", 1.0, -1e5, 1e5),
        f"bias_run_to_run_sd_{rate}": Key("bias_run_to_run_sd", rate_s, 0.0, 1e5, "number"),
        "scale_factor_run_to_run_sd_ppm": Key("scale_factor_run_to_run_sd_ppm", 1.0, 0.0, 1e5, "number"),
        "flicker_band_s": Key("flicker_band_s", 1.0, 1e-3, 1e9, "pair"),
    }


KEYS: dict[str, dict[str, Key]] = {
    "gyro": {
        **_triad_keys("deg_h", units.DEG_PER_HOUR, "arcsec", units.ARCSEC, (1e-4, 1e3)),
        "random_walk_deg_sqrt_h": Key("random_walk", units.DEG_PER_SQRT_HOUR, 0.0, 100.0),
        "bias_instability_deg_h": Key("bias_instability", units.DEG_PER_HOUR, 0.0, 1e4),
        "rate_random_walk_deg_h_sqrt_h": Key("rate_random_walk", units.DEG_PER_HOUR_PER_SQRT_HOUR, 0.0, 1e4),
        "self_heating_1_deg_h": Key("self_heating_1", units.DEG_PER_HOUR, -1e5, 1e5),
        "self_heating_2_deg_h": Key("self_heating_2", units.DEG_PER_HOUR, -1e5, 1e5),
        "rate_ramp_deg_h_h": Key("rate_ramp", units.DEG_PER_HOUR_PER_HOUR, -1e4, 1e4),
        "nonlinearity_reference_deg_s": Key("nonlinearity_reference", units.DEG, 1e-3, 1e4, "number"),
    },
    "accelerometer": {
        **_triad_keys("m_s2", 1.0, "ug_s", units.MICRO_G, (1e-3, 1e5)),
        "random_walk_ug_sqrt_s": Key("random_walk", units.MICRO_G, 0.0, 1e5),
        "bias_instability_ug": Key("bias_instability", units.MICRO_G, 0.0, 1e5),
        "rate_random_walk_ug_per_sqrt_s": Key("rate_random_walk", units.MICRO_G, 0.0, 1e5),
        "self_heating_1_ug": Key("self_heating_1", units.MICRO_G, -1e5, 1e5),
        "self_heating_2_ug": Key("self_heating_2", units.MICRO_G, -1e5, 1e5),
        "rate_ramp_ug_s": Key("rate_ramp", units.MICRO_G, -1e5, 1e5),
        "nonlinearity_reference_m_s2": Key("nonlinearity_reference", 1.0, 1e-3, 1e4, "number"),
    },
}


def _only(where: str, table: Table, known: set[str], needed: set[str]) -> None:
    for key in table:
        if key not in known:
            raise TruthError(f"{where}.{key} = {table[key]!r} is not known; known are {', '.join(sorted(known))}")
    for key in sorted(needed - set(table)):
        raise TruthError(f"{where}.{key} is missing")


def _shaped(where: str, value: Any, key: Key) -> Any:
    """A value of a key in SI, each number inside the key's range."""
    if key.shape == "flag":
        if not isinstance(value, bool):
            raise TruthError(f"{where} = {value!r} must be true or false")
        return value
    if key.shape == "number":
        return within(where, value, key.low, key.high) * key.size
    length = 2 if key.shape == "pair" else 3
    if not isinstance(value, list) or len(value) != length:
        raise TruthError(f"{where} = {value!r} must be a list of {length}")
    if key.shape == "matrix":
        row = Key(key.attribute, key.size, key.low, key.high)
        return tuple(_shaped(f"{where}[{i}]", item, row) for i, item in enumerate(value))
    return tuple(within(f"{where}[{i}]", item, key.low, key.high) * key.size for i, item in enumerate(value))


def _triad(name: str, table: Table) -> TriadTruth:
    keys = KEYS[name]
    needed = {k for k, v in keys.items() if v.attribute in ("bias", "matrix", "quantization")}
    _only(name, table, set(keys), needed)
    values = {keys[k].attribute: _shaped(f"{name}.{k}", v, keys[k]) for k, v in table.items()}
    try:
        return TriadTruth(**values)
    except TruthError as refusal:
        raise TruthError(f"{name}: {refusal}") from refusal


def parse_unit(text: str) -> UnitTruth:
    """A unit's truth from TOML text. Raises `TruthError`."""
    document = _document(text)
    _only("unit", document, {"serial", "sample_rate_hz", *KEYS}, {"serial", *KEYS})
    triads = {name: _triad(name, document[name]) for name in KEYS}
    rate = within("unit.sample_rate_hz", document.get("sample_rate_hz", 400.0), 1.0, 4000.0)
    return UnitTruth(str(document["serial"]), triads["gyro"], triads["accelerometer"], rate)


def _record(kind: type[Any], where: str, table: Any, needed: set[str]) -> Any:
    """A flat record of numbers (and an id or title) from a table of the same names."""
    if not isinstance(table, dict):
        raise TruthError(f"{where} = {table!r} must be a table")
    _only(where, table, {f.name for f in fields(kind)}, needed)
    numbers = {k: within(f"{where}.{k}", v, -1e6, 1e6) for k, v in table.items()}
    try:
        return kind(**numbers)
    except ValueError as refusal:
        raise TruthError(str(refusal)) from refusal


def _description(table: Table) -> BenchDescription:
    axes = {"outer", "middle", "inner"}
    _only("description", table, {"id", "title", "site", "accuracy", "chamber", *axes}, {"id", "site", *axes})
    outer, middle, inner = (_axis(f"description.{axis}", table[axis]) for axis in ("outer", "middle", "inner"))
    site = _record(Site, "description.site", table["site"], {"latitude_deg", "gravity_m_s2"})
    accuracy = _record(TableAccuracy, "description.accuracy", table.get("accuracy", {}), set())
    title = str(table.get("title", ""))
    chamber = None
    if "chamber" in table:
        needed = {f.name for f in fields(ChamberLimits)}
        chamber = _record(ChamberLimits, "description.chamber", table["chamber"], needed)
    return BenchDescription(
        str(table["id"]), site, outer, middle, inner, accuracy, simulated=True, title=title, chamber=chamber
    )


def _axis(where: str, table: Any) -> AxisLimits:
    """Four numbers, and whether the axis has slip rings; none where it is not said."""
    continuous = table.get("continuous", False) if isinstance(table, dict) else False
    if not isinstance(continuous, bool):
        raise TruthError(f"{where}.continuous = {continuous!r} must be true or false")
    numbers = {k: v for k, v in table.items() if k != "continuous"} if isinstance(table, dict) else table
    needed = {f.name for f in fields(AxisLimits)} - {"continuous"}
    return replace(_record(AxisLimits, where, numbers, needed), continuous=continuous)


def parse_bench(text: str) -> BenchTruth:
    """A bench's truth from TOML text. Without `site_truth` the declared site is the true one. Raises `TruthError`."""
    document = _document(text)
    _only("bench", document, {"description", "site_truth", "table_truth"}, {"description"})
    description = _description(document["description"])
    table = _record(TableTruth, "table_truth", document.get("table_truth", {}), set())
    declared = description.site
    site = SiteTruth(declared.latitude_deg, declared.gravity_m_s2, declared.earth_rate_rad_s)
    if "site_truth" in document:
        site = _record(SiteTruth, "site_truth", document["site_truth"], {"latitude_deg", "gravity_m_s2"})
    return BenchTruth(site, table, description)


def _document(text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as refusal:
        raise TruthError(f"not a TOML file: {refusal}") from refusal


def load_unit(path: Path) -> UnitTruth:
    """A unit's truth from a file."""
    return parse_unit(path.read_text(encoding="utf-8"))


def load_bench(path: Path) -> BenchTruth:
    """A bench's truth from a file."""
    return parse_bench(path.read_text(encoding="utf-8"))


def default_unit() -> UnitTruth:
    """The unit that is shipped, "SIM-0001"."""
    return parse_unit(_shipped("default_unit.toml"))


def default_bench() -> BenchTruth:
    """The bench that is shipped, "sim"."""
    return parse_bench(_shipped("default_bench.toml"))


def _shipped(name: str) -> str:
    return (files("simulators") / "truths" / name).read_text(encoding="utf-8")


def save_unit(truth: UnitTruth, path: Path) -> None:
    """Write a unit's truth; what `load_unit` reads back agrees to the last digit or two (units are converted)."""
    lines = [f"serial = {dumps(truth.serial)}", f"sample_rate_hz = {truth.sample_rate_hz!r}"]
    for name, keys in KEYS.items():
        lines += ["", f"[{name}]"]
        lines += [f"{k} = {_text(getattr(truth.triad(name), v.attribute), v.size)}" for k, v in keys.items()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def save_bench(truth: BenchTruth, path: Path) -> None:
    """Write a bench's truth; `load_bench` reads back the same."""
    described = truth.description
    lines = ["[description]", f"id = {dumps(described.id)}", f"title = {dumps(described.title)}"]
    sections: dict[str, Any] = {
        "description.site": described.site,
        "description.outer": described.outer,
        "description.middle": described.middle,
        "description.inner": described.inner,
        "description.accuracy": described.accuracy,
        **({} if described.chamber is None else {"description.chamber": described.chamber}),
        "site_truth": truth.site,
        "table_truth": truth.table,
    }
    for name, record in sections.items():
        lines += ["", f"[{name}]", *(f"{f.name} = {_written(getattr(record, f.name))}" for f in fields(record))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _written(value: float | bool) -> str:
    return str(value).lower() if isinstance(value, bool) else repr(float(value))


def _text(value: Any, size: float) -> str:
    if isinstance(value, bool):
        return dumps(value)
    if isinstance(value, tuple):
        return "[" + ", ".join(_text(item, size) for item in value) + "]"
    return repr(float(value) / size)
