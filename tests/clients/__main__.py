"""Clients that other programs generate from the OpenAPI document, and what linters say of it.

``python -m tests.clients``. Each part must end without an error and without a warning; the generated Python client
then drives a service from a preview to an analysis. Programs are those of the lock files in `client/generators`, kept
in `.clients`; without node, the linters and the TypeScript are left out. Exit code 1 if a part failed. The classes of
`client/bench_client/results` are written anew.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import httpx

from tests.kit.served import served

ROOT = Path(__file__).parents[2]
CACHE = ROOT / ".clients"
GENERATORS = ROOT / "client" / "generators"
BIN = Path(sys.executable).parent
QUIET = {"REDOCLY_TELEMETRY": "off", "REDOCLY_SUPPRESS_UPDATE_NOTICE": "true", "NO_COLOR": "1"}
TIMEOUT_S = 600


class Failed(Exception):
    """A part failed; the message is what its program printed."""


def run(*command: object, path: Path | None = None) -> str:
    """Run a program and return what it printed; errors too. Raises `Failed`."""
    outside = {**os.environ, **QUIET, "PATH": f"{BIN}{os.pathsep}{os.environ['PATH']}"}
    if path is not None:
        outside["PYTHONPATH"] = str(path)
    done = subprocess.run(
        [str(word) for word in command],
        cwd=ROOT,
        env=outside,
        capture_output=True,
        text=True,
        timeout=TIMEOUT_S,
        check=False,
    )
    if done.returncode != 0:
        raise Failed(done.stdout[-4000:] + done.stderr[-4000:])
    return done.stdout + done.stderr


def once(made: Path, of: Path, make: Callable[[], object]) -> None:
    """Make something in the cache again where the file that it is made of has changed."""
    marker = CACHE / f"{made.name}.made-of"
    if made.exists() and marker.exists() and marker.read_text() == of.read_text():
        return
    shutil.rmtree(made, ignore_errors=True)
    make()
    marker.write_text(of.read_text())


def own_classes(document: Path) -> str:
    """Write the classes of results of our own client."""
    results = ROOT / "client" / "bench_client" / "results"
    before = {file.name: file.read_text() for file in results.glob("*.py")}
    run(sys.executable, ROOT / "client" / "generate_results.py", document)
    run(BIN / "ruff", "check", "--fix-only", "--quiet", results)
    run(BIN / "ruff", "format", "--quiet", results)
    changed = [f.name for f in results.glob("*.py") if before.get(f.name) != f.read_text()]
    return f"written anew: {', '.join(sorted(changed))}" if changed else "as they were"


def python_environment() -> Path:
    """Return the Python that has the generator of Python clients, and what its clients need."""
    folder, lock = CACHE / "python", GENERATORS / "requirements.txt"

    def make() -> None:
        run(sys.executable, "-m", "venv", folder)
        run(BIN / "uv", "pip", "install", "--quiet", "--require-hashes", "--python", folder / "bin/python", "-r", lock)

    once(folder, lock, make)
    return folder / "bin"


def generated_python(document: Path, address: str) -> str:
    """Generate a Python client, and drive the service with it."""
    programs, folder = python_environment(), CACHE / "generated"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    generate = [programs / "openapi-python-client", "generate", "--path", document, "--meta", "none"]
    said = run(*generate, "--output-path", folder / "bench_generated", "--fail-on-warning")
    if "arning" in said:
        raise Failed(said)
    models = len(list((folder / "bench_generated" / "models").glob("*.py")))
    flow = run(programs / "python", ROOT / "tests" / "clients" / "generated_flow.py", address, path=folder)
    return f"{models} models, no warning; {flow.strip()}"


def node_programs() -> Path:
    """Return the folder of the linters' programs."""
    folder, lock = CACHE / "node", GENERATORS / "package-lock.json"

    def make() -> None:
        folder.mkdir(parents=True)
        for name in ("package.json", "package-lock.json"):
            shutil.copy(GENERATORS / name, folder)
        run("npm", "ci", "--prefix", folder, "--ignore-scripts", "--no-audit", "--no-fund")

    once(folder, lock, make)
    return folder / "node_modules" / ".bin"


def redocly(document: Path) -> str:
    """Lint by redocly's recommended rules."""
    said = run(node_programs() / "redocly", "lint", document, "--extends", "recommended", "--format", "json")
    found, _ = json.JSONDecoder().raw_decode(said[said.index("{") :])
    if found["totals"]["errors"] or found["totals"]["warnings"]:
        raise Failed(json.dumps(found["problems"], indent=1)[:4000])
    return "no error, no warning"


def spectral(document: Path) -> str:
    """Lint by spectral's rules of OpenAPI."""
    rules = GENERATORS / "spectral.yaml"
    run(node_programs() / "spectral", "lint", document, "--ruleset", rules, "--fail-severity", "warn")
    return "no error, no warning"


def typescript(document: Path) -> str:
    """Generate types of TypeScript, and compile them strictly."""
    types = CACHE / "bench.ts"
    said = run(node_programs() / "openapi-typescript", document, "--output", types)
    if "warn" in said.lower():
        raise Failed(said)
    run(node_programs() / "tsc", "--strict", "--noEmit", types)
    return f"{len(types.read_text().splitlines())} lines, no warning, compiled with --strict"


def main() -> int:
    CACHE.mkdir(exist_ok=True)
    kept = True
    with tempfile.TemporaryDirectory() as folder, served(Path(folder)) as address:
        document = CACHE / "openapi.json"
        document.write_text(httpx.get(f"{address}/openapi.json", timeout=60).text)
        parts: dict[str, Callable[[], str]] = {
            "our own classes of results": lambda: own_classes(document),
            "openapi-python-client": lambda: generated_python(document, address),
        }
        if shutil.which("node") and shutil.which("npm"):
            parts |= {
                "redocly": lambda: redocly(document),
                "spectral": lambda: spectral(document),
                "openapi-typescript": lambda: typescript(document),
            }
        else:
            print("node or npm is missing: redocly, spectral and openapi-typescript are left out", flush=True)
        for name, part in parts.items():
            try:
                print(f"{name}: {part()}", flush=True)
            except (Failed, OSError, subprocess.TimeoutExpired) as failure:
                kept = False
                print(f"{name}: FAILED\n{failure}", flush=True)
    return 0 if kept else 1


if __name__ == "__main__":
    sys.exit(main())
