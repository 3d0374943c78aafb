"""The sentence about an unexpected error: it names the place that a procedure's author looks at first."""

from functools import partial
from pathlib import Path

import pytest

from bench_service.telemetry.defects import described


def raised(file: str, *further: str) -> Exception:
    """An error that was raised in `further[-1]`, which was called from the files before it."""
    code = compile("def analyse(call):\n    call()\n", file, "exec")
    names: dict = {}
    exec(code, names)

    def boom() -> None:
        raise ValueError("boom")

    call = boom
    for inner in reversed(further):
        space: dict = {}
        exec(compile("def helper(call):\n\n    call()\n", inner, "exec"), space)
        call = partial(space["helper"], call)
    try:
        names["analyse"](call)
    except ValueError as error:
        return error
    raise AssertionError


ROOT = Path(__file__).resolve().parents[2]
TUMBLE, FRAMES, REST = (f"{ROOT}/procedures/{name}.py" for name in ("catalog/tumble", "core/frames", "methods/rest"))


@pytest.mark.parametrize(
    ("files", "place"),
    [
        ((TUMBLE,), "procedures/catalog/tumble.py, line 2, in analyse"),
        (
            (TUMBLE, FRAMES),
            "procedures/catalog/tumble.py, line 2, in analyse; raised in procedures/core/frames.py, line 3, in helper",
        ),
        ((REST, "/opt/elsewhere/fit.py"), "procedures/methods/rest.py, line 2, in analyse"),
        ((FRAMES, "/opt/elsewhere/fit.py"), "procedures/core/frames.py, line 2, in analyse"),
    ],
)
def test_the_place_that_an_author_looks_at_comes_first(files: tuple[str, ...], place: str) -> None:
    assert described(raised(*files)) == f"ValueError: boom ({place})"


def test_an_error_without_message_or_place_is_its_kind() -> None:
    assert described(StopAsyncIteration()) == "StopAsyncIteration"
