"""Independent random streams, one for each named consumer of random numbers, such as a sensor."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

import numpy as np

MAX_SEED = 2**32 - 1
"""Largest seed: the largest unsigned integer of 32 bits."""


@dataclass(frozen=True)
class Streams:
    """Source of the random generators of a run. All generators are derived from `seed`.

    `robot` is the name of the robot that uses the generators; "" for a single robot. Raises ValueError unless `seed` is
    in 1 … MAX_SEED.
    """

    seed: int
    robot: str = ""

    def __post_init__(self) -> None:
        if not 1 <= self.seed <= MAX_SEED:
            raise ValueError(f"seed must be in 1 … {MAX_SEED}, got {self.seed}")

    def generator(self, name: str) -> np.random.Generator:
        """Return a new generator for the consumer `name`, e.g. "sensor.lidar" or "fault.slip".

        Generators with the same name produce the same numbers.
        """
        return np.random.Generator(np.random.PCG64(np.random.SeedSequence(self._hash_words(name))))

    def library_seed(self, name: str) -> int:
        """Return a seed in 1 … 2³²-1 for a library with its own generator, e.g. "planner#3" for OMPL."""
        return self._hash_words(name)[0] or 1

    def _hash_words(self, name: str) -> list[int]:
        """Return a hash of seed, robot, and name as eight unsigned integers of 32 bits."""
        prefix = f"{self.robot}/" if self.robot else ""
        digest = hashlib.sha256(f"{self.seed}/{prefix}{name}".encode()).digest()
        return [int.from_bytes(digest[i : i + 4], "little") for i in range(0, 32, 4)]
