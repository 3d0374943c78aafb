"""``bench user``, ``bench token`` and ``bench audit``: accounts, tokens and the check of the audit trail.

Without ``--server`` they work in this process, as the owner of the service's files: so the first account is made, and a
forgotten password replaced.
"""

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer

from bench_service.access.roles import Role
from bench_service.cli.asking.client import answer, call, connect, segment
from bench_service.cli.files import text_of
from bench_service.cli.options import AsJson, Server, console, notice, wide
from bench_service.cli.refusal import Refused

users = typer.Typer(no_args_is_help=True, help="Accounts of people: the first one switches log-in on.")
tokens = typer.Typer(no_args_is_help=True, help="Named tokens of programs.")
trail = typer.Typer(no_args_is_help=True, help="Check the audit trail, or close its old entries.")

RoleOption = Annotated[Role, typer.Option(help="Role of the account or token")]
TeamOption = Annotated[str, typer.Option(help="Team whose reservations count for it")]
PasswordFile = Annotated[
    Path | None, typer.Option(help="File with the password, - for standard input; without it, it is asked for")
]
ACCOUNT, TOKEN = ("name", "role"), ("id", "name")


@users.command("add")
def add_user(
    context: typer.Context,
    name: str,
    role: RoleOption,
    team: TeamOption = "",
    password_file: PasswordFile = None,
    no_password: Annotated[
        bool, typer.Option("--no-password", help="This person logs in only through a trusted proxy")
    ] = False,
    server: Server = None,
) -> None:
    """Add an account of a person. The first one is an admin's, and switches log-in on."""
    password = None if no_password else _password(password_file)
    body = {"name": name, "role": role.value, "team": team, "password": password}
    with connect(context.obj, server, drive=False) as client:
        made = call(client, "POST", "/api/v1/accounts", ACCOUNT, json=body)
    console.print(f"account {made['name']}, {made['role']}{_of_team(made)}")


@users.command("list")
def list_users(context: typer.Context, server: Server = None, as_json: AsJson = False) -> None:
    """List the accounts of people."""
    with connect(context.obj, server, drive=False) as client:
        found = answer(client, "GET", "/api/v1/accounts").json()
    _show(found, ("name", "role", "team", "has_password", "created_at", "created_by"), as_json)


@users.command("set")
def set_user(
    context: typer.Context,
    name: str,
    role: Annotated[Role | None, typer.Option(help="New role")] = None,
    team: Annotated[str | None, typer.Option(help="New team")] = None,
    password: Annotated[bool, typer.Option("--password", help="Ask for a new password")] = False,
    password_file: PasswordFile = None,
    server: Server = None,
) -> None:
    """Change role, team or password of an account. A new password ends its sessions and unlocks the name."""
    new = _password(password_file) if password or password_file is not None else None
    body = {"role": None if role is None else role.value, "team": team, "password": new}
    if all(value is None for value in body.values()):
        raise Refused("nothing is changed: give --role, --team or --password")
    with connect(context.obj, server, drive=False) as client:
        made = call(client, "PATCH", f"/api/v1/accounts/{segment(name)}", ACCOUNT, json=body)
    console.print(f"account {made['name']}, {made['role']}{_of_team(made)}")


@users.command("remove")
def remove_user(context: typer.Context, name: str, server: Server = None) -> None:
    """Remove an account and end its sessions. The last admin stays; the only account may go: log-in is then off."""
    with connect(context.obj, server, drive=False) as client:
        answer(client, "DELETE", f"/api/v1/accounts/{segment(name)}")
    console.print(f"account {name} is removed")


@tokens.command("add")
def add_token(
    context: typer.Context,
    name: str,
    role: RoleOption,
    team: TeamOption = "",
    days: Annotated[float, typer.Option(help="Time until it expires [d], 366 at most")] = 90.0,
    server: Server = None,
    as_json: AsJson = False,
) -> None:
    """Make a token. It is printed this once: on standard output the token alone."""
    body = {"name": name, "role": role.value, "team": team, "days": days}
    with connect(context.obj, server, drive=False) as client:
        made = call(client, "POST", "/api/v1/tokens", (*TOKEN, "token"), json=body)
    if as_json:
        print(json.dumps(made, indent=2))
        return
    notice(f"token {made['name']}, {made['role']}{_of_team(made)}, until {made['expires_at']}; it is not shown again:")
    print(made["token"])


@tokens.command("list")
def list_tokens(context: typer.Context, server: Server = None, as_json: AsJson = False) -> None:
    """List the tokens, newest first, with those that are revoked or expired."""
    with connect(context.obj, server, drive=False) as client:
        found = answer(client, "GET", "/api/v1/tokens").json()
    _show(found, ("id", "name", "role", "team", "expires_at", "revoked_at", "last_used_at", "created_by"), as_json)


@tokens.command("revoke")
def revoke_token(context: typer.Context, token: str, server: Server = None) -> None:
    """Revoke a token by its name or id. Jobs that were submitted with it continue."""
    with connect(context.obj, server, drive=False) as client:
        gone = call(client, "DELETE", f"/api/v1/tokens/{segment(token)}", TOKEN)
    console.print(f"token {gone['name']} ({gone['id']}) is revoked")


@trail.command("verify")
def verify(
    context: typer.Context,
    expect: Annotated[
        str | None, typer.Option(help="Digest that an earlier check printed; it must still be in the chain")
    ] = None,
    server: Server = None,
    as_json: AsJson = False,
) -> int:
    """Check that no entry of the audit trail was changed, removed or put in between. Exit code 1: one was."""
    with connect(context.obj, server, drive=False) as client:
        query = {} if expect is None else {"expect": expect}
        found = call(client, "GET", "/api/v1/audit/chain", ("whole", "faults", "digest"), params=query)
    if as_json:
        print(json.dumps(found, indent=2))
    else:
        closed = f", after {len(found['checkpoints'])} closed stretches" if found["checkpoints"] else ""
        state = "whole" if found["whole"] else "BROKEN"
        console.print(f"{state}: {found['entries']} entries{closed}; the newest is {found['sequence']}", soft_wrap=True)
        for fault in found["faults"]:
            console.print(fault, soft_wrap=True)
        console.print(f"digest {found['digest']}", soft_wrap=True)
    return 0 if found["whole"] else 1


@trail.command("close")
def close(
    context: typer.Context,
    before: Annotated[str, typer.Option(help="Time with its zone, such as 2026-01-01T00:00:00Z")],
    server: Server = None,
) -> None:
    """Remove the entries before a moment, whose retention has ended; a checkpoint stays in their place."""
    with connect(context.obj, server, drive=False) as client:
        made = answer(client, "POST", "/api/v1/audit/close", json={"before": before}).json()
    for one in made:
        console.print(f"entries {one['first']} … {one['last']} are closed: digest {one['digest']}", soft_wrap=True)
    if not made:
        console.print("no entry is that old")


def _of_team(made: dict[str, Any]) -> str:
    return f" of team {made['team']}" if made["team"] else ""


def _password(file: Path | None) -> str:
    """A password from a file or standard input, or from a person, twice and unseen. Raises `Refused`."""
    if file is None:
        return typer.prompt("Password", hide_input=True, confirmation_prompt=True, err=True)
    text = sys.stdin.readline() if str(file) == "-" else text_of(file)
    return text.rstrip("\r\n")


def _show(found: list[dict[str, Any]], columns: tuple[str, ...], as_json: bool) -> None:
    if as_json:
        print(json.dumps(found, indent=2))
        return
    from rich.table import Table

    table = Table(*columns)
    for one in found:
        table.add_row(*("–" if one[name] in (None, "") else str(one[name]) for name in columns))
    wide().print(table)
