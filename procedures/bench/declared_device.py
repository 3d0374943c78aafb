"""Declaration of the devices of a bench: real or simulated, identity, and calibration certificate."""

from dataclasses import dataclass

from procedures.bench.device import DeviceIdentity


@dataclass(frozen=True)
class DeclaredCertificate:
    """Calibration certificate of a device or of the site."""

    number: str
    laboratory: str
    due: str
    """Day after which it has expired, ISO 8601 ("2027-03-02")."""

    def overdue(self, today: str) -> bool:
        """Return whether the certificate has expired on a day, ISO 8601."""
        return today > self.due


@dataclass(frozen=True)
class DeclaredDevice:
    """A device of a bench: part of the lineage of everything that is recorded with it."""

    name: str
    """Its section in the bench file: "turntable", "unit_link", …; "site" for the site's own certificate."""
    simulated: bool
    driver: str = ""
    address: str = ""
    identity: DeviceIdentity | None = None
    """Identity as the device reported it when its link was made; None: it has not been reached yet."""
    certificate: DeclaredCertificate | None = None
