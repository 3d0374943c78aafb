"""Refusals of certificates: what cannot be made, signed, read or believed."""


class CertificateRefused(Exception):
    """Raised where a certificate cannot be made or does not hold; the message is fit for a person."""
