"""A look whether a database has accounts or valid tokens, without creating or migrating it."""

from sqlalchemy import func, inspect, select

from bench_service.persistence.database import connect, missing_file
from bench_service.persistence.tables.access import AccountRow, TokenRow
from bench_service.wall_clock import now


def has_credentials(database_url: str) -> bool:
    """Return whether somebody could authenticate: there is an account, or a valid token. Raises `StorageFailure`."""
    if missing_file(database_url) is not None:
        return False
    database = connect(database_url)
    try:
        with database.read() as session:
            if not inspect(session.connection()).has_table(AccountRow.__tablename__):
                return False
            valid = select(func.count()).where(TokenRow.revoked_at.is_(None), TokenRow.expires_at > now())
            accounts = select(func.count()).select_from(AccountRow)
            return bool(session.scalar(accounts) or session.scalar(valid))
    finally:
        database.dispose()
