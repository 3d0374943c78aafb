"""One service for all tests of clients: a process has one job engine."""

from collections.abc import Generator

import pytest

from tests.kit.served import served


@pytest.fixture(scope="session")
def address(tmp_path_factory: pytest.TempPathFactory) -> Generator[str]:
    """A service on a loopback port."""
    with served(tmp_path_factory.mktemp("served")) as at:
        yield at
