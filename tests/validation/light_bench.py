"""A light bench for validations of many campaigns: its table follows a demand exactly, without the servo in MuJoCo.

The servo leaves hundredths of an arcsecond at rest and nothing in a whole turn (`docs/simulation`), and most of a
campaign's processor time. Pointing, orthogonality, level and azimuth, all of the unit, and every random draw stay.
"""

from typing import Any

import numpy as np

from simulators.truth import Array
from simulators.turntable import device
from simulators.turntable.plant import Plant
from simulators.turntable.profile import Profile


class ExactTable(Plant):
    """A plant whose axes are where the profile says, at each step."""

    def run(self, profile: Profile, first_step: int, steps: int) -> Array:
        """Follow a profile for some steps; joint angles, (steps + 1, 3)."""
        times: Array = (first_step + 1.0 + np.arange(steps)) * self.step_s
        position, rate = profile.at(times)
        path = np.concatenate([self._state[None, 1:4], position])
        self._state = np.concatenate([[0.0], position[-1], rate[-1], np.zeros(3)])
        return path


def use() -> None:
    """Put the light bench in the place of the one that ships, in this process."""
    of_device: Any = device
    of_device.Plant = ExactTable


def in_use() -> bool:
    """Return whether this process has the light bench."""
    return getattr(device, "Plant", Plant) is ExactTable
