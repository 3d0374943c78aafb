"""Known coefficients that a test enters for the simulated unit."""

from procedures.core.imu_model import COEFFICIENT_NAMES, coefficient_unit
from tests.service.client import Client

PATH = "/api/v1/units/SIM-0001/calibrations"


def enter(client: Client, triad: str, **changes: object) -> dict:
    unit = {"gyro": "rad/s", "accelerometer": "m/s^2"}[triad]
    values = [0.01, 1.01, 0.002, 0.003, -0.02, 0.001, 0.99, 0.002, 0.03, 0.001, 0.004, 1.02]
    rows = [
        {"name": n, "value": x, "unit": coefficient_unit(n, unit, unit), "standard_uncertainty": 1e-5}
        for n, x in zip(COEFFICIENT_NAMES, values, strict=True)
    ]
    answer = client.http.post(PATH, json={"triad": triad, "origin": "passport 17", "coefficients": rows, **changes})
    assert answer.status_code == 201, answer.text
    return answer.json()
