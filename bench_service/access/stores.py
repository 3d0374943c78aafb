"""Interface of the store of accounts, tokens, sessions and approvals. Every method is one transaction."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Protocol

from bench_service.access.credentials import AccessToken, Account, Session
from bench_service.access.roles import Role
from bench_service.telemetry.stores import TelemetryStores


@dataclass(frozen=True)
class Snapshot:
    """All accounts, tokens and sessions at one moment, as authentication keeps them in memory."""

    revision: int = -1
    key: bytes = field(default=b"", repr=False)
    """Key of the values against cross-site requests."""
    accounts: Mapping[str, Account] = field(default_factory=dict[str, Account])
    """Accounts by name."""
    tokens: Mapping[str, AccessToken] = field(default_factory=dict[str, AccessToken])
    """Tokens that are not revoked, by digest."""
    sessions: Mapping[str, Session] = field(default_factory=dict[str, Session])
    """Sessions that nobody has ended, by digest."""


@dataclass(frozen=True)
class Approval:
    """The approval of one version of a procedure for operators."""

    procedure: str
    version: str
    by: str
    at: datetime


class AccessStore(Protocol):
    """Store of accounts, tokens, sessions and approvals. All but `touch` raise `StorageFull`, `StorageFailure`.
    Interface; the SQL is in `persistence`.
    """

    def revision(self) -> int:
        """Return the number of changes so far, by which other processes see that they must read again."""
        ...

    def load(self) -> Snapshot: ...

    def add_account(self, account: Account, password_hash: str | None) -> None:
        """Store an account. Raises `NameTaken`; and `IllegalTransition` where the first one is no admin's."""
        ...

    def password_hash(self, name: str) -> str | None:
        """Return the hash of an account's password; None where there is no account or no password."""
        ...

    def change_account(self, name: str, role: Role | None, team: str | None, password_hash: str | None) -> Account:
        """Change the fields that are given, and return the account; a new password ends the account's sessions and its
        lock.

        Raises `NotFound`, `IllegalTransition` for the last admin's role.
        """
        ...

    def remove_account(self, name: str, last: bool) -> None:
        """Remove an account and its sessions. Raises `NotFound`; `IllegalTransition` for the last admin's, unless it is
        the only account and `last` is true.
        """
        ...

    def add_token(self, token: AccessToken) -> None:
        """Store a token. Raises `NameTaken` where a valid token or an account has that name."""
        ...

    def tokens(self) -> tuple[AccessToken, ...]:
        """Return every token, newest first, revoked ones too."""
        ...

    def revoke_token(self, token: str, at: datetime) -> AccessToken:
        """Revoke a token by its id or its name, and return it; one that is revoked stays as it is. Raises
        `NotFound`.
        """
        ...

    def add_session(self, session: Session, instead_of: str | None) -> None:
        """Store a session, and end the one that the same browser had (its digest)."""
        ...

    def end_session(self, digest: str) -> None: ...

    def touch(self, sessions: Mapping[str, datetime], tokens: Mapping[str, datetime]) -> None:
        """Store when sessions (by digest) and tokens (by id) were last used."""
        ...

    def begin_attempt(self, name: str, at: datetime) -> datetime | None:
        """Count an attempt as failed until `forget_attempts`, and return None; where the name is locked, return the end
        of its lock instead.
        """
        ...

    def forget_attempts(self, name: str) -> None: ...

    def approve(self, approval: Approval) -> None:
        """Store the approval of a version of a procedure, in place of the one before."""
        ...

    def withdraw(self, procedure: str) -> None:
        """Remove the approval of a procedure. Raises `NotFound` where there is none."""
        ...

    def approvals(self) -> tuple[Approval, ...]:
        """Return the approvals, in the order of the procedures' names."""
        ...


@dataclass(frozen=True)
class AccessStores(TelemetryStores):
    """The stores that `access` needs, with those of `telemetry`, as one value."""

    access: AccessStore
