"""The laboratory's key and signature: one enveloped RSA-SHA256 signature, verified by a pinned certificate."""

from dataclasses import dataclass
from datetime import timedelta

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import NameOID
from signxml.algorithms import DigestAlgorithm, SignatureMethod
from signxml.exceptions import InvalidInput, SignXMLException
from signxml.signer import XMLSigner
from signxml.verifier import SignatureConfiguration, XMLVerifier

from bench_service.formats.certificate.errors import CertificateRefused
from bench_service.formats.certificate.tree import Element, etree
from bench_service.wall_clock import now

C14N = "http://www.w3.org/2006/12/xml-c14n11"
BITS = 3072
VALID = timedelta(days=5 * 365)
DS = "http://www.w3.org/2000/09/xmldsig#"
EXPECTED = SignatureConfiguration(
    require_x509=True,
    signature_methods=frozenset({SignatureMethod.RSA_SHA256}),
    digest_algorithms=frozenset({DigestAlgorithm.SHA256}),
    expect_references=1,
)


@dataclass(frozen=True)
class KeyPair:
    """A private key and its certificate, both PEM."""

    key: bytes
    certificate: bytes


def new_key(name: str) -> KeyPair:
    """Return a new key of a laboratory, with a certificate signed by itself, for digital signatures only."""
    key = rsa.generate_private_key(public_exponent=65537, key_size=BITS)
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name[:64])])
    usage = x509.KeyUsage(True, False, False, False, False, False, False, False, False)
    made = (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now() - timedelta(minutes=5))
        .not_valid_after(now() + VALID)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(usage, critical=True)
        .sign(key, hashes.SHA256())
    )
    private = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    return KeyPair(private, made.public_bytes(serialization.Encoding.PEM))


def signed(root: Element, pair: KeyPair) -> bytes:
    """Return the document with its signature as its last element. Raises `CertificateRefused` for a key that cannot
    sign.
    """
    signer = XMLSigner(c14n_algorithm=C14N)  # enveloped, RSA-SHA256 and SHA-256 are its defaults
    try:
        made = signer.sign(root, key=pair.key, cert=pair.certificate.decode())
    except (SignXMLException, ValueError, TypeError) as error:
        raise CertificateRefused(f"the key cannot sign: {error}") from error
    return etree.tostring(made, xml_declaration=True, encoding="UTF-8")


def parsed(data: bytes) -> Element:
    """Return the tree of an XML text, read without entities and network. Raises `CertificateRefused` with the place of
    the fault.
    """
    try:
        root = etree.fromstring(data, etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False))
    except etree.XMLSyntaxError as error:
        raise CertificateRefused(f"not XML: {error}") from error
    if root.getroottree().docinfo.doctype:
        raise CertificateRefused("the certificate has a DOCTYPE, which is not allowed")
    if next(root.getroottree().iter(etree.Comment, etree.ProcessingInstruction), None) is not None:
        raise CertificateRefused(
            "the certificate has a comment or processing instruction, which signatures leave out and which cuts texts"
        )
    return root


def verified(data: bytes, certificate: bytes) -> tuple[Element, str]:
    """Return the tree that the signature covers, and the name in the pinned certificate. Raises `CertificateRefused`
    where the signature does not hold.
    """
    root = parsed(data)
    found = root.findall(f"{{{DS}}}Signature")
    if len(found) != 1 or root[-1] is not found[0]:
        raise CertificateRefused(f"{len(found)} signatures in the root: exactly one is expected, as its last element")
    try:
        pinned = x509.load_pem_x509_certificate(certificate)
        result = XMLVerifier().verify(data, x509_cert=certificate.decode(), expect_config=EXPECTED)
    except (SignXMLException, InvalidInput, ValueError) as error:
        raise CertificateRefused(f"the signature is not valid: {error}") from error
    covered = (result if not isinstance(result, list) else result[0]).signed_xml
    if covered is None or covered.tag != root.tag:
        raise CertificateRefused("the signature covers a part only, not the whole certificate")
    return covered, pinned.subject.rfc4514_string()
