"""One thread at a time imports what a start leaves for later."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait

import pytest

from bench_service.drivers.simulated import SimulatedDriver
from procedures import catalog
from procedures.discovery import discovered
from procedures.importing import IMPORTING
from procedures.procedure import Procedure


def _catalogue() -> object:
    found = discovered(catalog.__name__, catalog.__path__, "PROCEDURE", Procedure, "no_operation")
    assert found.broken == {}
    return found.entries["no_operation"]


def _warm_up() -> object:
    return SimulatedDriver("sim").warm_up()


@pytest.mark.parametrize("imports", [_catalogue, _warm_up])
def test_an_import_waits_until_another_threads_import_is_done(imports: Callable[[], object]) -> None:
    with ThreadPoolExecutor(1) as other:
        with IMPORTING:
            begun = other.submit(imports)
            assert wait([begun], timeout=0.2).not_done
        begun.result(timeout=60)
