"""Roles of people and programs, and the rights that each role has."""

from enum import StrEnum


class Role(StrEnum):
    """Roles in ascending order; each has the rights of those before it."""

    VIEWER = "viewer"
    OPERATOR = "operator"
    ENGINEER = "engineer"
    ADMIN = "admin"


class Right(StrEnum):
    """The right that a route needs; "open" is everybody's, also without log-in."""

    OPEN = "open"
    """Everybody, also without log-in: health, the log-in itself."""
    SEE = "see"
    """Reading, and previews that change nothing."""
    STOP = "stop"
    """Stopping a bench: everybody who can see."""
    OPERATE = "operate"
    """Approved procedures, answers, pause, cancel, release, reservations."""
    ENGINEER = "engineer"
    """Any procedure, analyses, imports, campaigns, calibrations that count, approvals of procedures."""
    ADMIN = "admin"
    """Retention of the audit trail."""
    ACCESS = "access"
    """Accounts and tokens: an admin who has proved who he is, or the owner of the service's files."""


RANK = {role: rank for rank, role in enumerate(Role)}
LEAST: dict[Right, Role | None] = {
    Right.OPEN: None,
    Right.SEE: Role.VIEWER,
    Right.STOP: Role.VIEWER,
    Right.OPERATE: Role.OPERATOR,
    Right.ENGINEER: Role.ENGINEER,
    Right.ADMIN: Role.ADMIN,
    Right.ACCESS: Role.ADMIN,
}
"""The least role that has a right; None: no log-in is needed."""


def has(role: Role, right: Right) -> bool:
    """Return whether a role has a right; everybody has `Right.OPEN`."""
    least = LEAST[right]
    return least is None or RANK[role] >= RANK[least]
