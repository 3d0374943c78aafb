"""A page as a test reads it."""

import html
import re
from html.parser import HTMLParser
from xml.etree import ElementTree

from tests.service.client import Client

VOID = {"meta", "link", "br", "hr", "img", "input"}


class Page(HTMLParser):
    """Reads a page and complains about tags that do not fit together."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.words = ""
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words += data


def page(client: Client, path: str) -> Page:
    """A page that is whole and does not show the service's insides."""
    answer = client.http.get(path)
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    read = Page(answer.text)
    assert read.tags[:2] == ["html", "head"]
    assert "Traceback" not in answer.text
    assert "Undefined" not in read.words
    assert "The emergency stop is a hardware circuit" in read.words
    return read


def drawn(client: Client, text: str) -> int:
    """How many figures a page shows; each is fetched as a browser does, and is a drawing that runs nothing."""
    addresses = [html.unescape(found) for found in re.findall(r'<img src="([^"]*)"', text)]
    for address in addresses:
        answer = client.http.get(address)
        assert (answer.status_code, answer.headers["content-type"]) == (200, "image/svg+xml"), answer.text
        assert "immutable" in answer.headers["cache-control"]
        root = ElementTree.fromstring(answer.text)
        assert root.tag == "{http://www.w3.org/2000/svg}svg"
        assert not [e for e in root.iter() if e.tag.endswith("}script") or any(a.startswith("on") for a in e.attrib)]
    return len(addresses)
