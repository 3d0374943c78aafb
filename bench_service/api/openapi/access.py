"""Security in the API's document: the schemes, and for each operation those that it takes and its least role."""

from typing import Any

from bench_service.access.roles import LEAST, Right
from bench_service.api.access.identify import COOKIE, CSRF_HEADER
from bench_service.api.access.rights import right_of

SCHEMES: dict[str, dict[str, str]] = {
    "token": {
        "type": "http",
        "scheme": "bearer",
        "description": "A named token: `bench token add NAME --role … --team …`, or POST /api/v1/tokens",
    },
    "session": {
        "type": "apiKey",
        "in": "cookie",
        "name": COOKIE,
        "description": "The cookie of a log-in, POST /api/v1/session; over HTTPS its name begins with `__Host-`",
    },
    "csrf": {
        "type": "apiKey",
        "in": "header",
        "name": CSRF_HEADER,
        "description": "`csrf` of GET /api/v1/session, with every change that a cookie authenticates",
    },
}
NEEDS = "x-needs-role"
"""Name of the extension that states the least role of an operation."""
METHODS = ("get", "put", "post", "delete", "patch")


def declare_security(paths: dict[str, Any]) -> None:
    """Declare security and least role of every operation.

    A service without accounts takes requests from its own host without any of them: that is not in the document.
    """
    for item in paths.values():
        for method in METHODS:
            if method in item:
                right = right_of(item[method]["operationId"], method.upper())
                item[method]["security"] = security_of(right, method)
                least = LEAST[right]
                item[method][NEEDS] = None if least is None else least.value


def security_of(right: Right, method: str) -> list[dict[str, list[str]]]:
    """Return the alternatives by which an operation may be authenticated, as OpenAPI has them; an empty one:
    without.
    """
    if right is Right.OPEN:
        return []
    if right is Right.STOP:
        return [{"token": []}, {"session": []}, {}]
    by_cookie: dict[str, list[str]] = {"session": []}
    if method != "get":
        by_cookie["csrf"] = []
    return [{"token": []}, by_cookie]
