"""Every random consumer has its own named stream, so that adding one thing reshuffles nothing else."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

LARGEST_SEED = 2**32 - 1


@dataclass(frozen=True)
class Streams:
    """Random streams derived from (seed, name); `seed` lies in 1 … 2³²-1.

    `whose` is the robot whose streams they are where there are several: no two draw the same.
    """

    seed: int
    whose: str = ""

    def __post_init__(self) -> None:
        if not 1 <= self.seed <= LARGEST_SEED:
            raise ValueError(f"seed must lie in 1 … {LARGEST_SEED}, got {self.seed}")

    def generator(self, name: str) -> np.random.Generator:
        """A fresh generator for the consumer `name`, e.g. "sensor.lidar" or "fault.slip"."""
        return np.random.Generator(np.random.PCG64(np.random.SeedSequence(self._words(name))))

    def integer(self, name: str) -> int:
        """A seed in 1 … 2³²-1 for an engine with a generator of its own, e.g. "planner#3" for OMPL."""
        return self._words(name)[0] or 1

    def _words(self, name: str) -> list[int]:
        whose = f"{self.whose}/" if self.whose else ""
        digest = hashlib.sha256(f"{self.seed}/{whose}{name}".encode()).digest()
        return [int.from_bytes(digest[i : i + 4], "little") for i in range(0, 32, 4)]
