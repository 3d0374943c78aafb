"""PORT of memory for accounts, tokens, sessions and approvals. Every method is one transaction."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Protocol

from bench_service.access.credentials import AccessToken, Account, Session
from bench_service.access.roles import Role
from bench_service.telemetry.stores import TelemetryStores


@dataclass(frozen=True)
class Snapshot:
    """Everything that authentication needs, at one moment: it is kept in memory."""

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
    """The stored accounts, tokens, sessions and approvals. All but `touch` raise `StorageFull`, `StorageFailure`."""

    def revision(self) -> int:
        """Number of changes so far."""
        ...

    def load(self) -> Snapshot: ...

    def add_account(self, account: Account, password_hash: str | None) -> None:
        """Add an account. Raises `NameTaken`; and `IllegalTransition` where the first one is no admin's."""
        ...

    def password_hash(self, name: str) -> str | None:
        """The hash of an account's password; None where there is no account or no password."""
        ...

    def change_account(self, name: str, role: Role | None, team: str | None, password_hash: str | None) -> Account:
        """Change what is given; a new password ends the account's sessions and its lock.

        Raises `NotFound`, `IllegalTransition` for the last admin's role.
        """
        ...

    def remove_account(self, name: str, last: bool) -> None:
        """Remove an account and its sessions. Raises `NotFound`; `IllegalTransition` for the last admin's, unless it is
        the only account and `last` is true.
        """
        ...

    def add_token(self, token: AccessToken) -> None:
        """Add a token. Raises `NameTaken` where a valid token or an account has that name."""
        ...

    def tokens(self) -> tuple[AccessToken, ...]:
        """List every token, newest first, revoked ones too."""
        ...

    def revoke_token(self, token: str, at: datetime) -> AccessToken:
        """Revoke a token by its id or its name; one that is revoked stays as it is. Raises `NotFound`."""
        ...

    def add_session(self, session: Session, instead_of: str | None) -> None:
        """Add a session, and end the one that the same browser had (its digest)."""
        ...

    def end_session(self, digest: str) -> None: ...

    def touch(self, sessions: Mapping[str, datetime], tokens: Mapping[str, datetime]) -> None:
        """Note when sessions (by digest) and tokens (by id) were last used."""
        ...

    def begin_attempt(self, name: str, at: datetime) -> datetime | None:
        """Count an attempt as failed until `forget_attempts`; where the name is locked, the end of its lock instead."""
        ...

    def forget_attempts(self, name: str) -> None: ...

    def approve(self, approval: Approval) -> None:
        """Approve a version of a procedure, in place of the one before."""
        ...

    def withdraw(self, procedure: str) -> None:
        """Withdraw a procedure's approval. Raises `NotFound`."""
        ...

    def approvals(self) -> tuple[Approval, ...]:
        """List the approvals by procedure."""
        ...


@dataclass(frozen=True)
class AccessStores(TelemetryStores):
    """The stores of this room and of those below it."""

    access: AccessStore
