"""Certificates of a hundred random units: two validators, two verifiers, one changed digit, the database's numbers.

    python -m tests.validation.certificates [--units 100]

Random coefficients of both triads are entered into a service, each with a standard uncertainty of its own. Those of one
triad, gyros and accelerometers in turn, come back as the JSON of the export; of every second pair of units its
covariance is then a full one, by chance. The certificate of each unit must be valid by lxml and by xmlschema (where
the schema is in ../shared/data/dcc) and by our rules, its signature by signxml and by xmlsec; with one digit of one
value changed, by chance, both must refuse it. Coefficients and variances of the certificate are compared with the
numbers that SQLite gives for the stored rows: as floating-point numbers, bit by bit. Exit code 1 where one of these
fails. About two minutes.
"""

import argparse
import json
import re
import sqlite3
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import xmlschema
import xmlsec

from bench_service.cli.asking.client import connect
from bench_service.formats.certificate.document import certificate
from bench_service.formats.certificate.errors import CertificateRefused
from bench_service.formats.certificate.laboratory import laboratory_of
from bench_service.formats.certificate.rules import faults, schema_faults
from bench_service.formats.certificate.signature import KeyPair, new_key, parsed, signed, verified
from bench_service.settings import Settings
from procedures.core.imu_model import COEFFICIENT_NAMES, coefficient_unit
from tests.kit.certificate_facts import TEXT
from tests.kit.certificate_readers import SCHEMA, by_xmlsec, numbers_of
from tests.kit.exported_calibrations import UNITS


def _entered(http: Any, unit: str, rng: np.random.Generator) -> list[str]:
    """Enter both triads of a new unit by chance; their ids."""
    gyro = {"name": "gyro_x", "quantity": "angular_rate", "unit": "rad/s"}
    described = {"unit": unit, "rate_hz": 10.0, "channels": [gyro]}
    form = {"description": json.dumps(described)}
    http.post(  # a unit is known once something of it is stored
        "/api/v1/recordings", files={"files": ("a.csv", b"gyro_x\n0.1\n0.2\n")}, data=form
    ).raise_for_status()
    ids: list[str] = []
    for triad, si in UNITS.items():
        k = np.diag(1.0 + rng.uniform(-0.02, 0.02, 3)) + rng.uniform(-0.01, 0.01, (3, 3))
        values = np.column_stack([rng.uniform(-0.1, 0.1, 3), k]).ravel()
        rows = [
            {"name": n, "value": v, "unit": coefficient_unit(n, si, si), "standard_uncertainty": u}
            for n, v, u in zip(COEFFICIENT_NAMES, values.tolist(), rng.uniform(1e-7, 1e-4, 12).tolist(), strict=True)
        ]
        body = {"triad": triad, "origin": "passport", "coefficients": rows}
        answer = http.post(f"/api/v1/units/{unit}/calibrations", json=body)
        answer.raise_for_status()
        ids.append(answer.json()["id"])
    return ids


def _correlated(text: str, rng: np.random.Generator) -> str:
    """Give an export a full covariance with its own variances."""
    document = json.loads(text)
    for triad in document["triads"]:
        root = rng.normal(size=(12, 24))
        product = root @ root.T
        roots = np.sqrt(np.diag(product))
        correlation = product / np.outer(roots, roots)
        deviations = np.sqrt(np.diag(np.array(triad["covariance"]["matrix"])))
        matrix = correlation * np.outer(deviations, deviations)
        matrix = (matrix + matrix.T) / 2.0
        np.fill_diagonal(matrix, np.diag(np.array(triad["covariance"]["matrix"])))
        triad["covariance"]["matrix"] = matrix.tolist()
    return json.dumps(document)


def _changed(data: bytes, rng: np.random.Generator) -> bytes:
    """Change one digit of one value, by chance."""
    lists = list(re.finditer(rb"<si:valueXMLList>([^<]+)<", data))
    one = lists[int(rng.integers(len(lists)))]
    digits = [i for i in range(one.start(1), one.end(1)) if data[i : i + 1].isdigit()]
    at = digits[int(rng.integers(len(digits)))]
    return data[:at] + str((int(data[at : at + 1]) + 1) % 10).encode() + data[at + 1 :]


def _refusals(data: bytes, pair: KeyPair) -> list[str]:
    """Name the verifiers that refuse a certificate."""
    refused: list[str] = []
    try:
        verified(data, pair.certificate)
    except CertificateRefused:
        refused.append("signxml")
    try:
        by_xmlsec(data, pair)
    except xmlsec.Error:
        refused.append("xmlsec")
    return refused


def _of_certificate(root: Any) -> list[tuple[list[float], list[float]]]:
    """Coefficients and variances of each triad, as the certificate's digits say."""
    return [([float(w) for w in words], [cells[i][i] for i in range(12)]) for words, cells in numbers_of(root)]


def _of_database(books: sqlite3.Connection, calibration: str) -> tuple[list[float], list[float]]:
    """Coefficients and variances of stored rows."""
    asked = "SELECT value, standard_uncertainty FROM coefficients WHERE calibration_id = ? ORDER BY position"
    rows = books.execute(asked, (calibration,)).fetchall()
    return [value for value, _ in rows], [u**2 for _, u in rows]


def main() -> int:
    """Count what held; 0 where everything held for every unit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--units", type=int, default=100)
    units = parser.parse_args().units
    rng = np.random.default_rng(41)
    pair, laboratory, held = new_key("Bench Lab"), laboratory_of(TEXT), Counter[str]()
    schema = xmlschema.XMLSchema(str(SCHEMA / "v3.3.0" / "dcc.xsd")) if SCHEMA.is_dir() else None
    if schema is None:
        print("the schema's files are not here: neither validator is asked")
    with tempfile.TemporaryDirectory(prefix="certificates-") as folder:
        file = Path(folder) / "bench.sqlite"
        settings = Settings(database_url=f"sqlite:///{file}", device_folder=Path(folder) / "devices")
        with connect(settings, None, drive=False) as http:
            for number in range(units):
                unit = f"U-{number:03}"
                one = _entered(http, unit, rng)[number % 2]
                text = http.get(f"/api/v1/units/{unit}/calibrations/{one}/export", params={"format": "json"}).text
                if number % 4 > 1:
                    text = _correlated(text, rng)
                data = signed(certificate(json.loads(text), text, laboratory, "1.2.3"), pair)
                root = parsed(data)
                with sqlite3.connect(file) as books:
                    held["numbers are the database's"] += _of_certificate(root) == [_of_database(books, one)]
                held["our rules"] += faults(root) == []
                held["both verifiers accept"] += _refusals(data, pair) == []
                held["both refuse a changed digit"] += len(_refusals(_changed(data, rng), pair)) == 2
                if schema is not None:
                    held["valid by lxml"] += schema_faults(root, SCHEMA) == []
                    held["valid by xmlschema"] += schema.is_valid(data.decode())
    for what, count in held.items():
        print(f"{what:30} {count:4d} of {units}")
    return any(count != units for count in held.values())


if __name__ == "__main__":
    sys.exit(main())
