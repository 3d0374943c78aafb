"""Verbs of simulated devices that wait for nothing, called from code that cannot wait."""

from collections.abc import Coroutine
from typing import Any, TypeVar

T = TypeVar("T")


def at_once(verb: Coroutine[Any, Any, T]) -> T:
    """Run a verb that never suspends. Raises what it raises, `RuntimeError` where it waits."""
    try:
        verb.send(None)
    except StopIteration as done:
        return done.value
    verb.close()
    raise RuntimeError("the verb waits")
