"""A service for the tests of a file: a process has one job engine at a time."""

from collections.abc import Generator

import pytest

from tests.kit.served import served


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Generator[str]:
    """A service on a loopback port."""
    with served(tmp_path_factory.mktemp("served")) as at:
        yield at
