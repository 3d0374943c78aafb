"""A unit that the service knows by its logs alone: CSV files of six channels, the noise found in them, its exports."""

import numpy as np

from tests.service.client import Client

RATE_HZ = 100.0
COLUMNS = {"a": ("accelerometer", "specific_force", "m/s^2"), "g": ("gyro", "angular_rate", "rad/s")}
"""Triad, quantity and unit of a column, by its first letter."""
SIX = ("ax", "ay", "az", "gx", "gy", "gz")


def imported(client: Client, unit: str, values: np.ndarray, names: tuple[str, ...] = SIX) -> str:
    """Import values (n, columns) as a CSV file with a column of time; the recording's id."""
    rows = np.column_stack([np.arange(len(values)) / RATE_HZ, values])
    text = "\n".join([",".join(["t", *names]), *(",".join(repr(float(x)) for x in row) for row in rows)]) + "\n"
    channels = []
    for name in names:
        triad, quantity, size = COLUMNS[name[0]]
        channels.append({"name": f"{triad}_{name[1]}", "column": name, "quantity": quantity, "unit": size})
    description = {"unit": unit, "rate_hz": RATE_HZ, "time_column": "t", "time_unit": "s", "channels": channels}
    answer = client.import_files(description, text.encode())
    assert answer.status_code == 201, answer.text
    return answer.json()["id"]


def found_noise(client: Client, recording: str) -> dict[str, float]:
    """Random walks by channel, as the service finds them."""
    answer = client.analyse("noise_analysis", recordings=[recording])
    assert answer.status_code == 201, answer.text
    channels = answer.json()["document"]["launches"][0]["channels"]
    return {c["channel"]: c["coefficients"][1]["likelihood"]["value"] for c in channels}  # Q, N, B, K, R


def declare_noise(client: Client, unit: str, walks: dict[str, float]) -> None:
    """Put random walks into the unit's record."""
    record = {
        triad: {
            "noise": [{"random_walk": walks[f"{triad}_{axis}"]} for axis in "xyz"],
            "noise_origin": "noise_analysis",
        }
        for triad, _, _ in COLUMNS.values()
    }
    known = client.http.get(f"/api/v1/units/{unit}").json()
    body = {"sample_rate_hz": RATE_HZ, "channels": known["channels"], **record}
    answer = client.http.put(f"/api/v1/units/{unit}", json=body)
    assert answer.status_code == 200, answer.text


def exported(client: Client, unit: str, accelerometers: str, gyros: str, form: str) -> str:
    """Text of the export of two calibrations, by their ids."""
    path = f"/api/v1/units/{unit}/calibrations/{accelerometers}/export"
    answer = client.http.get(path, params={"format": form, "other": gyros})
    assert answer.status_code == 200, answer.text
    return answer.text
