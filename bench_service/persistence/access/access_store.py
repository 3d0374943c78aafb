"""Accounts, tokens, sessions, failed log-ins and approvals in SQL. Each change is counted: processes see it by that."""

from collections.abc import Mapping
from datetime import datetime

from sqlalchemy import delete, func, select, update
from sqlalchemy.orm import Session as Transaction

from bench_service.access.credentials import LONGEST, STOPS_AFTER_END, AccessToken, Account, Session
from bench_service.access.lockout import FORGOTTEN, locked_until
from bench_service.access.roles import Role
from bench_service.access.stores import Approval, Snapshot
from bench_service.mapping import copied
from bench_service.model.errors import IllegalTransition, NameTaken, NotFound
from bench_service.persistence.database import Database
from bench_service.persistence.tables.access import (
    AccessStateRow,
    AccountRow,
    ApprovalRow,
    FailedLogInRow,
    SessionRow,
    TokenRow,
)

ONE = "access"
"""Id of the one row that counts changes; and the name under which changes take turns."""
FIRST_IS_ADMIN = "the first account switches log-in on for everybody, and is an admin's: give it the role admin"
LAST_ADMIN = "this is the last admin: nobody could keep accounts after that. Make another one first"


class SqlAccessStore:
    """SQL implementation of `bench_service.access.stores.AccessStore`, on SQLite and Postgres."""

    def __init__(self, database: Database) -> None:
        self._database = database

    def revision(self) -> int:
        with self._database.read() as session:
            return session.scalar(select(AccessStateRow.revision)) or 0

    def load(self) -> Snapshot:
        with self._database.read() as session:
            state = session.scalars(select(AccessStateRow)).one()  # first: what is read after it is no older
            accounts = [_account(row) for row in session.scalars(select(AccountRow))]
            live = select(TokenRow).where(TokenRow.revoked_at.is_(None))
            tokens = [_token(row) for row in session.scalars(live)]
            sessions = [copied(Session, row) for row in session.scalars(select(SessionRow))]
        return Snapshot(
            state.revision,
            bytes.fromhex(state.key),
            {one.name: one for one in accounts},
            {one.digest: one for one in tokens},
            {one.digest: one for one in sessions},
        )

    def add_account(self, account: Account, password_hash: str | None) -> None:
        with self._database.write() as session:
            self._change(session)
            if session.get(AccountRow, account.name) is not None or _valid_token(session, account.name):
                raise NameTaken(f"there is an account or a token {account.name!r} already")
            if account.role is not Role.ADMIN and not session.scalar(select(func.count()).select_from(AccountRow)):
                raise IllegalTransition(FIRST_IS_ADMIN)
            session.add(copied(AccountRow, account, role=account.role.value, password=password_hash))

    def password_hash(self, name: str) -> str | None:
        with self._database.read() as session:
            return session.scalar(select(AccountRow.password).where(AccountRow.name == name))

    def change_account(self, name: str, role: Role | None, team: str | None, password_hash: str | None) -> Account:
        with self._database.write() as session:
            self._change(session)
            row = _found(session, name)
            if role not in (None, Role.ADMIN) and _is_last_admin(session, row):
                raise IllegalTransition(LAST_ADMIN)
            row.role = row.role if role is None else role.value
            row.team = row.team if team is None else team
            if password_hash is not None:
                row.password = password_hash
                session.execute(delete(SessionRow).where(SessionRow.account == name))
                session.execute(delete(FailedLogInRow).where(FailedLogInRow.name == name))
            return _account(row)

    def remove_account(self, name: str, last: bool) -> None:
        with self._database.write() as session:
            self._change(session)
            row = _found(session, name)
            only = session.scalar(select(func.count()).select_from(AccountRow)) == 1
            if _is_last_admin(session, row) and not (only and last):
                raise IllegalTransition(LAST_ADMIN)
            session.execute(delete(SessionRow).where(SessionRow.account == name))
            session.delete(row)

    def add_token(self, token: AccessToken) -> None:
        with self._database.write() as session:
            self._change(session)
            if session.get(AccountRow, token.name) is not None or _valid_token(session, token.name, token.created_at):
                raise NameTaken(f"there is an account or a valid token {token.name!r} already")
            session.add(copied(TokenRow, token, role=token.role.value))

    def tokens(self) -> tuple[AccessToken, ...]:
        with self._database.read() as session:
            return tuple(_token(row) for row in session.scalars(select(TokenRow).order_by(TokenRow.id.desc())))

    def revoke_token(self, token: str, at: datetime) -> AccessToken:
        with self._database.write() as session:
            self._change(session)
            named = select(TokenRow).where(TokenRow.name == token).order_by(TokenRow.id.desc()).limit(1)
            row = session.get(TokenRow, token) or session.scalar(named)
            if row is None:
                raise NotFound("token", token)
            row.revoked_at = row.revoked_at or at
            return _token(row)

    def add_session(self, session: Session, instead_of: str | None) -> None:
        with self._database.write() as transaction:
            self._change(transaction)
            gone = SessionRow.created_at < session.created_at - LONGEST - STOPS_AFTER_END
            transaction.execute(delete(SessionRow).where(gone | (SessionRow.digest == instead_of)))
            transaction.add(copied(SessionRow, session))

    def end_session(self, digest: str) -> None:
        with self._database.write() as session:
            self._change(session)
            session.execute(delete(SessionRow).where(SessionRow.digest == digest))

    def touch(self, sessions: Mapping[str, datetime], tokens: Mapping[str, datetime]) -> None:
        with self._database.write() as session:
            for digest, at in sessions.items():
                of_session = update(SessionRow).where(SessionRow.digest == digest, SessionRow.last_used_at < at)
                session.execute(of_session.values(last_used_at=at))
            for token, at in tokens.items():
                session.execute(update(TokenRow).where(TokenRow.id == token).values(last_used_at=at))

    def begin_attempt(self, name: str, at: datetime) -> datetime | None:
        with self._database.write() as session:
            self._database.one_at_a_time(session, f"log in {name}")
            session.execute(delete(FailedLogInRow).where(FailedLogInRow.last_at < at - FORGOTTEN))
            row = session.get(FailedLogInRow, name)
            if row is None:
                session.add(FailedLogInRow(name=name, failures=1, last_at=at))
                return None
            until = locked_until(row.failures, row.last_at)
            if until is not None and at < until:
                return until
            row.failures, row.last_at = row.failures + 1, at
            return None

    def forget_attempts(self, name: str) -> None:
        with self._database.write() as session:
            session.execute(delete(FailedLogInRow).where(FailedLogInRow.name == name))

    def approve(self, approval: Approval) -> None:
        with self._database.write() as session:
            session.merge(copied(ApprovalRow, approval))

    def withdraw(self, procedure: str) -> None:
        with self._database.write() as session:
            row = session.get(ApprovalRow, procedure)
            if row is None:
                raise NotFound("approval of procedure", procedure)
            session.delete(row)

    def approvals(self) -> tuple[Approval, ...]:
        with self._database.read() as session:
            rows = session.scalars(select(ApprovalRow).order_by(ApprovalRow.procedure))
            return tuple(copied(Approval, row) for row in rows)

    def _change(self, session: Transaction) -> None:
        """Count a change, and let changes take turns: a row that is updated first is a lock."""
        session.execute(update(AccessStateRow).values(revision=AccessStateRow.revision + 1))


def _account(row: AccountRow) -> Account:
    return copied(Account, row, role=Role(row.role), has_password=row.password is not None)


def _token(row: TokenRow) -> AccessToken:
    return copied(AccessToken, row, role=Role(row.role))


def _found(session: Transaction, name: str) -> AccountRow:
    row = session.get(AccountRow, name)
    if row is None:
        raise NotFound("account", name)
    return row


def _valid_token(session: Transaction, name: str, at: datetime | None = None) -> bool:
    """Return whether a token of that name is not revoked, nor expired at a moment."""
    query = select(TokenRow.id).where(TokenRow.name == name, TokenRow.revoked_at.is_(None))
    return session.scalar(query if at is None else query.where(TokenRow.expires_at > at)) is not None


def _is_last_admin(session: Transaction, row: AccountRow) -> bool:
    admins = select(func.count()).select_from(AccountRow).where(AccountRow.role == Role.ADMIN.value)
    return row.role == Role.ADMIN.value and session.scalar(admins) == 1
