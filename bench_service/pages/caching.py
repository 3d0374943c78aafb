"""Answers that a browser may keep: with an ETag always, and without a date of expiry under an address that names their
version.
"""

from collections.abc import Callable

from fastapi import Request, Response

FOR_GOOD = "private, max-age=31536000, immutable"
ASK_AGAIN = "private, no-cache"


def kept(
    request: Request, version: str, media_type: str, make: Callable[[], bytes | str], policy: str | None = None
) -> Response:
    """Return the content of this version, or 304 where the browser has it: `make` is called only where it must be sent.

    An address with `v` equal to the version never changes. `policy`: a Content-Security-Policy of its own.
    """
    etag = f'"{version}"'
    headers = {"ETag": etag, "Cache-Control": FOR_GOOD if request.query_params.get("v") == version else ASK_AGAIN}
    if policy is not None:
        headers["Content-Security-Policy"] = policy
    held = [tag.strip().removeprefix("W/") for tag in request.headers.get("if-none-match", "").split(",")]
    if etag in held or "*" in held:
        return Response(status_code=304, headers=headers)
    return Response(make(), media_type=media_type, headers=headers)
