"""Every operation without and with a wrong proof, by schemathesis: none answers as it does to a known sender.

``python -m tests.validation.access``. It asks each of the API's operations with generated data as an admin, then
repeats what was accepted without the token and with a wrong one (`ignored_auth`). Exit code 1 where an operation takes
that, works on something that was deleted, answers 500, or otherwise than the document says. The feed is left out: it
has no end. About two minutes.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from tests.kit.people import house

SECURITY = ("ignored_auth", "use_after_free", "unsupported_method", "missing_required_header")
"""The checks of schemathesis about security that apply here; `docs/who-is-let-in.md` has the answer to each."""
CHECKS = (*SECURITY, "not_a_server_error", "status_code_conformance", "response_schema_conformance")


def main() -> int:
    """Run the checks against a service with accounts; the exit code of schemathesis."""
    with tempfile.TemporaryDirectory(prefix="access-") as folder, house(Path(folder)) as home:
        home.add_account("ada")
        token = home.add_token("fuzz", "admin")
        command = [Path(sys.executable).with_name("schemathesis"), "run", f"{home.url}/openapi.json"]
        command += ["--header", f"Authorization: Bearer {token}", "--checks", ",".join(CHECKS)]
        command += ["--exclude-path-regex", "^/api/v1/feed$", "--request-timeout", "60", "--wait-for-schema", "60"]
        command += ["--phases", "coverage,fuzzing,stateful", "--max-examples", "5", "--seed", "1"]
        return subprocess.run(command, cwd=folder, check=False).returncode


if __name__ == "__main__":
    sys.exit(main())
