"""Operations of access: log in and out, keep accounts, tokens and approvals."""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta

from bench_service.access import passwords
from bench_service.access.book import AccessBook
from bench_service.access.credentials import (
    AccessToken,
    Account,
    Session,
    csrf_of,
    digest_of,
    new_session_secret,
    new_token,
)
from bench_service.access.identity import Identity, Proof
from bench_service.access.lockout import AttemptRate
from bench_service.access.roles import RANK, Right, Role
from bench_service.access.stores import AccessStore, Approval
from bench_service.model.errors import IllegalTransition, LockedOut, NotAllowed, WrongPassword
from bench_service.wall_clock import new_id, now
from procedures.core.errors import BadParameter

SERVICE_TOKEN = "service-token"
"""Name of the program that has the token of `BENCH_TOKEN_FILE`."""
RESERVED = (SERVICE_TOKEN, "retention", "local")
"""Names in the audit trail that nobody else may have."""


@dataclass(frozen=True)
class NewSession:
    """A session that a log-in has made, with its secret and its account."""

    secret: str
    session: Session
    account: Account


@dataclass(frozen=True)
class NewToken:
    """A token that was made, with its secret, which cannot be read again."""

    secret: str
    token: AccessToken


class AccessService:
    """Operations of clients on accounts, tokens, sessions and approvals; each is stored when it returns."""

    def __init__(self, store: AccessStore, book: AccessBook) -> None:
        self.book = book
        self._store = store
        self._rate = AttemptRate()

    def log_in(self, name: str, password: str, address: str, instead_of: str | None) -> NewSession:
        """Open a session, always with a new secret; `instead_of`: digest of the one that the browser had, which ends.

        An attempt counts as failed before the password is looked at, so that attempts at the same time count too.
        Raises `WrongPassword`, `LockedOut`, `Overloaded`.
        """
        at = now()
        wait_s = self._rate.wait_s(address, at)
        if wait_s is not None:
            raise LockedOut("too many log-ins from this address within a minute", wait_s)
        until = self._store.begin_attempt(name, at)
        if until is not None:
            text = f"this name is locked after failed log-ins, until {until.isoformat(timespec='seconds')}; "
            text += "`bench user set NAME --password` on the service's host unlocks it"
            raise LockedOut(text, (until - at).total_seconds())
        if not passwords.matches(password, self._store.password_hash(name)):
            raise WrongPassword
        secret = new_session_secret()
        session = Session(digest_of(secret), name, at, at)
        self._store.add_session(session, instead_of)
        self._store.forget_attempts(name)
        self.book.read_again()
        account = self.book.account(name)
        if account is None:  # removed at this moment
            raise WrongPassword
        return NewSession(secret, session, account)

    def csrf_of_session(self, session: Session) -> str:
        """Return the value that the pages of a session repeat with each change, against cross-site requests."""
        return csrf_of(self.book.state.key, f"session {session.digest}")

    def log_out(self, identity: Identity) -> None:
        """End the session of an identity. Raises `IllegalTransition` where it has none."""
        if identity.proof is not Proof.SESSION:
            raise IllegalTransition(
                f"there is no session to end: this request was authenticated by {identity.proof.value}"
            )
        self._store.end_session(identity.credential)
        self.book.read_again()

    def add_account(self, name: str, role: Role, team: str, password: str | None, by: str) -> Account:
        """Store an account and return it; the first one switches log-in on, and is an admin's. `password` None: this
        person logs in through a trusted proxy alone. Raises `NameTaken`, `BadParameter`.
        """
        _check_free(name)
        if password is not None:
            passwords.check_rule(name, password)
        account = Account(name, role, team, now(), by, password is not None)
        self._store.add_account(account, None if password is None else passwords.hashed(password))
        self.book.read_again()
        return account

    def change_account(self, name: str, role: Role | None, team: str | None, password: str | None) -> Account:
        """Change role, team or password of an account (None: as it is), and return it; a new password ends the open
        sessions and unlocks the name.

        Raises `NotFound`, `BadParameter`, `IllegalTransition` for the role of the last admin.
        """
        if password is not None:
            passwords.check_rule(name, password)
        hashed = None if password is None else passwords.hashed(password)
        account = self._store.change_account(name, role, team, hashed)
        self.book.read_again()
        return account

    def remove_account(self, name: str, by: Identity) -> None:
        """Remove an account, with its sessions. The owner of the files may remove the only one: log-in is then off.

        Raises `NotFound`, `IllegalTransition` for the last admin's.
        """
        self._store.remove_account(name, last=by.proof is Proof.OWNER)
        self.book.read_again()

    def add_token(self, name: str, role: Role, team: str, lasting: timedelta, by: str) -> NewToken:
        """Make and store a token that expires after `lasting`, and return it with its secret. Raises `NameTaken`,
        `BadParameter`.
        """
        _check_free(name)
        secret, at = new_token(), now()
        token = AccessToken(new_id(), name, role, team, digest_of(secret), at, by, at + lasting)
        self._store.add_token(token)
        self.book.read_again()
        return NewToken(secret, token)

    def tokens(self) -> tuple[AccessToken, ...]:
        """Return every token, newest first, revoked ones too."""
        return self._store.tokens()

    def revoke_token(self, token: str) -> AccessToken:
        """Revoke a token by its id or name, and return it; jobs that were submitted with it continue. Raises
        `NotFound`.
        """
        revoked = self._store.revoke_token(token, now())
        self.book.read_again()
        return revoked

    def approve(self, procedure: str, version: str, by: str) -> Approval:
        """Store the approval of a procedure's version for operators, and return it."""
        approval = Approval(procedure, version, by, now())
        self._store.approve(approval)
        return approval

    def withdraw(self, procedure: str) -> None:
        """Withdraw the approval of a procedure. Raises `NotFound` where there is none."""
        self._store.withdraw(procedure)

    def approvals(self) -> tuple[Approval, ...]:
        """Return the approvals, in the order of the procedures' names."""
        return self._store.approvals()

    def require_approved(self, identity: Identity, procedure: str, version_of: Callable[[], str]) -> None:
        """Refuse an operator a procedure whose present version is not approved. Raises `NotAllowed`.

        `version_of`: gives the present version, and raises `NotFound` for a procedure that does not exist.
        """
        if RANK[identity.role] >= RANK[Role.ENGINEER]:
            return
        version = version_of()
        found = next((one for one in self._store.approvals() if one.procedure == procedure), None)
        if found is not None and found.version == version:
            return
        state = "is not approved" if found is None else f"is approved as version {found.version}, not {version}"
        raise NotAllowed(
            f"procedure {procedure} {state}: an operator runs approved procedures; an engineer approves it with "
            f"PUT /api/v1/procedures/{procedure}/approval"
        )

    def still_valid(self, identity: Identity, at: datetime) -> bool:
        """Return whether the credential behind an identity is still valid at a moment: for answers that last long."""
        state = self.book.state
        if identity.proof is Proof.SESSION:
            session = self.book.session(identity.credential)
            return session is not None and session.valid(at) and session.account in state.accounts
        if identity.proof is Proof.TOKEN and identity.credential:
            return any(one.id == identity.credential and one.valid(at) for one in state.tokens.values())
        if identity.proof is Proof.PROXY:
            return identity.credential in state.accounts
        return identity.proof is not Proof.NONE or not state.accounts


def _check_free(name: str) -> None:
    if name in RESERVED:
        raise BadParameter("name", name, f"another name: reserved for the service itself are {', '.join(RESERVED)}")


def require(identity: Identity, right: Right) -> None:
    """Refuse an identity that does not have a right. Raises `NotAllowed` with the role that has it."""
    if identity.may(right):
        return
    if right is Right.ACCESS and identity.proof is Proof.NONE:
        raise NotAllowed("accounts and tokens are kept on the service's host: `bench user add`, `bench token add`")
    raise NotAllowed(f"this needs the right to {right.value}, which the role {identity.role.value} does not have")


def require_team(identity: Identity, team: str, what: str) -> None:
    """Refuse an identity that is not of a reservation's team. Raises `NotAllowed`."""
    if not identity.in_team(team):
        raise NotAllowed(f"{what} belongs to team {team}: its members act on it, and admins")
