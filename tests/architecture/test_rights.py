"""The matrix of roles and routes is whole, and the page about it is what the routes say."""

import re

from bench_service.access.roles import Right, Role, has
from bench_service.api.access.rights import READING, RIGHTS
from tests.kit.documents import ROOT
from tests.kit.rights_page import PAGE, allowed, routes, text


def test_the_page_says_what_the_routes_say() -> None:
    assert PAGE.read_text() == text(), "write it anew: make rights"


def test_every_route_that_changes_something_states_its_right() -> None:
    silent = {f"{one.method} {one.path}: {one.name}" for one in routes() if one.method not in READING} - {
        f"{one.method} {one.path}: {one.name}" for one in routes() if one.name in RIGHTS
    }
    assert silent == set(), "name the route in bench_service/api/access/rights.py, and write the page: make rights"


def test_no_right_is_stated_for_a_route_that_is_not_there() -> None:
    assert set(RIGHTS) - {one.name for one in routes()} == set()


def test_a_name_has_one_right_whatever_the_room() -> None:
    """Rights are by name: two routes of one name must not be mixed up."""
    paths: dict[str, set[str]] = {}
    for one in routes():
        paths.setdefault(one.name, set()).add(one.path)
    assert {name: found for name, found in paths.items() if len(found) > 1 and name in RIGHTS} == {}


def test_the_rules_of_the_service_are_those_of_the_table() -> None:
    for right in Right:
        assert [has(role, right) for role in Role] == [allowed(right, role) for role in Role]
    assert all(has(Role.VIEWER, right) for right in (Right.SEE, Right.STOP)), "stop is for everybody who can see"
    assert [role.value for role in Role if has(role, Right.OPERATE)] == ["operator", "engineer", "admin"]
    assert [role.value for role in Role if has(role, Right.ENGINEER)] == ["engineer", "admin"]
    assert [role.value for role in Role if has(role, Right.ACCESS)] == ["admin"]


def test_the_page_of_accounts_offers_the_roles_that_there_are() -> None:
    """The page has its own list, with a text for each role that is translated."""
    script = (ROOT / "bench_service" / "pages" / "static" / "accounts.js").read_text(encoding="utf-8")
    listed = re.search(r"^const ROLES = \[(.+)\];$", script, re.MULTILINE)
    assert listed is not None
    assert re.findall(r'\["(\w+)", t\(', listed[1]) == [role.value for role in Role]
