"""Run of schemathesis: whether a service keeps to its OpenAPI document, whatever it is sent."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

CHECKS = (
    "not_a_server_error",
    "status_code_conformance",
    "content_type_conformance",
    "response_headers_conformance",
    "response_schema_conformance",
    "unsupported_method",
)


def keeps_to_document(
    address: str, folder: Path, phases: Sequence[str], examples: int = 1, within_s: float = 220.0
) -> subprocess.CompletedProcess[str]:
    """Ask every operation with generated data; exit code 0 where each answer is as the document says.

    The feed has no end, and the first account closes every other route: `tests.validation.access` asks those with a
    token. Raises `subprocess.TimeoutExpired`.
    """
    command = [str(Path(sys.executable).with_name("schemathesis")), "run", f"{address}/openapi.json"]
    command += ["--checks", ",".join(CHECKS), "--exclude-path-regex", "^/api/v1/(feed|accounts|tokens)"]
    command += ["--phases", ",".join(phases), "--max-examples", str(examples), "--seed", "1"]
    return subprocess.run(command, capture_output=True, text=True, timeout=within_s, cwd=folder, check=False)
