"""`off`: the sensor falls silent."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from simscen.core.sensing import Reading
from simscen.faults.base import Disturbance, Fault, Wheels
from simscen.spec.base import Spec


class Off(Spec, Fault):
    """No message arrives any more, as when a cable comes loose.

    Example: `{sensor: lidar, off: {}, when: {time: 10 s}, for: 3 s}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Bump", "Image"})

    def begin(self, chance: np.random.Generator, wheels: Wheels) -> Disturbance:
        """Silence."""
        return _Silence()


class _Silence(Disturbance):
    def reading(self, reading: Reading) -> Reading | None:
        return None
