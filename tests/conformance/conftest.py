"""What is slow the first time is done before a test with deadlines begins."""

import asyncio

import pytest

from simulators.world import WorldConfig, build


@pytest.fixture(scope="session", autouse=True)
def _noise_is_made_once() -> None:
    """The first launch of a process takes seconds (imports, tables of the noise), later ones milliseconds."""
    bench = build(WorldConfig())
    asyncio.run(bench.supply.switch_on())
    asyncio.run(bench.clock.sleep(1.0))
