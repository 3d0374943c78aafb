"""``python -m tests.chaos``: kill the service's processes again and again, and print what that does to its promises."""

import argparse
import sys
import tempfile
from pathlib import Path

from tests.chaos.storm import storm
from tests.chaos.undisturbed import twins


def main() -> int:
    """0 where every promise was kept."""
    parser = argparse.ArgumentParser(prog="python -m tests.chaos", description=__doc__)
    parser.add_argument("--kills", type=int, default=200, help="processes to kill on each database")
    parser.add_argument("--seed", type=int, default=1, help="of the disasters, the jobs and the devices' faults")
    parser.add_argument("--database", choices=("sqlite", "postgres", "both"), default="both")
    parser.add_argument("--minutes", type=float, default=60.0, help="at most so long on each database")
    parser.add_argument(
        "--keep", type=Path, help="a new folder for databases, journals and logs; else they are removed"
    )
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="chaos-") as temporary:
        folder = given.keep or Path(temporary)
        (folder / "undisturbed").mkdir(parents=True)
        expected = twins(folder / "undisturbed")
        kept = True
        for kind in ("sqlite", "postgres") if given.database == "both" else (given.database,):
            finding = storm(kind, folder / kind, given.kills, given.seed, expected, given.minutes * 60)
            print(f"== {kind}, seed {given.seed}", *finding.figures, sep="\n")
            print(*(f"NOT KEPT: {violation}" for violation in finding.violations), sep="\n")
            print("every promise was kept" if not finding.violations else f"{len(finding.violations)} findings")
            kept = kept and not finding.violations
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
