"""HTTP schemas of session, accounts, tokens and approvals."""

from datetime import datetime, timedelta
from typing import Annotated

from pydantic import BaseModel, Field, SecretStr

from bench_service.access.credentials import NAME, AccessToken, Account
from bench_service.access.identity import Identity, Proof
from bench_service.access.roles import Right, Role
from bench_service.access.stores import Approval
from bench_service.api.http.fields import Request
from bench_service.mapping import copied

Name = Annotated[str, Field(pattern=NAME, description="Small letters, digits and . _ @ + -, at most 64")]
Team = Annotated[
    str, Field(pattern=r"^([a-z0-9][a-z0-9._@+-]{0,63})?$", description="Team whose reservations count; empty: none")
]
Password = Annotated[SecretStr, Field(max_length=1000)]
LONGEST_DAYS = 366
"""Longest life of a token [d]."""


class LogIn(Request):
    """Request to log in, with name and password."""

    name: str = Field(min_length=1, max_length=64, pattern=r"^[^\x00-\x1f]+$")
    password: Password


class SessionView(BaseModel):
    """The sender of this request, its role and its rights."""

    name: str | None = Field(description="Authenticated name; null: no log-in, or none is needed")
    role: Role | None = Field(description="null: log in first")
    team: str
    proof: Proof = Field(
        description='How the name was authenticated; "none" for the one user of a service without accounts'
    )
    rights: list[Right] = Field(description="Rights of this sender")
    log_in_needed: bool = Field(description="Whether this service has accounts, so that people log in")
    csrf: str | None = Field(description="Value that every change repeats in X-CSRF-Token, unless it is null")
    expires_at: datetime | None = Field(description="When the session ends by itself, unless it is used before")

    @classmethod
    def of(cls, identity: Identity | None, log_in_needed: bool, expires_at: datetime | None = None) -> "SessionView":
        """Convert an identity to its HTTP view; None: nobody has logged in."""
        if identity is None:
            return cls(
                name=None,
                role=None,
                team="",
                proof=Proof.NONE,
                rights=[Right.OPEN],
                log_in_needed=log_in_needed,
                csrf=None,
                expires_at=None,
            )
        rights = [right for right in Right if identity.may(right)]
        more = {"rights": rights, "log_in_needed": log_in_needed, "expires_at": expires_at}
        return copied(cls, identity, name=identity.proven_name, **more)


class NewAccount(Request):
    """Request for an account of a person."""

    name: Name
    role: Role
    team: Team = ""
    password: Password | None = Field(None, description="null: only a trusted proxy authenticates this person")


class AccountChange(Request):
    """A change of an account; what is null stays. A new password ends the open sessions and unlocks the name."""

    role: Role | None = None
    team: Team | None = None
    password: Password | None = None


class AccountView(BaseModel):
    """An account of a person."""

    name: str
    role: Role
    team: str
    created_at: datetime
    created_by: str
    has_password: bool = Field(description="False for a person whom only a trusted proxy authenticates")

    @classmethod
    def of(cls, account: Account) -> "AccountView":
        """Convert an account to its HTTP view."""
        return copied(cls, account)


class NewToken(Request):
    """Request for a named token of a program."""

    name: Name
    role: Role
    team: Team = ""
    days: float = Field(
        90.0, gt=0, le=LONGEST_DAYS, allow_inf_nan=False, description="Time until the token expires [d]"
    )

    @property
    def lasting(self) -> timedelta:
        """Lifetime of the new token."""
        return timedelta(days=self.days)


class TokenView(BaseModel):
    """A named token, without its secret."""

    id: str
    name: str
    role: Role
    team: str
    created_at: datetime
    created_by: str
    expires_at: datetime
    revoked_at: datetime | None
    last_used_at: datetime | None = Field(description="Last use, to the minute; null: no use is stored")

    @classmethod
    def of(cls, token: AccessToken) -> "TokenView":
        """Convert a token to its HTTP view."""
        return copied(cls, token)


class MadeToken(TokenView):
    """A new token with its secret, which is shown this once."""

    token: str = Field(description="The token, sent as Authorization: Bearer …; it is shown only here")


class ApprovalView(BaseModel):
    """The version of a procedure that operators may run."""

    procedure: str
    version: str
    by: str
    at: datetime

    @classmethod
    def of(cls, approval: Approval) -> "ApprovalView":
        """Convert an approval to its HTTP view."""
        return copied(cls, approval)
