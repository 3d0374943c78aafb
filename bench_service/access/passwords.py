"""Passwords: their rule and their hashes (argon2id, the parameters of argon2-cffi, RFC 9106's second choice)."""

from functools import cache
from threading import BoundedSemaphore
from typing import TYPE_CHECKING

from bench_service.model.errors import Overloaded
from procedures.core.errors import BadParameter

if TYPE_CHECKING:
    from argon2 import PasswordHasher

SHORTEST, LONGEST = 10, 200
"""Allowed lengths [characters]. No rule about kinds of characters: length is what keeps a guess out (NIST 800-63B)."""
AT_ONCE = 2
"""Number of hashes that are computed at one time: each takes 64 MiB and some 50 ms."""
WAIT_S = 3.0
"""Longest time that a log-in waits for its turn [s]."""

_turn = BoundedSemaphore(AT_ONCE)


def check_rule(name: str, password: str) -> None:
    """Refuse a password that is too short, too long, or the account's name. Raises `BadParameter`."""
    if not SHORTEST <= len(password) <= LONGEST:
        raise BadParameter("password", f"{len(password)} characters", f"{SHORTEST} … {LONGEST} characters")
    if name in password.lower() and len(password) < len(name) + SHORTEST:
        raise BadParameter(
            "password", "(not shown)", "a password that is not just the account's name with a few characters more"
        )


def hashed(password: str) -> str:
    """Return the argon2id hash of a password. Takes a good part of a second. Raises `Overloaded` where too many are
    hashed at once.
    """
    with _Turn():
        return _hasher().hash(password)


def matches(password: str, stored: str | None) -> bool:
    """Return whether a password is the one of a hash; without a hash it takes as long, and returns False. Raises
    `Overloaded`.
    """
    from argon2.exceptions import InvalidHashError, VerificationError

    with _Turn():
        try:
            return _hasher().verify(stored or _nobody(), password) and stored is not None
        except (VerificationError, InvalidHashError):
            return False


class _Turn:
    """One of the few places for hashing."""

    def __enter__(self) -> None:
        if not _turn.acquire(timeout=WAIT_S):
            raise Overloaded("too many log-ins at one time: try again in a moment")

    def __exit__(self, *_: object) -> None:
        _turn.release()


@cache
def _hasher() -> "PasswordHasher":
    from argon2 import PasswordHasher  # loaded by the first log-in

    return PasswordHasher()


@cache
def _nobody() -> str:
    """Hash of a password that nobody has: an unknown name is answered no faster than a known one."""
    return _hasher().hash("nobody has this password")
