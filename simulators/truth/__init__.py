"""True values of the simulated world, the files that hold them, and random numbers keyed by seed."""

from simulators.truth.chance import KeyedBlocks, keyed_generator
from simulators.truth.data_sheet import declared_unit, temperature_channels, unit_channels
from simulators.truth.files import (
    default_bench,
    default_unit,
    load_bench,
    load_unit,
    save_bench,
    save_unit,
)
from simulators.truth.population import random_table_truth, random_unit_truth
from simulators.truth.ranges import Array, TruthError, Vector
from simulators.truth.values import (
    BenchTruth,
    CurrentSourceTruth,
    OperatorTruth,
    SiteTruth,
    TableTruth,
    TriadTruth,
    UnitTruth,
)

__all__ = [
    "Array",
    "BenchTruth",
    "CurrentSourceTruth",
    "KeyedBlocks",
    "OperatorTruth",
    "SiteTruth",
    "TableTruth",
    "TriadTruth",
    "TruthError",
    "UnitTruth",
    "Vector",
    "declared_unit",
    "default_bench",
    "default_unit",
    "keyed_generator",
    "load_bench",
    "load_unit",
    "random_table_truth",
    "random_unit_truth",
    "save_bench",
    "save_unit",
    "temperature_channels",
    "unit_channels",
]
