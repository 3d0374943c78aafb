"""English and Ukrainian from one catalogue: it is whole, its places are those of the texts, and pages speak it."""

import re

from bench_service.model.job import JobState
from bench_service.pages.languages import LANGUAGES, catalogue
from procedures.core.limits import Verdict
from tests.kit.page_texts import in_product, of_scripts, of_templates
from tests.service.client import Client

OF_VALUES = {str(state.value) for state in JobState} | {str(verdict.value) for verdict in Verdict}


def test_every_text_of_the_pages_is_translated_and_none_is_left_over() -> None:
    for language in LANGUAGES:
        if language == "en":
            continue
        known = {entry.msgid for entry in catalogue(language) if entry.msgstr}
        assert (of_templates() | of_scripts() | OF_VALUES) - known == set()
        assert [entry.msgid for entry in catalogue(language) if not entry.msgstr] == []
        others = known - of_templates() - of_scripts() - OF_VALUES
        assert others - in_product(others) == set()


def test_a_translation_has_the_places_of_its_text() -> None:
    def places(text: str) -> list[str]:
        return sorted(re.findall(r"\{\w+\}", text))

    assert [e.msgid for e in catalogue("uk") if places(e.msgid) != places(e.msgstr)] == []


def test_a_page_speaks_what_the_browser_asks_for_and_then_what_was_chosen(sqlite_client: Client) -> None:
    http = sqlite_client.http
    asked = http.get("/", headers={"Accept-Language": "fr, uk;q=0.8, en;q=0.5"}).text
    assert '<html lang="uk"' in asked
    assert "СТОП sim" in asked
    assert '<html lang="en"' in http.get("/", headers={"Accept-Language": "fr"}).text
    answer = http.get("/language/uk", params={"back": "/campaigns"}, follow_redirects=False)
    assert (answer.status_code, answer.headers["location"]) == (303, "/campaigns")
    assert "Кампанії" in http.get("/campaigns").text
    assert (
        http.get("/language/uk", params={"back": "//evil.example"}, follow_redirects=False).headers["location"] == "/"
    )
    assert http.get("/language/xx").status_code == 404
    words = http.get("/words/uk.js")
    assert words.headers["content-type"].startswith("text/javascript")
    assert '"Stopping …": "Зупиняємо …"' in words.text
    http.cookies.clear()
