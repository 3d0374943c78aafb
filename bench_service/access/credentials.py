"""Accounts, tokens and sessions as values, and their secrets. A secret is shown once; only its digest is kept.

A token or a session secret has 256 random bits, so its SHA-256 cannot be guessed from, and needs no salt and no slow
hash. A password has few bits: see `bench_service.access.passwords`.
"""

import hashlib
import hmac
import secrets
from dataclasses import dataclass, field
from datetime import datetime, timedelta

from bench_service.access.roles import Role
from bench_service.telemetry.redaction import PREFIX

NAME = r"^[a-z0-9][a-z0-9._@+-]{0,63}$"
"""Pattern of the names of accounts, tokens and teams: small letters, so that no two names look the same."""
IDLE = timedelta(hours=12)
"""Time after which a session that is not used ends."""
LONGEST = timedelta(days=7)
"""Time after which a session ends, used or not."""
STOPS_AFTER_END = timedelta(days=7)
"""Time after its expiry for which a session may still stop a bench, for a page that was left open."""


@dataclass(frozen=True)
class Account:
    """The account of a person: name, role, team; the hash of the password is kept apart."""

    name: str
    role: Role
    team: str
    created_at: datetime
    created_by: str
    has_password: bool
    """False for a person whom only a trusted proxy authenticates."""


@dataclass(frozen=True)
class AccessToken:
    """A named token of a program, with role and team; of its secret only the digest."""

    id: str
    name: str
    role: Role
    team: str
    digest: str = field(repr=False)
    created_at: datetime
    created_by: str
    expires_at: datetime
    revoked_at: datetime | None = None
    last_used_at: datetime | None = None

    def valid(self, at: datetime) -> bool:
        """Return whether the token is neither revoked nor expired at that moment."""
        return self.revoked_at is None and at < self.expires_at


@dataclass(frozen=True)
class Session:
    """A person's session after a log-in, with its times; of its secret only the digest."""

    digest: str = field(repr=False)
    account: str
    created_at: datetime
    last_used_at: datetime

    @property
    def over_at(self) -> datetime:
        """Time at which the session expires unless it is used before."""
        return min(self.last_used_at + IDLE, self.created_at + LONGEST)

    def valid(self, at: datetime) -> bool:
        """Return whether the session has not expired at that moment, by its last use or its age."""
        return at < self.over_at

    def stops(self, at: datetime) -> bool:
        """Return whether the session may still stop a bench, also for some days after it expired."""
        return at < self.over_at + STOPS_AFTER_END


def new_token() -> str:
    """Return a new secret of a token: the prefix and 256 random bits."""
    return PREFIX + secrets.token_urlsafe(32)


def new_session_secret() -> str:
    """Return a new secret of a session, 256 random bits, the value of its cookie."""
    return secrets.token_urlsafe(32)


def digest_of(secret: str) -> str:
    """Return the SHA-256 digest, in hexadecimal, under which a secret is kept."""
    return hashlib.sha256(secret.encode()).hexdigest()


def csrf_of(key: bytes, subject: str) -> str:
    """Return the value that the pages of a session repeat with each change: nobody can make it who cannot read a
    page.
    """
    return hmac.new(key, f"csrf:{subject}".encode(), "sha256").hexdigest()
