"""``bench certificate``: keys of the laboratory, certificates of calibrations, and their check.

The key stays with the signer: it is read by this command and never sent to a service.
"""

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bench_service.cli.asking.client import answer, call, connect, segment
from bench_service.cli.files import check_folder, text_of, whole_file
from bench_service.cli.options import AsJson, Server, console
from bench_service.cli.refusal import Refused
from bench_service.settings import Settings

if TYPE_CHECKING:
    from bench_service.formats.certificate.laboratory import Laboratory
    from bench_service.formats.certificate.recomputed import Repeated
    from bench_service.formats.certificate.signature import KeyPair

certificate = typer.Typer(no_args_is_help=True, help="Certificates of calibrations: DCC 3.3.0, signed.")

KEY_ENDING, CERTIFICATE_ENDING = ".key.pem", ".cert.pem"
PRINTED_XML = "certificate.xml"
"""Name of the certificate inside its printed form."""


@certificate.command("key")
def key(
    name: Annotated[str, typer.Argument(help="Name of the laboratory, as the certificate of the key states it")],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Beginning of the file names: lab gives lab.key.pem, …")
    ],
) -> None:
    """Make a key for signatures, and its certificate, which is given to those who check."""
    from bench_service.formats.certificate.signature import new_key

    private, public = (output.with_name(output.name + ending) for ending in (KEY_ENDING, CERTIFICATE_ENDING))
    check_folder(private)
    for file in (private, public):
        if file.exists():
            raise Refused(f"{file} exists: a key is never overwritten; choose another name")
    pair = new_key(name)
    try:
        with os.fdopen(os.open(private, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as sink:
            sink.write(pair.key)
    except OSError as error:
        raise Refused(f"{private} cannot be written: {error.strerror}") from error
    with whole_file(public) as sink:
        sink.write(pair.certificate)
    console.print(f"{private}: the key, for its owner alone, without a password", soft_wrap=True)
    console.print(f"{public}: its certificate, for those who check", soft_wrap=True)


@certificate.command("make")
def make(
    context: typer.Context,
    unit: str,
    calibration_id: str,
    laboratory: Annotated[Path, typer.Option(help="TOML: identifier, laboratory, customer, people, equipment")],
    key_file: Annotated[
        Path, typer.Option("--key", help="The laboratory's lab.key.pem; lab.cert.pem is in the same folder")
    ],
    output: Annotated[Path, typer.Option("--output", "-o", help="File to write, .xml")],
    pdf: Annotated[Path | None, typer.Option(help="Print it to this file too: PDF/A-3 with the XML inside")] = None,
    failed: Annotated[bool, typer.Option("--failed", help="Also of a calibration that failed; it says so")] = False,
    other: Annotated[str | None, typer.Option(help="Calibration of the other triad")] = None,
    server: Server = None,
) -> None:
    """Make the signed certificate of a calibration, with our JSON of it attached."""
    from bench_service.formats.certificate.errors import CertificateRefused
    from bench_service.formats.certificate.laboratory import laboratory_of
    from bench_service.formats.certificate.signature import KeyPair

    for file in filter(None, (output, pdf)):
        check_folder(file)
    public = key_file.with_name(key_file.name.removesuffix(KEY_ENDING) + CERTIFICATE_ENDING)
    printed: bytes | None = None
    try:
        facts = laboratory_of(text_of(laboratory))
        pair = KeyPair(key_file.read_bytes(), public.read_bytes())
        query = {"format": "json"} if other is None else {"format": "json", "other": other}
        path = f"/api/v1/units/{segment(unit)}/calibrations"
        with connect(context.obj, server, drive=False) as client:
            text = answer(client, "GET", f"{path}/{segment(calibration_id)}/export", params=query).text
            data = _signed(text, facts, pair, failed)
            if pdf is not None:
                body = {"certificate": data.decode()}
                printed = answer(client, "POST", f"{path}/certificate.pdf", json=body).content
    except CertificateRefused as error:
        raise Refused(str(error)) from error
    except OSError as error:
        raise Refused(f"{error.filename} cannot be read: {error.strerror}") from error
    for file, content in ((output, data), (pdf, printed)):
        if file is not None and content is not None:
            with whole_file(file) as sink:
                sink.write(content)
            console.print(f"{file}: {len(content)} bytes", soft_wrap=True)


def _signed(text: str, facts: "Laboratory", pair: "KeyPair", failed: bool) -> bytes:
    """The signed certificate of an exported calibration. Raises `CertificateRefused`, `Refused`."""
    from bench_service.formats.certificate.document import certificate as made
    from bench_service.formats.certificate.recomputed import require_issuable
    from bench_service.formats.certificate.rules import faults
    from bench_service.formats.certificate.signature import signed
    from bench_service.telemetry.code_version import code_version

    document: dict[str, Any] = json.loads(text)
    require_issuable(document, failed)
    root = made(document, text, facts, code_version())
    wrong = faults(root)
    if wrong:
        raise Refused(f"no certificate can be made of this calibration: {'; '.join(wrong)}")
    return signed(root, pair)


@certificate.command("check")
def check(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="The certificate: .xml, or .pdf with the XML inside")],
    pinned: Annotated[Path, typer.Option("--certificate", help="The laboratory's lab.cert.pem, got from itself")],
    schema: Annotated[Path | None, typer.Option(help="Folder of the schema, with v3.3.0/dcc.xsd")] = None,
    recompute: Annotated[
        bool | None,
        typer.Option(help="Analyse the raw data again; without it, where a service or a database here has them"),
    ] = None,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Check signature, structure and numbers of a certificate, and whether its raw data still give them."""
    from bench_service.formats.certificate.errors import CertificateRefused
    from bench_service.formats.certificate.rules import attached, faults, schema_faults
    from bench_service.formats.certificate.signature import parsed, verified

    try:
        data, printed = _xml_of(file)
        root, signer = verified(data, pinned.read_bytes())
        wrong = faults(root) + ([] if schema is None else schema_faults(parsed(data), schema))
        if wrong:
            raise Refused(f"{file} is signed by {signer} and unchanged, but wrong: {'; '.join(wrong)}")
        document = attached(root)
    except CertificateRefused as error:
        raise Refused(f"{file}: {error}") from error
    except OSError as error:
        raise Refused(f"{error.filename} cannot be read: {error.strerror}") from error
    wanted = _here(context.obj, server) if recompute is None else recompute
    repeated = _repeated(context.obj, server, document, recompute is None) if wanted else None
    same = None if repeated is None else all(one.same for one in repeated)
    facts = {
        "valid": True,
        "signed_by": signer,
        "unit": document["unit"],
        "calibrations": [triad["calibration"] for triad in document["triads"]],
        "schema_checked": schema is not None,
        "raw_data_checked": repeated is not None,
        "recomputed_same": same,
        "recomputed": {one.triad: one.sentence for one in repeated or ()},
    }
    if as_json:
        print(json.dumps(facts, indent=2))
    else:
        _say(f"{file}: the XML inside is" if printed else f"{file}:", facts, printed)
    if same is False:
        raise Refused(f"{file} is signed by {signer} and unchanged, but its raw data no longer give its numbers")


def _xml_of(file: Path) -> tuple[bytes, bool]:
    """The XML of a certificate, and whether it was inside a PDF. Raises `Refused`, `OSError`."""
    from bench_service.formats.printed.attached import BEGINS, UnreadablePdf, attached_files

    data = file.read_bytes()
    if not data.startswith(BEGINS):
        return data, False
    try:
        found = attached_files(data).get(PRINTED_XML)
    except UnreadablePdf as error:
        raise Refused(f"{file}: {error}") from error
    if found is None:
        raise Refused(f"{file}: the PDF has no {PRINTED_XML} inside, so it is not a printed certificate")
    return found, True


def _here(settings: Settings, server: str | None) -> bool:
    """Whether a service is named, or a database is here: a check makes none."""
    from bench_service.persistence.database import missing_file

    return server is not None or missing_file(settings.database_url) is None


def _repeated(
    settings: Settings, server: str | None, document: dict[str, Any], unasked: bool
) -> "list[Repeated] | None":
    """Have the service analyse the raw data again; `unasked`: None where it has not got them. Raises `Refused`."""
    from bench_service.formats.certificate.recomputed import compared, results_of

    with connect(settings, server, drive=False) as client:
        known = (client.get(f"/api/v1/results/{segment(r)}").status_code for r in results_of(document))
        if unasked and 404 in known:
            return None
        answers = {
            result: call(client, "POST", f"/api/v1/results/{segment(result)}/recomputation", ("recordings",))
            for result in results_of(document)
        }
    return compared(document, answers)


def _say(begin: str, facts: dict[str, Any], printed: bool) -> None:
    lines = [
        f"{begin} valid, unchanged, signed by {facts['signed_by']}{'; the pages are not checked' if printed else ''}",
        f"unit {facts['unit']}, calibrations {', '.join(facts['calibrations'])}",
        "schema: " + ("valid" if facts["schema_checked"] else "not checked, see --schema"),
        *(f"raw data of the {triad} triad: {sentence}" for triad, sentence in facts["recomputed"].items()),
    ]
    if not facts["raw_data_checked"]:
        lines.append("raw data: not analysed again, see --recompute and --server; their hashes are in the certificate")
    for line in lines:
        console.print(line, soft_wrap=True)
