"""Migrations that have landed stay as they are: databases out there were made by them."""

import hashlib
import json
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LANDED = Path(__file__).with_name("landed_migrations.json")


def test_a_migration_is_never_edited_after_it_landed() -> None:
    """A database that was made before the edit would have the same number and another form.

    A new migration is added to the list once it is on the main line, by its name and the SHA-256 of its bytes.
    """
    landed: dict[str, str] = json.loads(LANDED.read_text())
    found = {path.name: _digest(path) for path in (ROOT / "migrations" / "versions").glob("*.py")}
    changed = {name for name, digest in landed.items() if found.get(name) != digest}
    assert not changed, f"put back what landed, and write a migration of its own for the change: {changed}"


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
