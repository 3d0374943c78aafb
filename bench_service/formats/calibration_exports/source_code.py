"""Generated functions that apply a calibration: C99 and Python, without a library."""

import re

from bench_service.formats.calibration_exports.algebra import inverse_model
from bench_service.formats.calibration_exports.subject import CalibrationSubject, TriadExport, commented
from procedures.core.arrays import Array

C_FUNCTION = """
/* {triad}: {output} -> {input}, ONE sample a call: of a longer array only its first three numbers are read.
   u and v may be the same array. Samples in rows: for (i = 0; i < n; i++) correct_{triad}(u[i], v[i]); */
static const double {triad}_bias[3] = {{{bias}}};
static const double {triad}_inverse[3][3] = {{
{rows}
}};

static void correct_{triad}(const double u[3], double v[3]) {{
    const double x = u[0] - {triad}_bias[0], y = u[1] - {triad}_bias[1], z = u[2] - {triad}_bias[2];
    for (int i = 0; i < 3; i++) {{
        v[i] = {triad}_inverse[i][0] * x + {triad}_inverse[i][1] * y + {triad}_inverse[i][2] * z;
    }}
}}
"""
PYTHON_HEAD = """

def _corrected(u, bias, inverse):
    # One sample is a tuple of three numbers; several are a list of samples, or an array whose last axis has length 3.
    shape = getattr(u, "shape", None)
    if shape is None and len(u) == 3 and not any(hasattr(one, "__len__") for one in u):
        x, y, z = (one - zero for one, zero in zip(u, bias))
        return tuple(row[0] * x + row[1] * y + row[2] * z for row in inverse)
    if shape is None and len(u) > 0 and all(hasattr(one, "__len__") and len(one) == 3 for one in u):
        return [_corrected(one, bias, inverse) for one in u]
    if shape is None or len(shape) == 0 or shape[-1] != 3:
        found = f"{len(u)} values" if shape is None else f"the shape {tuple(shape)}"
        raise ValueError(f"u has {found}; it must be one sample (x, y, z) or samples in rows, shape (n, 3)")
    return (u - list(bias)) @ [list(column) for column in zip(*inverse)]
"""
PYTHON_FUNCTION = '''

{upper}_BIAS = ({bias})
{upper}_INVERSE = (
{rows}
)


def correct_{triad}(u):
    """Correct nominal outputs [{output}] to inputs [{input}].

    u is one sample (x, y, z), and a tuple of three comes back; or samples in rows, a list of samples or a numpy array
    of the shape (n, 3), and as many rows come back. Of a square array of three samples each ROW is a sample. Any other
    shape is a ValueError.
    """
    return _corrected(u, {upper}_BIAS, {upper}_INVERSE)
'''
MODEL = "v = A*(U - b), A the inverse of K; U is the nominal output scale*(raw - offset), increments over the period"


def c_source(subject: CalibrationSubject) -> str:
    """Return a C99 header with one function a triad: ``correct_gyro(u, v)`` and ``correct_accelerometer(u, v)``."""
    of_these = "_".join(t.id for t in subject.triads)  # a header of other calibrations must collide, not be left out
    guard = "CALIBRATION_" + re.sub(r"[^A-Z0-9]", "_", f"{subject.unit}_{of_these}".upper())
    head = [f"/* {line.replace('*/', '* /')} */" for line in (*subject.remarks(), MODEL)]
    functions = [C_FUNCTION.format(**_numbers(t, "    {%s}", ",\n")) for t in subject.triads]
    return "\n".join([*head, f"#ifndef {guard}", f"#define {guard}"]) + "\n" + "".join(functions) + "\n#endif\n"


def python_source(subject: CalibrationSubject) -> str:
    """Return a Python module with one function a triad, for one sample or for samples in rows; it imports nothing."""
    head = "\n".join(commented(subject, "#", MODEL))
    rows = "    (%s),"
    return (
        head + "\n" + PYTHON_HEAD + "".join(PYTHON_FUNCTION.format(**_numbers(t, rows, "\n")) for t in subject.triads)
    )


def _numbers(one: TriadExport, row: str, between: str) -> dict[str, str]:
    """Numbers of a triad as text that reads back to the same bits."""
    inverse: Array = inverse_model(one.value).matrix
    return {
        "triad": one.triad,
        "upper": one.triad.upper(),
        "output": one.value.output_unit,
        "input": one.value.input_unit,
        "bias": ", ".join(map(repr, one.value.bias)),
        "rows": between.join(row % ", ".join(map(repr, line)) for line in inverse.tolist()),
    }
