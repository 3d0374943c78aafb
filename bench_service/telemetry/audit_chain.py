"""The audit trail as a hash chain: each entry has the digest of itself and of the entry before.

An entry that is changed, removed or put in between breaks the chain there. Whoever can write the database can chain
all of it again: note the digest of the head elsewhere, and compare it later. When the retention of a stretch ends, its
entries go and a checkpoint stays, which joins the chain before with the chain after.

digest_n = SHA-256(digest_{n-1} + newline + JSON list of sequence, id, time, who, action, target, outcome, detail as
stored), in hexadecimal digits; digest_0 is 64 zeros.
"""

import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime

BEGINNING = "0" * 64
"""The digest before the first entry."""
MOST_FAULTS = 20
"""Maximum number of faults that a report lists."""


@dataclass(frozen=True)
class Link:
    """One stored entry of the audit trail as the hash chain sees it, with its sequence and digest."""

    sequence: int
    id: str
    at: datetime
    who: str
    action: str
    target: str
    outcome: str
    detail: str
    """The details' JSON, character for character."""
    digest: str = ""

    def digest_after(self, before: str) -> str:
        """Return the digest of this entry that follows an entry with the digest `before`."""
        at = self.at.astimezone(UTC).isoformat(timespec="microseconds")
        parts = [self.sequence, self.id, at, self.who, self.action, self.target, self.outcome, self.detail]
        return hashlib.sha256(f"{before}\n{json.dumps(parts)}".encode()).hexdigest()


@dataclass(frozen=True)
class Checkpoint:
    """A closed stretch of the chain, whose entries were removed: their range, times and digests."""

    first: int
    last: int
    first_at: datetime
    last_at: datetime
    before: str
    """Digest before its first entry."""
    digest: str
    """Digest of its last entry."""
    closed_at: datetime
    closed_by: str


@dataclass(frozen=True)
class ChainReport:
    """Outcome of a check of the whole chain: numbers of entries and checkpoints, last digest, and faults."""

    entries: int
    checkpoints: tuple[Checkpoint, ...]
    sequence: int
    """Place of the newest entry, counted from 1; 0: there is none."""
    digest: str
    """Digest of the newest entry: a copy of it elsewhere shows later whether all of this is still there."""
    faults: tuple[str, ...] = ()

    @property
    def whole(self) -> bool:
        """True where nothing was changed, removed or put in between."""
        return not self.faults


@dataclass
class ChainCheck:
    """Running check of a chain: it takes checkpoints, then entries in order, and collects the faults."""

    sequence: int = 0
    digest: str = BEGINNING
    entries: int = 0
    faults: list[str] = field(default_factory=list[str])
    checkpoints: tuple[Checkpoint, ...] = ()
    expected: str | None = None
    """Digest that an earlier check gave, which must still be in the chain."""
    met: bool = False

    def pass_checkpoints(self, checkpoints: Iterable[Checkpoint]) -> None:
        """Check that closed stretches follow one another, and continue from the last one."""
        self.checkpoints = tuple(checkpoints)
        for one in self.checkpoints:
            if (one.first, one.before) != (self.sequence + 1, self.digest) or one.last < one.first:
                self._fault(f"the checkpoint of entries {one.first} … {one.last} does not follow entry {self.sequence}")
            self._go_on(one.last, one.digest)

    def pass_link(self, link: Link) -> None:
        """Check that the next entry follows the one before, by sequence and digest; a fault is kept."""
        self.entries += 1
        if link.sequence != self.sequence + 1:
            missing = f"entry {self.sequence + 1}" if link.sequence == self.sequence + 2 else "entries"
            missing += "" if link.sequence == self.sequence + 2 else f" {self.sequence + 1} … {link.sequence - 1}"
            self._fault(f"{missing} missing before {link.id}, {link.at.isoformat(timespec='seconds')}")
        elif link.digest_after(self.digest) != link.digest:
            when = link.at.isoformat(timespec="seconds")
            self._fault(f"entry {link.sequence} ({link.id}, {when}) or the one before it was changed")
        self._go_on(link.sequence, link.digest)

    def _go_on(self, sequence: int, digest: str) -> None:
        self.sequence, self.digest = sequence, digest
        self.met = self.met or digest == self.expected

    def strangers(self, number: int) -> None:
        """Record as a fault that `number` entries have no place in the chain."""
        if number:
            self._fault(f"{number} entries have no place in the chain: they were not written by the service")

    def report(self) -> ChainReport:
        """Return the outcome of the check so far."""
        if self.expected is not None and not self.met:
            self._fault(f"no entry has the digest {self.expected}: entries are missing, or all were chained anew")
        return ChainReport(self.entries, self.checkpoints, self.sequence, self.digest, tuple(self.faults))

    def _fault(self, text: str) -> None:
        if len(self.faults) < MOST_FAULTS:
            self.faults.append(text)
