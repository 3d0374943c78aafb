"""Refusals of certificates that cannot be made, signed, read or trusted."""


class CertificateRefused(Exception):
    """Raised where a certificate cannot be made or does not hold; the message is fit for a person."""
