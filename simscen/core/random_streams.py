"""Named random streams. Each consumer has its own, so that a new one does not change the numbers of the others."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

MAX_SEED = 2**32 - 1
"""Greatest seed that all libraries accept: an unsigned number of 32 bits."""


@dataclass(frozen=True)
class Streams:
    """Random streams that are derived from a seed and the name of the consumer.

    `seed` is in 1 … MAX_SEED; other values raise ValueError. `robot` makes the streams of several robots independent;
    "" for a single robot.
    """

    seed: int
    robot: str = ""

    def __post_init__(self) -> None:
        if not 1 <= self.seed <= MAX_SEED:
            raise ValueError(f"seed must be in 1 … {MAX_SEED}, got {self.seed}")

    def generator(self, name: str) -> np.random.Generator:
        """Return a new generator for the consumer `name`, e.g. "sensor.lidar" or "fault.slip".

        Each call with the same name returns a generator that starts with the same numbers.
        """
        return np.random.Generator(np.random.PCG64(np.random.SeedSequence(self._words(name))))

    def integer(self, name: str) -> int:
        """Return a seed in 1 … 2³²-1 for a library with its own generator, e.g. "planner#3" for OMPL."""
        return self._words(name)[0] or 1

    def _words(self, name: str) -> list[int]:
        """Return eight numbers of 32 bits from a hash of seed, robot, and name."""
        prefix = f"{self.robot}/" if self.robot else ""
        digest = hashlib.sha256(f"{self.seed}/{prefix}{name}".encode()).digest()
        return [int.from_bytes(digest[i : i + 4], "little") for i in range(0, 32, 4)]
