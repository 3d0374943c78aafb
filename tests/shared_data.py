"""Where the real recordings with their reference results lie; they are never part of the project."""

import os
from pathlib import Path

SHARED_DATA = Path(os.environ.get("SHARED_DATA") or Path(__file__).resolve().parents[2] / "shared" / "data")
