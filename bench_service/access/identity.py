"""The identity of a request: its person or program, the role and the team, and how the name was proved."""

from dataclasses import dataclass
from enum import StrEnum

from bench_service.access.roles import RANK, Right, Role, has


class Proof(StrEnum):
    """Way in which a request proves its name: none, owner of the files, session, token, or trusted proxy."""

    NONE = "none"
    """No proof: the single user of a service without accounts, on its own host."""
    OWNER = "owner"
    """A command in the same process, run by the owner of the service's files."""
    SESSION = "session"
    """A cookie that a log-in gave."""
    TOKEN = "token"
    """A token, sent as `Authorization: Bearer …`."""
    PROXY = "proxy"
    """The header of a trusted proxy that has authenticated the person."""


@dataclass(frozen=True)
class Identity:
    """One person or program, as a request has proved it: name, role, team, and the kind of proof."""

    name: str
    role: Role
    proof: Proof
    team: str = ""
    """Team whose reservations it may act on; empty: none."""
    credential: str = ""
    """Digest of the session, id of the token or name of the account behind it."""
    csrf: str | None = None
    """Value that a request which changes something must repeat; None: no browser sends its credential by itself."""
    proven: bool = True
    """False where there are no accounts: then the name that a client gives itself counts."""

    @property
    def proven_name(self) -> str | None:
        """The name where it is proved; None where a client names itself."""
        return self.name if self.proven else None

    def may(self, right: Right) -> bool:
        """Return whether the identity has a right. Accounts and tokens are not given to somebody who has proved
        nothing.
        """
        return has(self.role, right) and (right is not Right.ACCESS or self.proof is not Proof.NONE)

    def in_team(self, team: str) -> bool:
        """Return whether the identity may act on what a team has reserved; a reservation without a team is
        everybody's.
        """
        return not team or self.in_every_team or self.team == team

    @property
    def in_every_team(self) -> bool:
        """True where the identity may act for every team: an admin, or the single user of a service without
        accounts.
        """
        return not self.proven or RANK[self.role] >= RANK[Role.ADMIN]
