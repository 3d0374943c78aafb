"""Rendering shared by all pages: templates, the filters in them, and the service behind the request."""

import json
import re
from datetime import UTC, datetime
from math import isfinite
from pathlib import Path
from typing import Any, cast

from fastapi import Request
from fastapi.templating import Jinja2Templates
from markupsafe import Markup, escape

from bench_service.access.identity import Identity, Proof
from bench_service.formats.printed import digits
from bench_service.model.errors import ServiceError
from bench_service.pages import figures
from bench_service.pages.languages import (
    LANGUAGE,
    LANGUAGES,
    language_of,
    translated,
    translated_number,
    words_address,
)
from bench_service.pages.static_files import asset, module
from bench_service.service import BenchService


def service_of(request: Request) -> BenchService:
    """Return the service that the application serves."""
    return request.app.state.service


def _shell(request: Request) -> dict[str, Any]:
    """Frame of every page around its content. It needs no database: the stop stands on pages of errors, too."""
    figures.begin_drawing()
    language = language_of(request)
    LANGUAGE.set(language)
    service = service_of(request)
    try:
        benches = list(service.benches.ids())
    except ServiceError:
        benches = [] if service.live.own is None else [service.live.own]
    titles = service.catalogue.titles()
    return {
        "language": language,
        "languages": LANGUAGES,
        "words": words_address(language),
        "stop_benches": benches,
        "titled": lambda name: translated(titles.get(name, name)),
        "titles": json.dumps({name: translated(title) for name, title in titles.items()}, ensure_ascii=False),
    }


templates = Jinja2Templates(Path(__file__).parent / "templates", context_processors=[_shell])


def number(value: Any) -> str:
    """Return a table's cell as text: six significant digits, a dash for what is absent."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return translated("yes") if value else translated("no")
    return f"{value:.{digits.LEAST_DIGITS}g}" if isinstance(value, float) else str(value)


def who(request: Request) -> dict[str, Any]:
    """Return facts about the reader of a page: name and role, whether people log in here, and the value that changes
    must repeat.
    """
    identity: Identity | None = getattr(request.state, "identity", None)
    log_in_on = service_of(request).access.book.log_in_on
    if identity is None:
        return {"name": None, "role": None, "csrf": "", "log_in_on": log_in_on, "session": False}
    session = identity.proof is Proof.SESSION
    name, role = identity.proven_name, identity.role.value
    return {"name": name, "role": role, "csrf": identity.csrf or "", "log_in_on": log_in_on, "session": session}


def measured(value: Any, uncertainty: Any) -> str:
    """Return a value as text, to the last digit that its standard uncertainty bears: two significant digits of it."""
    if not _plain(value) or not _plain(uncertainty) or digits.places(uncertainty) is None:
        return number(value)
    return digits.to_uncertainty(value, uncertainty)


def doubt(uncertainty: Any) -> str:
    """Return a standard uncertainty as text of two significant digits."""
    if not _plain(uncertainty) or digits.places(uncertainty) is None:
        return number(uncertainty)
    return digits.two_digits(uncertainty)


def _plain(value: Any) -> bool:
    return isinstance(value, int | float) and isfinite(value)


def moment(value: datetime | str | None) -> Markup | str:
    """Return a moment as an HTML element that a script shows in local time; without scripts it shows UTC, and
    says so.
    """
    if not value:
        return "–"
    at = datetime.fromisoformat(value) if isinstance(value, str) else value
    utc = at.astimezone(UTC)
    text = utc.strftime("%Y-%m-%d %H:%M:%S UTC")
    return Markup('<time datetime="{}" title="{}">{}</time>').format(utc.isoformat(), text, text)


def duration(seconds: Any) -> str:
    """Return a time span as text, in the unit that fits it; a dash for None."""
    if not isinstance(seconds, int | float):
        return "–"
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.1f} h"


_TIMES = re.compile(r"[^0-9a-f]")


def short(identity: str) -> str:
    """Return the short name of a thing for a person: the last six characters of its id, which are random."""
    return _TIMES.sub("", identity)[-6:]


def words_of(value: Any) -> Markup:
    """Return a parameter as readable text: numbers as they are, lists and objects line by line, no Python notation."""
    if isinstance(value, dict):
        rows = (f"{escape(k)}: {words_of(v)}" for k, v in value.items())
        return Markup("; ").join(Markup(row) for row in rows) if value else Markup("–")
    if isinstance(value, list | tuple):
        return Markup(", ").join(words_of(v) for v in value) if value else Markup("–")
    return Markup(escape(number(value)))


templates.env.add_extension("jinja2.ext.i18n")
templates.env.install_gettext_callables(  # pyright: ignore[reportAttributeAccessIssue]
    translated, translated_number, newstyle=True
)
cast(dict[str, Any], templates.env.globals)["who"] = who
templates.env.filters |= {
    "number": number,
    "asset": asset,
    "module": module,
    "measured": measured,
    "doubt": doubt,
    "moment": moment,
    "duration": duration,
    "short": short,
    "words_of": words_of,
}
