"""Declaration of access in the OpenAPI document: how a client names itself. The rules are in `api/http/door.py`."""

from typing import Any

SECURITY_SCHEMES: dict[str, Any] = {
    "token": {
        "type": "http",
        "scheme": "bearer",
        "description": "The service's token; a program on the service's own host needs none.",
    }
}
SECURITY: list[dict[str, list[str]]] = [{"token": []}, {}]
"""Ways to be let in: each entry of the list is enough by itself; the empty one is a program on the same host."""
