"""The commands of the database: its size and reports, a check of everything stored, a copy, and a restoration."""

import hashlib
import json
from pathlib import Path
from typing import Annotated

import typer

from bench_service.cli.asking.client import call, connect
from bench_service.cli.files import check_folder
from bench_service.cli.options import AsJson, Server, console
from bench_service.cli.refusal import Refused
from bench_service.settings import Settings


def database(context: typer.Context, server: Server = None, as_json: AsJson = False) -> None:
    """Show the size of the database, and the outcome of its last check and its last copy."""
    wanted = ("kind", "stored_bytes", "last_scrub", "last_backup")
    with connect(context.obj, server, drive=False) as client:
        found = call(client, "GET", "/api/v1/database", wanted)
    if as_json:
        print(json.dumps(found, indent=2))
        return
    sizes = f"{found['stored_bytes']} bytes"
    if found["log_bytes"] is not None:
        sizes += f", log {found['log_bytes']} bytes, {found['free_bytes']} bytes free on its disk"
    console.print(f"{found['kind']}, revision {found['revision']}: {sizes}", soft_wrap=True)
    for name, report in (("check", found["last_scrub"]), ("copy", found["last_backup"])):
        if report is None:
            console.print(f"last {name}: none")
            continue
        outcome = "good" if report["good"] else "NOT good"
        console.print(f"last {name}: {report['ended_at']}, {outcome}", soft_wrap=True)
        console.print_json(json.dumps(report["document"]))


def scrub(context: typer.Context, as_json: AsJson = False) -> int:
    """Check the database's integrity and every stored chunk against its hash; also while a service uses it.

    The outcome is stored, and `bench database` shows it. Exit code: 0 all as it was stored, 1 damage was found, 2 not
    checked.
    """
    from bench_service.bench.processes import ProcessIdentity
    from bench_service.evidence.upkeep import UpkeepService, sentence
    from bench_service.persistence import open_stores
    from bench_service.persistence.upkeep.contents import DatabaseContents

    settings: Settings = context.obj
    _require_database(settings)
    stores, opened = open_stores(settings.database_url, settings.copies_in())
    try:
        report = UpkeepService(stores, DatabaseContents(opened), f"bench scrub, {ProcessIdentity.own()}").scrub()
    finally:
        opened.dispose()
    if report is None:
        raise Refused("the check was not made")
    if as_json:
        print(json.dumps(report.document, indent=2))
    else:
        console.print(sentence(report), soft_wrap=True)
    return 0 if report.good else 1


def backup(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(dir_okay=False, help="New file; always an SQLite file, whatever it copies")],
    as_json: AsJson = False,
) -> int:
    """Copy the whole database to one file while services use it, and check the copy.

    Everything that was acknowledged before the command began is in it. A running job continues, once restored, with the
    stations that it has not recorded. Exit code: 0 made and good, 1 made, and damage was found in it, 2 not made.
    """
    from bench_service.bench.processes import ProcessIdentity
    from bench_service.persistence.upkeep.backups import back_up

    settings: Settings = context.obj
    check_folder(file)
    _require_database(settings)
    contents = back_up(settings.database_url, file, f"bench backup, {ProcessIdentity.own()}")
    document = {
        "file": str(file.absolute()),
        "bytes": file.stat().st_size,
        "sha256": _digest(file),
        "revision": contents.revision,
        "rows": contents.rows,
        "faults": list(contents.faults),
    }
    if as_json:
        print(json.dumps(document, indent=2))
    else:
        console.print(
            f"{file}: {document['bytes']} bytes, {contents.rows.get('jobs', 0)} jobs, "
            f"{contents.rows.get('recordings', 0)} recordings, {contents.chunks} chunks, sha256 {document['sha256']}",
            soft_wrap=True,
        )
        for fault in contents.faults:
            console.print(f"damage: {fault}", soft_wrap=True)
    return 1 if contents.faults else 0


def restore(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, help="A copy that `bench backup` made")],
    replace: Annotated[
        bool, typer.Option("--replace", help="Put an SQLite database that exists aside, under another name")
    ] = False,
) -> None:
    """Make the database from a copy: an SQLite file, or an empty Postgres database. No service may use it meanwhile."""
    from bench_service.persistence.upkeep.contents import check_copy
    from bench_service.persistence.upkeep.restoring import restore_database

    settings: Settings = context.obj
    contents = check_copy(file)
    if contents.faults:
        raise Refused(f"{file} is damaged: {'; '.join(contents.faults[:3])}")
    aside = restore_database(file, settings.database_url, replace)
    for path in aside:
        console.print(f"put aside: {path}", soft_wrap=True)
    console.print(
        f"restored {contents.rows.get('jobs', 0)} jobs and {contents.rows.get('recordings', 0)} recordings from {file}",
        soft_wrap=True,
    )


def _require_database(settings: Settings) -> None:
    """Check that an SQLite database is there: opening one that is not would make it. Raises `Refused`."""
    from bench_service.persistence.database import missing_file

    missing = missing_file(settings.database_url)
    if missing is not None:
        raise Refused(f"there is no database {missing}: BENCH_DATABASE_URL names another")


def _digest(file: Path) -> str:
    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()
