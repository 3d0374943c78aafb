"""JSON that everything can hold: what passes the rule can be written and read as it was, what does not is named."""

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench_service.formats.plain_json import DEPTH, faults, read_back, shown

TEXTS = st.text(st.characters(exclude_categories=()), max_size=5)
"""With NUL and halves of surrogate pairs."""
DOCUMENTS = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | TEXTS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(TEXTS, inner, max_size=4),
)


def at(document: Any, path: tuple[str | int, ...]) -> Any:
    for part in path:
        document = document[part]
    return document


def can_be_held(document: Any) -> bool:
    """Whether it is UTF-8 without NUL when it is written, all in finite numbers."""
    try:
        return rb"\u0000" not in json.dumps(document, allow_nan=False, ensure_ascii=False).encode()
    except ValueError:
        return False


@given(DOCUMENTS)
def test_a_document_without_a_fault_is_written_and_read_as_it_was(document: Any) -> None:
    assert can_be_held(document) == (not list(faults(document)))
    if can_be_held(document):
        text = json.dumps(document)
        assert read_back(text) == document
        assert read_back(text.encode()) == document


@given(DOCUMENTS)
def test_a_fault_is_where_it_says(document: Any) -> None:
    for fault in faults(document):
        there = at(document, fault.path)
        assert fault.value is there or fault.value == fault.path[-1]


@given(DOCUMENTS)
def test_whatever_was_stored_can_be_told(document: Any) -> None:
    told = read_back(json.dumps(document))
    assert {fault.allowed for fault in faults(told)} <= {fault.allowed for fault in faults(document)}
    json.dumps(told, ensure_ascii=False).encode()


@given(TEXTS)
def test_a_text_that_is_shown_is_one_that_can_be_held(text: str) -> None:
    assert not list(faults(shown(text)))
    assert (shown(text) == text) == (not list(faults(text)))


@pytest.mark.parametrize("nest", [lambda inner: [inner], lambda inner: {"a": inner}])
def test_the_depth_is_counted_in_lists_and_objects(nest: Any) -> None:
    document: Any = 0
    for _ in range(DEPTH):
        document = nest(document)
    assert not list(faults(document))
    (fault,) = faults(nest(document))
    assert len(fault.path) == DEPTH
