"""Inertial analysis at a prompt, without the service: ``import procedures.library as inertial``.

======================================  ==================================================================
``allan(y, rate_hz)``                   Allan, modified Allan, time or Hadamard deviation with intervals
``allan_family(y, rate_hz)``            all of them in one pass
``noise(y, rate_hz)``                   noise coefficients Q, N, B, K, R of a record at rest, three methods
``split(y, rate_hz)``                   wavelet split of a record into slow and fast parts
``calibrate(outputs, vectors, sd)``     bias and matrix K of a triad from known vectors
``scalar(outputs, magnitude, sd)``      nine parameters of a triad from the magnitude alone
``thermal(temperature_c, values, ...)`` polynomial of a zero or a scale in temperature
``load(file)``                          columns of a CSV, .npy or .npz file
``load_calibration(file)``              a calibration that the service exported as JSON, to correct samples
======================================  ==================================================================

Samples are lists, numpy arrays or pandas series; every number comes with its standard uncertainty; every refusal is a
`DomainError` that names the argument and the way out. Results have ``plot()`` where matplotlib is installed.

Nothing but numpy is imported until a function is asked for: scipy alone would double the time of the import.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from procedures.core.errors import BadParameter, DomainError, Undetermined, UnfitRecording
    from procedures.library.columns import Columns, load
    from procedures.library.deviations import Curve, allan, allan_family
    from procedures.library.exported import ExportedCalibration, load_calibration
    from procedures.library.record_noise import Noise, noise
    from procedures.library.temperature import Polynomial, thermal
    from procedures.library.triads import Calibration, calibrate, scalar
    from procedures.library.wavelets import Split, split

__version__ = "0.1.0"
"""Semantic version: a function or field of `__all__` changes its meaning with the first number only."""

_ROOMS = {
    "core.errors": ("BadParameter", "DomainError", "Undetermined", "UnfitRecording"),
    "library.deviations": ("Curve", "allan", "allan_family"),
    "library.exported": ("ExportedCalibration", "load_calibration"),
    "library.triads": ("Calibration", "calibrate", "scalar"),
    "library.columns": ("Columns", "load"),
    "library.record_noise": ("Noise", "noise"),
    "library.wavelets": ("Split", "split"),
    "library.temperature": ("Polynomial", "thermal"),
}
_HOME = {name: room for room, names in _ROOMS.items() for name in names}

__all__ = [
    "BadParameter",
    "Calibration",
    "Columns",
    "Curve",
    "DomainError",
    "ExportedCalibration",
    "Noise",
    "Polynomial",
    "Split",
    "Undetermined",
    "UnfitRecording",
    "allan",
    "allan_family",
    "calibrate",
    "load",
    "load_calibration",
    "noise",
    "scalar",
    "split",
    "thermal",
]


def __getattr__(name: str) -> Any:
    """Import the module of a public name when it is first asked for. Raises `AttributeError`."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}; it has {', '.join(__all__)}")
    return getattr(import_module(f"procedures.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
