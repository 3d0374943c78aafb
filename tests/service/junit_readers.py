"""Rules of readers of JUnit XML, as checks of our own.

There is no standard. The strictest reader in wide use is Jenkins' xUnit plugin, which refuses a report that its schema
(junit-10.xsd, version 10) does not allow: the elements, attributes and form of times below are what that schema says.
GitLab and the GitHub reporters take any such document; they show `name` and `classname` of a case, `message` or text of
its outcome, and add up what the cases say themselves, so the counts must agree with them.
"""

import re
from xml.etree import ElementTree

OUTCOMES = {"failure", "error", "skipped"}
ELEMENTS: dict[str, tuple[set[str], set[str], set[str]]] = {
    "testsuites": (set(), {"name", "time", "tests", "failures", "errors"}, {"testsuite"}),
    "testsuite": (
        {"name", "tests", "failures", "errors"},
        {"skipped", "time", "timestamp", "hostname", "id", "package", "group", "file", "log", "url"},
        {"testsuite", "properties", "testcase", "system-out", "system-err"},
    ),
    "testcase": ({"name"}, {"classname", "time", "group"}, OUTCOMES | {"system-out", "system-err"}),
    "properties": (set(), set(), {"property"}),
    "property": ({"name", "value"}, set(), set()),
    "system-out": (set(), set(), set()),
    **{outcome: (set(), {"type", "message"}, set()) for outcome in OUTCOMES},
}
"""Element -> attributes that it must have, others that it may have, and what may be inside."""
TIME = re.compile(r"[0-9]*(\.[0-9]*)?")
"""Decimal seconds, with neither sign nor exponent."""
TIMESTAMP = re.compile(r"\d{4}-\d{2}-\d{2}T\d{2}:\d{2}:\d{2}")
CONTROL = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f]")


def assert_readable(document: bytes) -> None:
    """A document that such readers take as it is meant."""
    text = document.decode("utf-8")
    assert text.startswith("<?xml ")
    assert not CONTROL.search(text)
    root = ElementTree.fromstring(document)
    assert root.tag == "testsuites"
    for element in root.iter():
        must, may, inside = ELEMENTS[element.tag]
        assert must <= set(element.keys()) <= must | may, (element.tag, element.attrib)
        assert {child.tag for child in element} <= inside, element.tag
        if "time" in element.keys():  # noqa: SIM118  an element's truth and membership are of its children
            assert TIME.fullmatch(element.get("time", "")), element.attrib
    for suite in root:
        _assert_suite(suite)
    for name in ("tests", "failures", "errors"):
        assert _number(root, name) == sum(_number(suite, name) for suite in root)


def _assert_suite(suite: ElementTree.Element) -> None:
    cases = suite.findall("testcase")
    assert cases, "a suite without a case is shown by nobody"
    assert _number(suite, "tests") == len(cases)
    for name, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        assert _number(suite, name) == sum(case.find(tag) is not None for case in cases)
    assert TIMESTAMP.fullmatch(suite.get("timestamp", ""))
    assert float(suite.get("time", "")) == round(sum(float(case.get("time", "")) for case in cases), 3)
    for case in cases:
        assert case.get("name")
        assert case.get("classname")
        assert sum(child.tag in OUTCOMES for child in case) <= 1, "one case has one outcome"
        assert all(child.get("message") for child in case if child.tag in OUTCOMES)


def _number(element: ElementTree.Element, name: str) -> int:
    return int(element.get(name, ""))
