"""Certificates of random units: valid by the schema, verified twice, each changed digit refused by both."""

import json
import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xmlsec
from lxml import etree

from bench_service.formats.calibration_exports.own_json import own_json
from bench_service.formats.certificate.document import DCC, SPACES, certificate
from bench_service.formats.certificate.errors import CertificateRefused
from bench_service.formats.certificate.laboratory import Laboratory, laboratory_of
from bench_service.formats.certificate.rules import attached, faults, schema_faults
from bench_service.formats.certificate.signature import KeyPair, new_key, parsed, signed, verified
from tests.kit.certificate_facts import TEXT
from tests.kit.certificate_readers import SCHEMA, by_xmlsec, numbers_of
from tests.kit.exported_calibrations import a_subject


@pytest.fixture(scope="module")
def pair() -> KeyPair:
    return new_key("Bench Lab")


@pytest.fixture(scope="module")
def laboratory() -> Laboratory:
    return laboratory_of(TEXT)


def a_certificate(seed: int, laboratory: Laboratory, **changes: object) -> etree._Element:
    subject = a_subject(seed, count=seed % 5 == 0)
    triads = tuple(replace(t, **changes) for t in subject.triads)
    text = own_json(replace(subject, triads=triads))
    return certificate(json.loads(text), text, laboratory, "1.2.3")


def test_forty_random_units_are_valid_and_their_numbers_are_the_database_s(
    pair: KeyPair, laboratory: Laboratory
) -> None:
    for seed in range(40):
        data = signed(a_certificate(seed, laboratory), pair)
        root, signer = verified(data, pair.certificate)
        by_xmlsec(data, pair)
        assert signer == "CN=Bench Lab"
        assert faults(root) == []
        if SCHEMA.is_dir():
            assert schema_faults(parsed(data), SCHEMA) == []
        subject = a_subject(seed, count=seed % 5 == 0)
        for (words, cells), triad in zip(numbers_of(root), subject.triads, strict=True):
            assert words == [repr(x) for x in triad.value.coefficients.tolist()]
            assert np.array(cells).T.tolist() == triad.value.covariance_array.tolist()


@pytest.mark.skipif(not SCHEMA.is_dir(), reason="the schema's files are not here")
def test_a_second_validator_agrees(pair: KeyPair, laboratory: Laboratory) -> None:
    xmlschema = pytest.importorskip("xmlschema")
    schema = xmlschema.XMLSchema(str(SCHEMA / "v3.3.0" / "dcc.xsd"))
    schema.validate(signed(a_certificate(1, laboratory), pair).decode())


def test_each_changed_digit_is_refused_by_both(pair: KeyPair, laboratory: Laboratory) -> None:
    data = signed(a_certificate(1, laboratory), pair)
    values = re.search(rb"<si:valueXMLList>([^<]+)<", data)
    assert values is not None
    digits = [i for i in range(values.start(1), values.end(1)) if data[i : i + 1].isdigit()]
    for i in digits[::17]:
        changed = data[:i] + str((int(data[i : i + 1]) + 1) % 10).encode() + data[i + 1 :]
        with pytest.raises(CertificateRefused, match="is not valid"):
            verified(changed, pair.certificate)
        with pytest.raises(xmlsec.Error):
            by_xmlsec(changed, pair)


def test_another_key_no_signature_and_two_are_refused(pair: KeyPair, laboratory: Laboratory) -> None:
    data = signed(a_certificate(1, laboratory), pair)
    with pytest.raises(CertificateRefused):
        verified(data, new_key("Bench Lab").certificate)
    with pytest.raises(CertificateRefused, match="0 signatures"):
        verified(etree.tostring(a_certificate(1, laboratory)), pair.certificate)
    root = etree.fromstring(data)
    root.append(etree.fromstring(etree.tostring(root[-1])))
    with pytest.raises(CertificateRefused, match="2 signatures"):
        verified(etree.tostring(root), pair.certificate)
    # a signed certificate inside a foreign root: the signature is not the root's own
    wrapped = b"<x>" + data.partition(b"?>")[2] + b"</x>"
    with pytest.raises(CertificateRefused):
        verified(wrapped, pair.certificate)
    root = etree.fromstring(data)
    number = next(root.iter("{*}valueXMLList"))
    number.insert(0, etree.Comment(" "))  # signatures leave comments out, and readers cut texts there
    with pytest.raises(CertificateRefused, match="comment"):
        verified(etree.tostring(root), pair.certificate)
    with pytest.raises(CertificateRefused, match="DOCTYPE"):
        parsed(b'<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>')


def _drop_column(root: etree._Element) -> None:
    matrix = root.find(".//si:covarianceMatrixXMLList", SPACES)
    assert matrix is not None
    matrix.remove(matrix[-1])


def _set(path: str, change: Callable[[str], str]) -> Callable[[etree._Element], None]:
    def act(root: etree._Element) -> None:
        one = root.find(path, SPACES)
        assert one is not None
        assert one.text is not None
        one.text = change(one.text)

    return act


LIST = ".//si:realListXMLList"
COLUMN = f"{LIST}//si:columnXMLList"


@pytest.mark.parametrize(
    ("act", "says"),
    [
        (_drop_column, "not 12 by 12"),
        (_set(f"{LIST}//si:valueExpandedMUXMLList", lambda t: t.rpartition(" ")[0]), "11 uncertainties"),
        (_set(f"{COLUMN}/*[1]/si:valueXMLList", lambda t: f"-{t}"), "variance is negative"),
        (_set(f"{COLUMN}/*[2]/si:valueXMLList", lambda t: repr(float(t) * 1.5)), "not symmetric"),
        (_set(f"{LIST}/si:unitXMLList", lambda t: t.replace(r"\one", "m/s^2", 1)), "'m/s^2' is none of"),
        (_set(f"{LIST}//si:valueExpandedMUXMLList", lambda t: t.replace(t.split()[0], "1.0", 1)), "roots of the var"),
        (_set(f"{LIST}/si:valueXMLList", lambda t: t.replace(t.split()[0], "0.5", 1)), "not those of the attached"),
        (_set(".//dcc:dataBase64", lambda _: "e30="), "cannot be read"),
        (lambda root: root.set("schemaVersion", "3.2.1"), "no certificate of version 3.3.0"),
    ],
)
def test_what_the_schema_lets_pass_our_rules_find(
    laboratory: Laboratory, act: Callable[[etree._Element], None], says: str
) -> None:
    root = a_certificate(1, laboratory)
    assert faults(root) == []
    act(root)
    assert says in "; ".join(faults(root))


def test_the_certificate_says_who_what_and_how(laboratory: Laboratory) -> None:
    root = a_certificate(1, laboratory, simulated=True, verdict="fail")
    text = " ".join(root.itertext())
    for words in ("Bench & Söhne <Lab>", "Київ", "rate table", "PTB 12345", "f00d", "SIMULATED", "simple acceptance"):
        assert words in text
    assert root.findtext(".//dcc:conformity", None, SPACES) == "fail"
    assert attached(root)["unit"] == "U-1"
    assert a_certificate(1, laboratory, verdict="inconclusive").find(f".//{{{DCC}}}conformity") is None


def test_a_laboratory_s_file_is_refused_with_the_field() -> None:
    with pytest.raises(CertificateRefused, match=r"laboratory\.country"):
        laboratory_of(TEXT.replace('country = "UA"', 'country = "Ukraine"'))
    with pytest.raises(CertificateRefused, match="not TOML"):
        laboratory_of("= 1")


def test_the_check_at_the_command_line(tmp_path: Path, pair: KeyPair, laboratory: Laboratory) -> None:
    (tmp_path / "c.xml").write_bytes(signed(a_certificate(1, laboratory), pair))
    (tmp_path / "lab.cert.pem").write_bytes(pair.certificate)

    def bench(*arguments: object) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, "-m", "bench_service", "certificate", *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)

    good = bench("check", tmp_path / "c.xml", "--certificate", tmp_path / "lab.cert.pem", "--json")
    assert good.returncode == 0, good.stderr
    assert json.loads(good.stdout)["signed_by"] == "CN=Bench Lab"
    made = bench("key", "Other", "-o", tmp_path / "other")
    assert made.returncode == 0, made.stderr
    assert (tmp_path / "other.key.pem").stat().st_mode & 0o777 == 0o600
    assert "never overwritten" in bench("key", "Other", "-o", tmp_path / "other").stderr
    bad = bench("check", tmp_path / "c.xml", "--certificate", tmp_path / "other.cert.pem")
    assert (bad.returncode, "is not valid" in bad.stderr) == (2, True)
