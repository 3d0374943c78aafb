"""Route that checks a calibration certificate: the signer, whether it is unchanged, and what is stored of it here."""

from typing import Annotated

from anyio import to_thread
from fastapi import File, UploadFile
from pydantic import BaseModel, Field

from bench_service.api.http.dependencies import Service
from bench_service.api.http.errors import problems
from bench_service.evidence.certificate_check import CheckedTriad, check_certificate
from bench_service.mapping import copied
from bench_service.routing import Routes
from procedures.core.errors import BadParameter

router = Routes(prefix="/api/v1/certificates", tags=["units"])
LARGEST = 1_000_000
"""Largest certificate that is checked [bytes]."""


class TriadOfCertificate(BaseModel):
    """A calibration that the certificate is about, held against the one that is stored here."""

    calibration: str
    triad: str
    stored: bool = Field(description="Whether this database has a calibration of that id and unit")
    same: bool | None = Field(description="Whether all coefficients are those stored; null: it is not stored here")
    approval: str | None = Field(description="Approval in this service; null: the calibration is not stored here")

    @classmethod
    def of(cls, triad: CheckedTriad) -> "TriadOfCertificate":
        return copied(cls, triad)


class CheckedCertificate(BaseModel):
    """The outcome of a certificate's check."""

    valid: bool = Field(description="Signed by the owner of the laboratory's certificate, unchanged, and without fault")
    signed_by: str | None = Field(description="Name in the laboratory's certificate; null: the signature is not valid")
    unchanged: bool = Field(description="Whether the text is as it was signed")
    unit: str | None
    calibrations: list[TriadOfCertificate]
    faults: list[str] = Field(description="Faults found; empty where it is valid")


@router.post("/check", responses=problems(413, 507))
async def check_certificate_file(
    service: Service,
    certificate: Annotated[UploadFile, File(description="The certificate, XML")],
    laboratory: Annotated[UploadFile, File(description="The laboratory's own certificate (PEM), got from itself")],
) -> CheckedCertificate:
    """Check a certificate: its signature by the laboratory's certificate, its structure and numbers. Nothing is kept.

    A certificate is checked for what it says, also one of a unit that this database does not know.
    """
    data, pinned = await certificate.read(LARGEST + 1), await laboratory.read(LARGEST + 1)
    for name, content in (("certificate", data), ("laboratory", pinned)):
        if not 0 < len(content) <= LARGEST:
            raise BadParameter(name, f"{len(content)} bytes or more", f"1 to {LARGEST} bytes")
    found = await to_thread.run_sync(check_certificate, service.stores.calibrations, data, pinned)
    return copied(CheckedCertificate, found, calibrations=[TriadOfCertificate.of(one) for one in found.calibrations])
