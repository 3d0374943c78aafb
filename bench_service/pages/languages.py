"""Languages of the pages: one gettext catalogue for templates and scripts; the texts in the code are English."""

import hashlib
import json
from contextvars import ContextVar
from functools import cache
from gettext import GNUTranslations, NullTranslations
from importlib.resources import files
from io import BytesIO

import polib
from fastapi import Request, Response
from fastapi.responses import RedirectResponse

from bench_service.model.errors import NotFound
from bench_service.pages.caching import kept
from bench_service.routing import Routes

router = Routes(include_in_schema=False)

LANGUAGES = {"en": "English", "uk": "Українська"}
COOKIE = "bench_language"
A_YEAR_S = 31_536_000
LANGUAGE: ContextVar[str] = ContextVar("LANGUAGE", default="en")
"""Language of the page that is made now."""


@cache
def catalogue(language: str) -> polib.POFile:
    """Return the gettext catalogue of a language; of English it is empty."""
    if language == "en":
        return polib.POFile()
    text = (files("bench_service.pages") / "words" / f"{language}.po").read_text(encoding="utf-8")
    return polib.pofile(text)


@cache
def _translations(language: str) -> NullTranslations:
    found = catalogue(language)
    return GNUTranslations(BytesIO(found.to_binary())) if found else NullTranslations()


def translated(text: str) -> str:
    """Return a text in the language of the page that is made now."""
    return _translations(LANGUAGE.get()).gettext(text)


def translated_number(one: str, many: str, number: int) -> str:
    """Return a text about a number of things in the language of the page, in the right plural."""
    return _translations(LANGUAGE.get()).ngettext(one, many, number)


def language_of(request: Request) -> str:
    """Return the language of a request: the chosen one, else the first that the browser asks for and that we have."""
    chosen = request.cookies.get(COOKIE, "")
    if chosen in LANGUAGES:
        return chosen
    for wanted in request.headers.get("accept-language", "").split(","):
        if (tag := wanted.partition(";")[0].strip().lower()[:2]) in LANGUAGES:
            return tag
    return "en"


@cache
def _words(language: str) -> str:
    texts = {entry.msgid: entry.msgstr for entry in catalogue(language) if entry.msgstr}
    return f"export default {json.dumps(texts, ensure_ascii=False, sort_keys=True)};\n"


def words_address(language: str) -> str:
    """Return the address of a language's texts for scripts."""
    version = hashlib.sha256(_words(language).encode()).hexdigest()[:16]
    return f"/words/{language}.js?v={version}"


@router.get("/words/{language}.js")
def words(language: str, request: Request) -> Response:
    """Return the texts of a language as a JavaScript module. Raises `NotFound` for an unknown language."""
    if language not in LANGUAGES:
        raise NotFound("language", language, ", ".join(LANGUAGES))
    text = _words(language)
    return kept(request, hashlib.sha256(text.encode()).hexdigest()[:16], "text/javascript", lambda: text)


@router.get("/language/{language}")
def choose_language(language: str, request: Request) -> Response:
    """Set the cookie with the chosen language, and redirect to the page that asked. Raises `NotFound` for an unknown
    language.
    """
    if language not in LANGUAGES:
        raise NotFound("language", language, ", ".join(LANGUAGES))
    back = request.query_params.get("back", "/")
    own = back if back.startswith("/") and not back.startswith(("//", "/\\")) else "/"
    answer = RedirectResponse(own, status_code=303)
    answer.set_cookie(COOKIE, language, max_age=A_YEAR_S, samesite="strict", httponly=True)
    return answer
