"""One recording in many writings: the same means from each, or a refusal that names the way out."""

from typing import Any

import numpy as np
import pytest

from tests.cases.tables import chance, read, refusal, samples, table, triad

RATE_HZ, ROWS = 202.7, 1500
NAMES = ["Time (s)", "Acceleration x (m/s^2)", "Acceleration y (m/s^2)", "Acceleration z (m/s^2)"]
VALUES = (chance(10).normal(0.0, 0.02, (ROWS, 3)) + np.array([0.30, -0.12, 9.79])).round(6)
ROWS_OF_TEXT = [[f"{i / RATE_HZ:.9E}", *(f"{v:.9E}" for v in row)] for i, row in enumerate(VALUES)]
WITH_COMMA = [[cell.replace(".", ",") for cell in row] for row in ROWS_OF_TEXT]
QUOTED = [f'"{name}"' for name in NAMES]
ASKED: dict[str, Any] = {"time_column": NAMES[0], "channels": triad("accelerometer", NAMES[1:], "m/s^2")}
DRESSES: dict[str, tuple[bytes, dict[str, Any]]] = {
    "tab and comma": (table(QUOTED, WITH_COMMA, "\t").encode(), {"delimiter": "tab", "decimal": ","}),
    "semicolon and comma": (table(QUOTED, WITH_COMMA, ";").encode(), {"delimiter": ";", "decimal": ","}),
    "semicolon and point": (table(QUOTED, ROWS_OF_TEXT, ";").encode(), {"delimiter": ";"}),
    "comma and point": (table(QUOTED, ROWS_OF_TEXT).encode(), {}),
    "every cell quoted": (table(QUOTED, [[f'"{c}"' for c in row] for row in ROWS_OF_TEXT]).encode(), {}),
    "a mark and CR LF": (b"\xef\xbb\xbf" + table(NAMES, ROWS_OF_TEXT, end="\r\n").encode(), {}),
    "CR alone": (table(NAMES, ROWS_OF_TEXT, end="\r").encode(), {}),
    "UTF-16 with a mark": (table(NAMES, ROWS_OF_TEXT).encode("utf-16"), {}),
    "UTF-16, big end first": (b"\xfe\xff" + table(NAMES, ROWS_OF_TEXT).encode("utf-16-be"), {}),
    "UTF-16 without a mark": (table(NAMES, ROWS_OF_TEXT).encode("utf-16-le"), {}),
    "a delimiter at each end": (table(NAMES, [[*row, ""] for row in ROWS_OF_TEXT]).encode(), {}),
    "blanks": (
        table(["t", "x", "y", "z"], [["  ", *row, " "] for row in WITH_COMMA], "   ").encode(),
        {"delimiter": "whitespace", "decimal": ",", "time_column": "t"}
        | {"channels": triad("accelerometer", ["x", "y", "z"], "m/s^2")},
    ),
}


@pytest.mark.parametrize("dress", DRESSES)
def test_the_same_recording_from_each(dress: str) -> None:
    data, changes = DRESSES[dress]
    recording = read(data, **{**ASKED, **changes})
    # Stamps are rounded to 1e-9 of themselves over 7.4 s.
    assert recording.rate_hz == pytest.approx(RATE_HZ, rel=1e-8)
    np.testing.assert_allclose(samples(recording), VALUES, rtol=1e-8)


def test_axes_are_taken_by_name_whatever_their_order() -> None:
    rows = [(i, *row[::-1]) for i, row in enumerate(VALUES)]
    text = table(["n", "z", "y", "x"], rows)
    recording = read(text, rate_hz=RATE_HZ, channels=triad("accelerometer", ["x", "y", "z"], "m/s^2"))
    np.testing.assert_array_equal(samples(recording), VALUES)


def test_a_decimal_comma_is_named() -> None:
    text = table(NAMES, WITH_COMMA, ";")
    assert 'a decimal comma: decimal = "," reads it' in refusal(text, **ASKED, delimiter=";")
    assert 'a decimal point: decimal = "." reads it' in refusal(
        table(NAMES, ROWS_OF_TEXT, ";"), **ASKED, delimiter=";", decimal=","
    )


def test_another_delimiter_is_suspected() -> None:
    words = refusal(table(NAMES, ROWS_OF_TEXT, ";"), **ASKED)
    assert "with the delimiter ';' there would be 4 columns: give delimiter = ';'" in words


def test_the_width_of_most_lines_is_the_law() -> None:
    cut = "12.5,0.1\n" + "\n".join("1,2,3,4" for _ in range(9)) + "\n"
    asked = {"rate_hz": 100.0, "header": False, "channels": triad("accelerometer", [1, 2, 3], "m/s^2")}
    words = refusal(cut, **asked)
    assert "line 1 has 2 columns, most lines have 4" in words
    assert "header_lines = 1 leaves it out" in words
    assert read(cut, **asked, header_lines=1).count == 9
    middle = "t,x,y,z\n" + "1,2,3,4\n" * 5 + "1,2\n" + "1,2,3,4\n" * 5
    named = {"rate_hz": 100.0, "channels": triad("accelerometer", ["x", "y", "z"], "m/s^2")}
    assert "line 7 has 2 columns, 4 were expected" in refusal(middle, **named)
    assert read(middle, **named, rows={"first": 7}).count == 5
    assert read(middle, **named, rows={"last": 5}).count == 5
    headless = "some words of a maker\n" + middle
    assert "line 1 has 1 names, most lines have 4 columns" in refusal(headless, **named)


@pytest.mark.parametrize(
    ("unit", "scale", "zero"),
    [("mg", 9.80665e-3, 0.0), ("g", 9.80665, 0.0), ("ug", 9.80665e-6, 0.0), ("m/s2", 1.0, 0.0)],
)
def test_units_of_data_sheets(unit: str, scale: float, zero: float) -> None:
    text = table(["x", "y", "z"], [(1, 2, 3), (4, 5, 6)])
    channels = triad("accelerometer", ["x", "y", "z"], unit, scale=0.5, offset=zero)
    channel = read(text, rate_hz=100.0, channels=channels).channels[0]
    assert (channel.unit, channel.scale) == ("m/s^2", pytest.approx(0.5 * scale, rel=1e-15))


@pytest.mark.parametrize(("unit", "raw", "celsius"), [("K", 293.15, 20.0), ("degF", 68.0, 20.0), ("°C", 20.0, 20.0)])
def test_units_of_temperature(unit: str, raw: float, celsius: float) -> None:
    column = {"name": "temperature_gyro_x", "column": "k", "quantity": "temperature", "unit": unit, "scale": 0.01}
    channel = read(table(["k"], [(raw * 100,), (raw * 100,)]), rate_hz=1.0, channels=[column]).channels[0]
    assert channel.unit == "degC"
    assert channel.scale * (raw * 100 - channel.offset) == pytest.approx(celsius, abs=1e-9)
