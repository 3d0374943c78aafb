"""The matrix of roles and routes, over HTTP: each verb of each route by each role, and by nobody."""

from collections.abc import Generator

import httpx
import pytest

from bench_service.access.roles import Right, Role
from tests.kit.people import House, house
from tests.kit.rights_page import RouteRight, allowed, routes

ROUTES = list(routes())
REFUSED = (401, 403)
FILLED = {"bench_id": "none", "number": "1", "name": "none", "format": "csv"}


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Generator[House]:
    with house(tmp_path_factory.mktemp("rights")) as made:
        made.add_account("ada")
        yield made


@pytest.fixture(scope="module")
def senders(home: House) -> Generator[dict[str, httpx.Client]]:
    clients = {role.value: home.program(f"{role.value}-program", role.value) for role in Role}
    clients["nobody"] = home.client(**{"X-Forwarded-For": "192.0.2.7"})  # from another host, as a proxy here says
    yield clients
    for client in clients.values():
        client.close()


def ask(client: httpx.Client, one: RouteRight) -> httpx.Response:
    """Ask for a thing that is not there, with a body that no route takes: nothing is done, whoever asks."""
    path = one.path
    for part in [piece for piece in one.path.replace(".svg", "").split("/") if piece.startswith("{")]:
        path = path.replace(part, FILLED.get(part.strip("{}"), "none"))
    json = {"no such field": 1} if one.method in ("POST", "PUT", "PATCH") else None
    with client.stream(one.method, path, json=json) as answer:
        if not answer.headers.get("content-type", "").startswith("text/event-stream"):
            answer.read()
        return answer


@pytest.mark.parametrize("one", ROUTES, ids=[f"{one.method} {one.path}" for one in ROUTES])
def test_each_role_may_do_what_the_matrix_says(senders: dict[str, httpx.Client], one: RouteRight) -> None:
    for role in Role:
        answer = ask(senders[role.value], one)
        if allowed(one.right, role):
            assert answer.status_code not in REFUSED, (role, answer.text)
            assert "/log-in" not in answer.headers.get("location", "")
        else:
            assert answer.status_code == 403, (role, answer.text)
            assert answer.json()["type"] == "/problems/NotAllowed"
    answer = ask(senders["nobody"], one)
    if one.right is Right.OPEN:
        assert answer.status_code not in REFUSED
    elif answer.status_code == 303:
        assert not one.shown, "a page leads to the log-in, the API does not"
        assert answer.headers["location"].startswith("/log-in")
    else:
        assert (answer.status_code, answer.json()["type"]) == (401, "/problems/NotLoggedIn"), answer.text


def test_the_document_declares_how_each_operation_is_authenticated(home: House) -> None:
    document = home.owner.get("/openapi.json").json()
    schemes = document["components"]["securitySchemes"]
    assert schemes["token"] == {**schemes["token"], "type": "http", "scheme": "bearer"}
    assert schemes["session"]["in"] == "cookie"
    rights = {(one.method.lower(), one.path): one for one in ROUTES if one.shown}
    found = {
        (method, path): operation
        for path, item in document["paths"].items()
        for method, operation in item.items()
        if method in ("get", "put", "post", "delete", "patch")
    }
    assert found.keys() == rights.keys()
    for key, operation in found.items():
        right = rights[key].right
        assert (operation["security"] == []) == (right is Right.OPEN), key
        names = {name for alternative in operation["security"] for name in alternative}
        assert names <= schemes.keys()
        if right not in (Right.OPEN, Right.STOP):
            assert {"token"} in [set(one) for one in operation["security"]]
            by_cookie = {"session"} if key[0] == "get" else {"session", "csrf"}
            assert by_cookie in [set(one) for one in operation["security"]]
        assert (operation["x-needs-role"] is None) == (right is Right.OPEN)
