"""Random data against the OpenAPI document, and its links followed: each answer is as the document says.

``python -m tests.validation.document``. What `tests/service/test_openapi.py` does with the edges of every schema, with
random data and with sequences of requests that the document's links give. Exit code 1 where an answer is another than
the document says. About two minutes.
"""

import sys
import tempfile
from pathlib import Path

from tests.kit.kept_document import keeps_to_document
from tests.kit.served import served

EXAMPLES = 15
"""Generated requests for each operation."""
WITHIN_S = 1800.0


def main() -> int:
    """Ask a service that drives a simulated bench; the exit code of schemathesis."""
    with tempfile.TemporaryDirectory(prefix="document-") as folder, served(Path(folder)) as address:
        done = keeps_to_document(address, Path(folder), ("fuzzing", "stateful"), EXAMPLES, WITHIN_S)
    print(done.stdout[done.stdout.find("= FAILURES =") :] if done.returncode else done.stdout[-1500:])
    return done.returncode


if __name__ == "__main__":
    sys.exit(main())
