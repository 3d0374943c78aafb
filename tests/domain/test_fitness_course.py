"""Each kind of fault in foreign recordings is found and named, each kind of sound one left alone, one input a kind.

Twenty and forty inputs a kind are judged by `make validate`.
"""

import numpy as np
import pytest

from tests.validation.inspection import missed, named
from tests.validation.inspection_faults import FAULTS
from tests.validation.inspection_records import SOUND

SEED = 7


@pytest.mark.parametrize("kind", FAULTS)
def test_a_fault_is_found_where_it_is(kind: str) -> None:
    assert not missed(FAULTS[kind](np.random.default_rng(SEED)))


@pytest.mark.parametrize("kind", SOUND)
def test_a_sound_recording_is_left_alone(kind: str) -> None:
    assert not named(SOUND[kind](np.random.default_rng(SEED)))
