"""Laboratory, customer and people of a certificate: the laboratory's own file in TOML."""

import tomllib
from datetime import date
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from bench_service.formats.certificate.errors import CertificateRefused

Word = Annotated[str, Field(min_length=1, max_length=300, pattern=r"^[^\x00-\x1f]+$")]
Country = Annotated[str, Field(pattern=r"^[A-Z]{2}$", description="ISO 3166-1, two capitals")]


class Contact(BaseModel):
    """Name and place of a laboratory or a customer."""

    model_config = ConfigDict(extra="forbid")
    name: Word
    country: Country
    city: Word
    street: Word | None = None
    post_code: Word | None = None
    email: Word | None = None


class Person(BaseModel):
    """A person who answers for the certificate: name, role, and whether it is the main signer."""

    model_config = ConfigDict(extra="forbid")
    name: Word
    role: Word
    main_signer: bool = False


class Equipment(BaseModel):
    """A reference device of the laboratory, with its serial and its own certificate."""

    model_config = ConfigDict(extra="forbid")
    name: Word
    serial: Word
    certificate: Word | None = None


class Laboratory(BaseModel):
    """The laboratory's file: laboratory, customer, people, equipment, and the name of the item's kind."""

    model_config = ConfigDict(extra="forbid")
    laboratory: Contact
    customer: Contact
    people: list[Person] = Field(min_length=1, max_length=20)
    equipment: list[Equipment] = Field(default_factory=list[Equipment], max_length=50)
    item: Word = "inertial measurement unit"
    identifier: Word
    begun: date | None = None
    """First day of the measurement; without it, the day on which the calibration was made."""


def laboratory_of(text: str) -> Laboratory:
    """Return the content of a laboratory's file, checked. Raises `CertificateRefused` naming the field and the
    way out.
    """
    try:
        return Laboratory.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise CertificateRefused(f"laboratory file: not TOML: {error}") from error
    except ValidationError as error:
        faults = "; ".join(f"{'.'.join(map(str, e['loc']))}: {e['msg']}" for e in error.errors()[:5])
        raise CertificateRefused(f"laboratory file: {faults}") from error
