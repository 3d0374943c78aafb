"""Routes of session, accounts, tokens and approvals."""

from typing import Annotated

from anyio import CapacityLimiter, to_thread
from fastapi import Path, Request, Response
from starlette.datastructures import Headers

from bench_service.access.credentials import LONGEST, digest_of
from bench_service.access.identity import Identity, Proof
from bench_service.access.service import AccessService
from bench_service.access.service import NewSession as OpenedSession
from bench_service.api.access.identify import COOKIE, SECURE_COOKIE, cookie_of, found_of
from bench_service.api.access.schemas import (
    AccountChange,
    AccountView,
    ApprovalView,
    LogIn,
    MadeToken,
    NewAccount,
    NewToken,
    SessionView,
    TokenView,
)
from bench_service.api.http.dependencies import Me, RequestedBy, Service
from bench_service.api.http.errors import problems
from bench_service.mapping import copied
from bench_service.routing import Routes

router = Routes(prefix="/api/v1", tags=["access"])
LOG_INS = CapacityLimiter(4)
"""Threads of log-ins: they wait for one another, and take none from other requests."""
AccountName = Annotated[str, Path(max_length=64)]
TokenName = Annotated[str, Path(max_length=64, description="Id or name of a token")]
ProcedureName = Annotated[str, Path(max_length=100)]
NEVER_KEPT = {"Cache-Control": "no-store"}


@router.get("/session", responses=problems())
async def read_session(request: Request, service: Service, response: Response) -> SessionView:
    """Tell who sends this request, with which role, and what it may do. Also without log-in."""
    response.headers.update(NEVER_KEPT)
    identity, book = found_of(request.scope).identity, service.access.book
    session = book.session(identity.credential) if identity and identity.proof is Proof.SESSION else None
    return SessionView.of(identity, book.log_in_on, None if session is None else session.over_at)


@router.post("/session", status_code=201, responses=problems(409, 413, 429, 507))
async def log_in(body: LogIn, request: Request, response: Response, service: Service) -> SessionView:
    """Log a person in: the answer sets a cookie, always with a new secret.

    After five failures in a row a name is locked for a minute, then for twice as long with each further one.
    """
    before = cookie_of(request.headers)
    address = request.client.host if request.client else "local"
    given = body.name.strip().lower(), body.password.get_secret_value(), address
    old = None if before is None else digest_of(before)
    opened = await to_thread.run_sync(service.access.log_in, *given, old, limiter=LOG_INS)
    secure = _is_secure(request)
    _set_cookie(response, opened, secure)
    return _view(service.access, opened)


def _set_cookie(response: Response, opened: OpenedSession, secure: bool) -> None:
    response.headers.update(NEVER_KEPT)
    response.set_cookie(
        SECURE_COOKIE if secure else COOKIE,
        opened.secret,
        max_age=int(LONGEST.total_seconds()),
        path="/",
        secure=secure,
        httponly=True,
        samesite="strict",
    )


def _view(access: AccessService, opened: OpenedSession) -> SessionView:
    account, session = opened.account, opened.session
    csrf = access.csrf_of_session(session)
    identity = Identity(account.name, account.role, Proof.SESSION, account.team, session.digest, csrf)
    return SessionView.of(identity, True, session.over_at)


def _is_secure(request: Request) -> bool:
    """Return whether the browser speaks HTTPS: to us, or to a proxy in front, which its own page's origin shows."""
    origin = Headers(scope=request.scope).get("origin", "")
    return request.url.scheme == "https" or origin.lower().startswith("https://")


@router.delete("/session", status_code=204, response_model=None, responses=problems(409, 507))
def log_out(me: Me, service: Service, response: Response) -> None:
    """Log out: the session ends at once, everywhere, and the browser forgets its cookie."""
    service.access.log_out(me)
    for name in (COOKIE, SECURE_COOKIE):
        response.delete_cookie(name, path="/", secure=name == SECURE_COOKIE, httponly=True, samesite="strict")


@router.get("/accounts", responses=problems())
def list_accounts(service: Service) -> list[AccountView]:
    """List the accounts of people by name."""
    return [AccountView.of(one) for _, one in sorted(service.access.book.state.accounts.items())]


@router.post("/accounts", status_code=201, responses=problems(404, 409, 413, 507))
def add_account(body: NewAccount, service: Service, me: Me) -> AccountView:
    """Add an account. The first one is an admin's and switches log-in on: until then it is made on the host."""
    password = None if body.password is None else body.password.get_secret_value()
    return AccountView.of(service.access.add_account(body.name, body.role, body.team, password, me.name))


@router.patch("/accounts/{name}", responses=problems(404, 409, 413, 507))
def change_account(name: AccountName, body: AccountChange, service: Service) -> AccountView:
    """Change role, team or password of an account. A new password ends its sessions and unlocks the name."""
    password = None if body.password is None else body.password.get_secret_value()
    return AccountView.of(service.access.change_account(name, body.role, body.team, password))


@router.delete("/accounts/{name}", status_code=204, response_model=None, responses=problems(404, 409, 507))
def remove_account(name: AccountName, service: Service, me: Me) -> None:
    """Remove an account and end its sessions. The last admin's stays."""
    service.access.remove_account(name, me)


@router.get("/tokens", responses=problems())
def list_tokens(service: Service) -> list[TokenView]:
    """List every token, newest first, with those that are revoked or expired."""
    return [TokenView.of(one) for one in service.access.tokens()]


@router.post("/tokens", status_code=201, responses=problems(404, 409, 413, 507))
def add_token(body: NewToken, service: Service, response: Response, me: Me) -> MadeToken:
    """Make a named token for a program. Its secret is in this answer and nowhere else."""
    made = service.access.add_token(body.name, body.role, body.team, body.lasting, me.name)
    response.headers.update(NEVER_KEPT)
    return copied(MadeToken, made.token, token=made.secret)


@router.delete("/tokens/{token}", responses=problems(404, 507))
def revoke_token(token: TokenName, service: Service) -> TokenView:
    """Revoke a token by its id or name, within a second everywhere. Jobs that were submitted with it continue."""
    return TokenView.of(service.access.revoke_token(token))


@router.get("/approvals", responses=problems())
def list_approvals(service: Service) -> list[ApprovalView]:
    """List the procedures that operators may run, each with its approved version."""
    return [ApprovalView.of(one) for one in service.access.approvals()]


@router.put("/procedures/{name}/approval", responses=problems(404, 507))
def approve_procedure(name: ProcedureName, service: Service, requested_by: RequestedBy) -> ApprovalView:
    """Approve the present version of a procedure: operators may run it. A later version needs a new approval."""
    procedure = service.catalogue.procedure(name)
    return ApprovalView.of(service.access.approve(name, procedure.version, requested_by or ""))


@router.delete("/procedures/{name}/approval", status_code=204, response_model=None, responses=problems(404, 507))
def withdraw_approval(name: ProcedureName, service: Service) -> None:
    """Withdraw the approval of a procedure; jobs that are queued stay."""
    service.access.withdraw(name)
