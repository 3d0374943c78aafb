"""Audit of what the service is made of: licences, a bill of materials, known vulnerabilities where an index answers.

`make audit`. Licences and bill need no network. Exit code 1: a licence that is not allowed, or a known vulnerability.
"""

import argparse
import json
import os
import re
import subprocess
import sys
from importlib.metadata import Distribution, distributions
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ALLOWED = re.compile(
    r"\b(MIT|MIT-0|MIT-CMU|BSD|0BSD|[23]-Clause|Apache|ISC|PSF|PSFL|Python|Python Software Foundation|HPND|Zlib|"
    r"MPL|Mozilla|Unlicense|Public Domain|BSL-1\.0|any-OSI|CC0|LGPL|Lesser|FSFUL|matplotlib)\b",
    re.IGNORECASE,
)
"""Licences that may be used: permissive ones, and those that ask only for changes of the library itself."""
REFUSED = re.compile(r"\b(AGPL|Affero|SSPL|BUSL|Commons Clause|GPL(?:v\d\S*)?|GNU General Public)\b", re.IGNORECASE)
"""Licences that would bind the service itself; "LGPL" is a word of its own and is not among them."""


QUIET = {**os.environ, "PYTHONWARNINGS": "ignore::UserWarning"}
"""A lock file names no root of its dependencies, and the tool warns of that at each run."""


def licence_of(found: Distribution) -> str:
    """Return a distribution's licence as it states it: the SPDX expression, else its classifiers, else its text."""
    about = found.metadata
    expression = about.get("License-Expression")
    if expression:
        return expression
    classifiers = [c.split(" :: ")[-1] for c in about.get_all("Classifier", []) if c.startswith("License ::")]
    named = [c for c in classifiers if c != "OSI Approved"]
    text = (about.get("License") or "").strip().split("\n")[0][:80]
    return " AND ".join(named) or text or "not stated"


def pinned(lock: Path) -> set[str]:
    """Return the names of the packages of a lock file, normalised."""
    return {
        normal(name) for name in re.findall(r"^([A-Za-z0-9._-]+)(?:\[[a-z,]+\])?==", lock.read_text(), re.MULTILINE)
    }


def normal(name: str) -> str:
    """Return a package's name as indexes compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def licences(runtime: set[str]) -> tuple[list[tuple[str, str, str, str]], list[str]]:
    """List name, version, licence and place (runtime or development) of all packages; and those not allowed."""
    listed: list[tuple[str, str, str, str]] = []
    wrong: list[str] = []
    for found in sorted(distributions(), key=lambda each: normal(each.metadata["Name"])):
        name, licence = normal(found.metadata["Name"]), licence_of(found)
        place = "runtime" if name in runtime else "development"
        listed.append((name, found.version, licence, place))
        refused = place == "runtime" and (REFUSED.search(licence) or not ALLOWED.search(licence))
        if refused and name != "bench-service":
            wrong.append(f"{name} {found.version}: {licence}")
    return listed, wrong


def bill(tools: Path, lock: Path, target: Path) -> int:
    """Write the bill of materials (CycloneDX JSON) of a lock file; return the number of its components."""
    command = [tools / "cyclonedx-py", "requirements", lock, "--pyproject", ROOT / "pyproject.toml"]
    subprocess.run([*command, "--output-format", "JSON", "--output-file", target], check=True, cwd=ROOT, env=QUIET)
    return len(json.loads(target.read_text())["components"])


def vulnerabilities(tools: Path, lock: Path, timeout_s: float) -> tuple[bool | None, str]:
    """Ask the index about every pinned version: True none is known, False some are, None it did not answer."""
    command = [tools / "pip-audit", "--requirement", lock, "--disable-pip", "--no-deps", "--progress-spinner", "off"]
    try:
        done = subprocess.run(
            [*command, "--format", "json"], capture_output=True, text=True, timeout=timeout_s, check=False
        )
    except subprocess.TimeoutExpired:
        return None, f"no answer within {timeout_s:g} s"
    try:
        found = json.loads(done.stdout)["dependencies"]
    except (ValueError, KeyError):
        return None, (done.stderr.strip().split("\n") or [""])[-1][:200]
    known = [f"{each['name']} {each['version']}: {v['id']}" for each in found for v in each.get("vulns", ())]
    skipped = sum("skip_reason" in each for each in found)
    if skipped == len(found):
        return None, "the index knows none of the packages"
    return not known, "\n".join(known) or f"{len(found) - skipped} packages, none with a known vulnerability"


def main() -> int:
    """Print licences, write the bill of materials, ask for vulnerabilities; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--tools", type=Path, required=True, help="folder of the auditing environment's programs")
    parser.add_argument("--into", type=Path, default=ROOT / "build", help="folder for the lists")
    parser.add_argument("--timeout", type=float, default=120.0)
    given = parser.parse_args()
    given.into.mkdir(parents=True, exist_ok=True)
    lock = ROOT / ".ci" / "runtime.lock"
    listed, wrong = licences(pinned(lock))
    table = given.into / "licences.tsv"
    table.write_text("".join("\t".join(row) + "\n" for row in listed))
    count = sum(row[3] == "runtime" for row in listed)
    print(f"licences: {count} packages at run time, {len(listed) - count} for development: {table}")
    target = given.into / "bill-of-materials.cdx.json"
    print(f"bill of materials: {bill(given.tools, lock, target)} components: {target}")
    good, text = vulnerabilities(given.tools, ROOT / "requirements.lock", given.timeout)
    print(f"vulnerabilities: {text}" if good is not None else f"vulnerabilities: NOT checked: {text}")
    for each in wrong:
        print(f"licence that is not allowed: {each}")
    return 1 if wrong or good is False else 0


if __name__ == "__main__":
    sys.exit(main())
