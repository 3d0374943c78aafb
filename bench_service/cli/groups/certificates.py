"""``bench certificate``: keys of the laboratory, certificates of calibrations, and their check.

The key stays with whoever signs: it is read by this command and never sent to a service.
"""

import json
import os
from pathlib import Path
from typing import Annotated, Any

import typer

from bench_service.cli.asking.client import answer, connect, segment
from bench_service.cli.files import check_folder, text_of, whole_file
from bench_service.cli.options import AsJson, Server, console
from bench_service.cli.refusal import Refused

certificate = typer.Typer(no_args_is_help=True, help="Certificates of calibrations: DCC 3.3.0, signed.")

KEY_ENDING, CERTIFICATE_ENDING = ".key.pem", ".cert.pem"


@certificate.command("key")
def key(
    name: Annotated[str, typer.Argument(help="Name of the laboratory, as the certificate of the key states it")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Begin of the names: lab gives lab.key.pem, …")],
) -> None:
    """Make a key for signatures, and its certificate, which is given to whoever checks."""
    from bench_service.formats.certificate.signature import new_key

    private, public = (output.with_name(output.name + ending) for ending in (KEY_ENDING, CERTIFICATE_ENDING))
    check_folder(private)
    for file in (private, public):
        if file.exists():
            raise Refused(f"{file} exists: a key is never written over, name another one")
    pair = new_key(name)
    try:
        with os.fdopen(os.open(private, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as sink:
            sink.write(pair.key)
    except OSError as error:
        raise Refused(f"{private} cannot be written: {error.strerror}") from error
    with whole_file(public) as sink:
        sink.write(pair.certificate)
    console.print(f"{private}: the key, for its owner alone, without a password", soft_wrap=True)
    console.print(f"{public}: its certificate, for whoever checks", soft_wrap=True)


@certificate.command("make")
def make(
    context: typer.Context,
    unit: str,
    calibration_id: str,
    laboratory: Annotated[Path, typer.Option(help="TOML: identifier, laboratory, customer, people, equipment")],
    key_file: Annotated[Path, typer.Option("--key", help="The laboratory's lab.key.pem; lab.cert.pem is beside it")],
    output: Annotated[Path, typer.Option("--output", "-o", help="File to write")],
    other: Annotated[str | None, typer.Option(help="Calibration of the other triad")] = None,
    server: Server = None,
) -> None:
    """Make the signed certificate of a calibration, with our JSON of it attached."""
    from bench_service.formats.certificate.document import certificate as made
    from bench_service.formats.certificate.errors import CertificateRefused
    from bench_service.formats.certificate.laboratory import laboratory_of
    from bench_service.formats.certificate.rules import faults
    from bench_service.formats.certificate.signature import KeyPair, signed
    from bench_service.telemetry.code_version import code_version

    check_folder(output)
    public = key_file.with_name(key_file.name.removesuffix(KEY_ENDING) + CERTIFICATE_ENDING)
    try:
        facts = laboratory_of(text_of(laboratory))
        pair = KeyPair(key_file.read_bytes(), public.read_bytes())
        query = {"format": "json"} if other is None else {"format": "json", "other": other}
        path = f"/api/v1/units/{segment(unit)}/calibrations/{segment(calibration_id)}/export"
        with connect(context.obj, server, drive=False) as client:
            text = answer(client, "GET", path, params=query).text
        document: dict[str, Any] = json.loads(text)
        root = made(document, text, facts, code_version())
        wrong = faults(root)
        if wrong:
            raise Refused(f"this calibration gives no certificate: {'; '.join(wrong)}")
        data = signed(root, pair)
    except CertificateRefused as error:
        raise Refused(str(error)) from error
    except OSError as error:
        raise Refused(f"{error.filename} cannot be read: {error.strerror}") from error
    with whole_file(output) as sink:
        sink.write(data)
    console.print(f"{output}: {len(data)} bytes", soft_wrap=True)


@certificate.command("check")
def check(
    file: Annotated[Path, typer.Argument(help="The certificate")],
    pinned: Annotated[Path, typer.Option("--certificate", help="The laboratory's lab.cert.pem, got from itself")],
    schema: Annotated[Path | None, typer.Option(help="Folder of the schema, with v3.3.0/dcc.xsd")] = None,
    as_json: AsJson = False,
) -> None:
    """Check signature, structure and numbers of a certificate; with --schema its schema too."""
    from bench_service.formats.certificate.errors import CertificateRefused
    from bench_service.formats.certificate.rules import attached, faults, schema_faults
    from bench_service.formats.certificate.signature import parsed, verified

    try:
        data = file.read_bytes()
        root, signer = verified(data, pinned.read_bytes())
        wrong = faults(root) + ([] if schema is None else schema_faults(parsed(data), schema))
        if wrong:
            raise Refused(f"{file} is signed by {signer} and unchanged, but wrong: {'; '.join(wrong)}")
        document = attached(root)
    except CertificateRefused as error:
        raise Refused(f"{file}: {error}") from error
    except OSError as error:
        raise Refused(f"{error.filename} cannot be read: {error.strerror}") from error
    facts = {
        "valid": True,
        "signed_by": signer,
        "unit": document["unit"],
        "calibrations": [triad["calibration"] for triad in document["triads"]],
        "schema_checked": schema is not None,
        "raw_data_checked": False,
    }
    if as_json:
        print(json.dumps(facts, indent=2))
        return
    console.print(f"{file}: valid, unchanged, signed by {signer}", soft_wrap=True)
    calibrations = ", ".join(triad["calibration"] for triad in document["triads"])
    console.print(f"unit {facts['unit']}, calibrations {calibrations}", soft_wrap=True)
    console.print("schema: " + ("valid" if schema else "not checked, see --schema"), soft_wrap=True)
    console.print("raw data: not analysed again; their hashes are in the certificate", soft_wrap=True)
