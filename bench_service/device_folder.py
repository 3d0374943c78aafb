"""The folder of a bench's device state, from the settings, without loading the settings' model.

`bench stop` reads only these settings, so that it starts at once and no invalid setting keeps it from working.
"""

import tomllib
from pathlib import Path
from urllib.parse import urlsplit

DATABASE_URL = "sqlite:///.bench/bench.sqlite"
BENCH_ID = "sim"


def bench_id_in(bench_file: Path) -> str | None:
    """Return the id of the bench that a bench file describes; None where the file cannot be read: its full reading says
    why.
    """
    try:
        found = tomllib.loads(bench_file.read_text(encoding="utf-8"))["bench"]["id"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return found if isinstance(found, str) else None


def device_folder(database_url: str, given: Path | None) -> Path:
    """Return the folder of device files: the given one, or that of an SQLite file, or one in .bench/ named by a
    Postgres database.
    """
    if given is not None:
        return given
    address = urlsplit(database_url)
    if address.scheme.startswith("sqlite"):
        return Path(database_url.partition(":///")[2] or "bench.sqlite").parent
    return Path(".bench") / (address.path.strip("/") or "postgres")
