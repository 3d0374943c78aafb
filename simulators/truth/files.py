"""Truth files in TOML, in the units people read: each key with its unit, each refusal with field, value and range."""

from dataclasses import fields, replace
from functools import lru_cache
from importlib.resources import files
from json import dumps
from pathlib import Path
from typing import Any

from procedures.bench.chamber import ChamberAccuracy, ChamberLimits
from procedures.bench.current_source import CurrentSourceLimits
from procedures.bench.description import AxisLimits, BenchDescription, TableAccuracy
from procedures.bench.supply import SupplyLimits
from procedures.core import units
from procedures.core.site import Site
from simulators.truth.ranges import TruthError, within
from simulators.truth.tables import (
    Key,
    Table,
    check_keys,
    keyed_lines,
    read_changes,
    read_document,
    read_record,
    read_value,
    record_lines,
)
from simulators.truth.thermal import ChamberFault, ChamberTruth
from simulators.truth.thermal_files import read_thermal, thermal_lines
from simulators.truth.values import (
    BenchTruth,
    CurrentSourceTruth,
    OperatorTruth,
    SiteTruth,
    TableTruth,
    TriadTruth,
    UnitTruth,
)


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


BENCH_TRUTHS = (
    "site_truth",
    "table_truth",
    "chamber_truth",
    "chamber_faults",
    "operator_truth",
    "current_source_truth",
)


def _triad(name: str, table: Table) -> TriadTruth:
    keys = KEYS[name]
    needed = {k for k, v in keys.items() if v.attribute in ("bias", "matrix", "quantization")}
    check_keys(name, table, set(keys), needed)
    values = {keys[k].attribute: read_value(f"{name}.{k}", v, keys[k]) for k, v in table.items()}
    try:
        return TriadTruth(**values)
    except TruthError as refusal:
        raise TruthError(f"{name}: {refusal}") from refusal


def parse_unit(text: str) -> UnitTruth:
    """Parse a unit's truth from TOML text. Raises `TruthError`."""
    document = read_document(text)
    check_keys("unit", document, {"serial", "sample_rate_hz", "thermal", *KEYS}, {"serial", *KEYS})
    triads = {name: _triad(name, document[name]) for name in KEYS}
    rate = within("unit.sample_rate_hz", document.get("sample_rate_hz", 400.0), 1.0, 4000.0)
    thermal = read_thermal(document.get("thermal", {}))
    return UnitTruth(str(document["serial"]), triads["gyro"], triads["accelerometer"], rate, thermal)


def _description(table: Table) -> BenchDescription:
    axes = {"outer", "middle", "inner"}
    check_keys(
        "description",
        table,
        {
            "id",
            "title",
            "site",
            "accuracy",
            "chamber",
            "chamber_accuracy",
            "current_source",
            "supply",
            "sinusoidal",
            *axes,
        },
        {"id", "site", *axes},
    )
    outer, middle, inner = (_axis(f"description.{axis}", table[axis]) for axis in ("outer", "middle", "inner"))
    site = read_record(Site, "description.site", table["site"], {"latitude_deg", "gravity_m_s2"})
    accuracy = read_record(TableAccuracy, "description.accuracy", table.get("accuracy", {}), set())
    title = str(table.get("title", ""))
    chamber = None
    if "chamber" in table:
        needed = {f.name for f in fields(ChamberLimits)}
        chamber = read_record(ChamberLimits, "description.chamber", table["chamber"], needed)
    trust = None
    if "chamber_accuracy" in table:
        where = "description.chamber_accuracy"
        trust = read_record(ChamberAccuracy, where, table["chamber_accuracy"], {"place_sd_c"})
    source = None
    if "current_source" in table:
        source = read_record(CurrentSourceLimits, "description.current_source", table["current_source"], {"maximum_ma"})
    supply = None
    if "supply" in table:
        needed = {f.name for f in fields(SupplyLimits)}
        supply = read_record(SupplyLimits, "description.supply", table["supply"], needed)
    return BenchDescription(
        str(table["id"]),
        site,
        outer,
        middle,
        inner,
        accuracy,
        simulated=True,
        title=title,
        chamber=chamber,
        current_source=source,
        supply=supply,
        sinusoidal=_flag("description", "sinusoidal", table),
        chamber_accuracy=trust,
    )


def _axis(where: str, table: Any) -> AxisLimits:
    """Read an axis: four numbers, and whether it has slip rings; it has none where the key is absent."""
    continuous = _flag(where, "continuous", table) if isinstance(table, dict) else False
    numbers = {k: v for k, v in table.items() if k != "continuous"} if isinstance(table, dict) else table
    needed = {f.name for f in fields(AxisLimits)} - {"continuous"}
    return replace(read_record(AxisLimits, where, numbers, needed), continuous=continuous)


def _flag(where: str, key: str, table: Table) -> bool:
    """Read a key that is true or false; false where it is absent."""
    value = table.get(key, False)
    if not isinstance(value, bool):
        raise TruthError(f"{where}.{key} = {value!r} must be true or false")
    return value


def parse_bench(text: str) -> BenchTruth:
    """Parse a bench's truth from TOML text. Raises `TruthError`.

    Without `site_truth` the declared site is the true one; chamber and operator keep the defaults of the code where the
    text has no values. A `description` without a chamber is a bench without one.
    """
    document = read_document(text)
    check_keys("bench", document, {"description", *BENCH_TRUTHS}, {"description"})
    description = _description(document["description"])
    table = read_record(TableTruth, "table_truth", document.get("table_truth", {}), set())
    declared = description.site
    site = SiteTruth(declared.latitude_deg, declared.gravity_m_s2, declared.earth_rate_rad_s)
    if "site_truth" in document:
        site = read_record(SiteTruth, "site_truth", document["site_truth"], {"latitude_deg", "gravity_m_s2"})
    chamber = read_changes(ChamberTruth(), "chamber_truth", document.get("chamber_truth", {}))
    operator = read_changes(OperatorTruth(), "operator_truth", document.get("operator_truth", {}))
    source = read_changes(CurrentSourceTruth(), "current_source_truth", document.get("current_source_truth", {}))
    faults = _faults(document.get("chamber_faults", []))
    return BenchTruth(site, table, description, chamber, faults, operator, source)


def _faults(tables: Any) -> tuple[ChamberFault, ...]:
    """Read the named faults of the chamber, each with the bench time at which it begins."""
    if not isinstance(tables, list):
        raise TruthError(f"chamber_faults = {tables!r} must be a list of tables")
    found: list[ChamberFault] = []
    for index, table in enumerate(tables):
        where = f"chamber_faults[{index}]"
        if not isinstance(table, dict):
            raise TruthError(f"{where} = {table!r} must be a table")
        check_keys(where, table, {"name", "from_s"}, {"name", "from_s"})
        found.append(ChamberFault(str(table["name"]), within(f"{where}.from_s", table["from_s"], 0.0, 1e9)))
    return tuple(found)


def load_unit(path: Path) -> UnitTruth:
    """Load a unit's truth from a file."""
    return parse_unit(path.read_text(encoding="utf-8"))


def load_bench(path: Path) -> BenchTruth:
    """Load a bench's truth from a file."""
    return parse_bench(path.read_text(encoding="utf-8"))


@lru_cache(maxsize=1)
def default_unit() -> UnitTruth:
    """Return the shipped unit, "SIM-0001": always the same immutable value."""
    return parse_unit(_shipped("default_unit.toml"))


def default_bench() -> BenchTruth:
    """Return the shipped bench, "sim"."""
    return parse_bench(_shipped("default_bench.toml"))


def _shipped(name: str) -> str:
    return (files("simulators") / "truths" / name).read_text(encoding="utf-8")


def save_unit(truth: UnitTruth, path: Path) -> None:
    """Write a unit's truth; what `load_unit` reads back agrees to the last digit or two (units are converted)."""
    lines = [f"serial = {dumps(truth.serial)}", f"sample_rate_hz = {truth.sample_rate_hz!r}"]
    for name, keys in KEYS.items():
        lines += keyed_lines(name, truth.triad(name), keys)
    lines += thermal_lines(truth.thermal)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def save_bench(truth: BenchTruth, path: Path) -> None:
    """Write a bench's truth; `load_bench` reads back the same."""
    described = truth.description
    lines = ["[description]", f"id = {dumps(described.id)}", f"title = {dumps(described.title)}"]
    lines.append(f"sinusoidal = {str(described.sinusoidal).lower()}")
    sections: dict[str, Any] = {
        "description.site": described.site,
        "description.outer": described.outer,
        "description.middle": described.middle,
        "description.inner": described.inner,
        "description.accuracy": described.accuracy,
        **({} if described.chamber is None else {"description.chamber": described.chamber}),
        **({} if described.chamber_accuracy is None else {"description.chamber_accuracy": described.chamber_accuracy}),
        **({} if described.current_source is None else {"description.current_source": described.current_source}),
        **({} if described.supply is None else {"description.supply": described.supply}),
        "site_truth": truth.site,
        "table_truth": truth.table,
        "chamber_truth": truth.chamber,
        "operator_truth": truth.operator,
        "current_source_truth": truth.current_source,
    }
    for name, record in sections.items():
        lines += record_lines(name, record)
    for fault in truth.chamber_faults:
        lines += ["", "[[chamber_faults]]", f"name = {dumps(fault.name)}", f"from_s = {fault.from_s!r}"]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
