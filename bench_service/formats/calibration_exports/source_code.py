"""Generated functions that apply a calibration: C99 and Python, without a library."""

import re

from bench_service.formats.calibration_exports.algebra import inverse_model
from bench_service.formats.calibration_exports.subject import CalibrationSubject, TriadExport, commented
from procedures.core.arrays import Array

C_FUNCTION = """
/* {triad}: {output} -> {input}; u and v may be the same array. */
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
PYTHON_FUNCTION = '''

{upper}_BIAS = ({bias})
{upper}_INVERSE = (
{rows}
)


def correct_{triad}(u):
    """Correct one nominal output (x, y, z) [{output}]; returns (x, y, z) [{input}]."""
    x, y, z = (u[i] - {upper}_BIAS[i] for i in range(3))
    return tuple(row[0] * x + row[1] * y + row[2] * z for row in {upper}_INVERSE)
'''
MODEL = "v = A*(U - b), A the inverse of K; U is the nominal output scale*(raw - offset), increments over the period"


def c_source(subject: CalibrationSubject) -> str:
    """Return a C99 header with one function a triad: ``correct_gyro(u, v)`` and ``correct_accelerometer(u, v)``."""
    guard = "CALIBRATION_" + re.sub(r"[^A-Z0-9]", "_", subject.unit.upper())
    head = [f"/* {line.replace('*/', '* /')} */" for line in (*subject.remarks(), MODEL)]
    functions = [C_FUNCTION.format(**_numbers(t, "    {%s}", ",\n")) for t in subject.triads]
    return "\n".join([*head, f"#ifndef {guard}", f"#define {guard}"]) + "\n" + "".join(functions) + "\n#endif\n"


def python_source(subject: CalibrationSubject) -> str:
    """Return a Python module with one function a triad; it imports nothing."""
    head = "\n".join(commented(subject, "#", MODEL))
    rows = "    (%s),"
    return head + "".join(PYTHON_FUNCTION.format(**_numbers(t, rows, "\n")) for t in subject.triads)


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
