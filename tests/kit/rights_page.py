"""The page docs/rights.md, made from the routes and their rights: `make rights` writes it, a test compares it."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from bench_service.access.roles import LEAST, RANK, Right, Role
from bench_service.api import health
from bench_service.api.access.rights import right_of
from bench_service.nouns import PAGES, ROUTERS

PAGE = Path(__file__).parents[2] / "docs" / "rights.md"
HEAD = """# Rights: role by route

Made from the routes by `make rights`; a test compares it. Each role has the rights of those before it. *Nobody* is a
request without log-in or token; on the service's own host it may stop a bench too. *One user* is everybody on the host
of a service that has no accounts yet.

| right | for |
|---|---|
"""
TABLE = """
## Routes

| method | path | right | nobody | viewer | operator | engineer | admin | one user |
|---|---|---|---|---|---|---|---|---|
"""


class RouteRight(NamedTuple):
    """A verb on a path, with its route's name and the right that it needs."""

    method: str
    path: str
    name: str
    right: Right
    shown: bool
    """Whether it is in the API's document; a page is not."""


def routes() -> Iterator[RouteRight]:
    """Every verb of every route of the application."""
    for module in (health, *ROUTERS, *PAGES):
        shown = module.router.include_in_schema
        for path, endpoint, options in module.router.declared:
            name = endpoint.__name__
            for method in sorted(options["methods"]):
                yield RouteRight(method, path, name, right_of(name, method), shown and options["include_in_schema"])


def allowed(right: Right, role: Role | None) -> bool:
    """Whether the table gives a role a right; None as the role: a sender who is not known."""
    least = LEAST[right]
    return least is None or (role is not None and RANK[role] >= RANK[least])


def text() -> str:
    """The whole page."""
    meanings = "".join(f"| {right.value} | {MEANINGS[right]} |\n" for right in Right)
    rows = sorted(routes(), key=lambda one: (not one.shown, one.path, one.method))
    return HEAD + meanings + TABLE + "".join(map(_row, rows))


MEANINGS = {
    Right.OPEN: "health, the log-in and the files of its page",
    Right.SEE: "reading, and previews, which change nothing",
    Right.STOP: "stopping a bench: everybody who can see",
    Right.OPERATE: "jobs by approved procedures, answers, pause, resume, cancel, release, reservations",
    Right.ENGINEER: "any procedure, analyses, imports, campaigns, calibrations that count, approvals of procedures",
    Right.ADMIN: "retention of the audit trail, and its check",
    Right.ACCESS: "accounts and tokens; before the first account only the owner of the files, on the host",
}


def _row(one: RouteRight) -> str:
    cells = ["yes" if allowed(one.right, role) else "" for role in (None, *Role)]
    single = "" if one.right is Right.ACCESS else "yes"
    return f"| {one.method} | `{one.path}` | {one.right.value} | {' | '.join([*cells, single])} |\n"


if __name__ == "__main__":
    PAGE.write_text(text())
