"""Decisions about calibrations by people whom the service knows: the proved name counts, whatever the request says."""

from pathlib import Path

from tests.kit.people import house

ENTRY = {
    "triad": "gyro",
    "origin": "nominal",
    "by": "somebody else",
    "coefficients": [{"name": f"b_{a}", "value": 0.0, "unit": "deg/h", "standard_uncertainty": 1.0} for a in "xyz"]
    + [
        {"name": f"K{i}{j}", "value": float(i == j), "unit": "1", "standard_uncertainty": 0.01}
        for i in (1, 2, 3)
        for j in (1, 2, 3)
    ],
}


def test_a_proved_name_is_kept_as_proved(tmp_path: Path) -> None:
    with house(tmp_path) as home, home.program("calibrator", "engineer") as http:
        made = http.post("/api/v1/units/SIM-0001/calibrations", json=ENTRY)
        assert made.status_code == 201, made.text
        (entered,) = made.json()["decisions"]
        assert (entered["by"], entered["proven"]) == ("calibrator", True)
        path = f"/api/v1/units/SIM-0001/calibrations/{made.json()['id']}/reject"
        rejected = http.post(path, json={"remark": "no"}).json()
        assert (rejected["decisions"][-1]["by"], rejected["decisions"][-1]["proven"]) == ("calibrator", True)
