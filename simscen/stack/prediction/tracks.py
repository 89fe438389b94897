"""The tracks: what is known of each, and where it should be by now."""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Array
from simscen.stack.prediction.kalman import predicted

LATELY = 10
"""Updates that are looked at: who turns round has not come far from where he was first seen."""
FIRST_SPEED = 1.5
"""m/s: standard deviation of the velocity of what has just been seen."""


class Update(NamedTuple):
    """When and where a track was hit; whether it stood where it had been free, or where something had been hit before.

    `edges` is how many of its two ends were seen.
    """

    tick: int
    x: float
    y: float
    came: bool
    stood: bool
    edges: int


@dataclass
class Track:
    """What is known of a track besides its state; `lately` are its last updates."""

    radius: float
    born: Array
    lately: deque[Update] = field(default_factory=lambda: deque(maxlen=LATELY))
    moving: bool = False
    moved: bool = False
    fast_at: int = 0

    @property
    def hit_at(self) -> int:
        """When it was last hit."""
        return self.lately[-1].tick


class Tracks:
    """All tracks of one lidar, with their `states` (n, 4) and `covariances` (n, 4, 4) of x, y, vx, vy."""

    def __init__(self) -> None:
        self.known: list[Track] = []
        self.states, self.covariances = np.zeros((0, 4)), np.zeros((0, 4, 4))
        self.tick = 0

    def __len__(self) -> int:
        return len(self.known)

    def forecast(self, tick: int, seconds: float, acceleration: float) -> None:
        """Where they are `seconds` later, at a tick."""
        self.tick = tick
        if self.known and seconds > 0:
            self.states, self.covariances = predicted(self.states, self.covariances, seconds, acceleration)

    def begin(self, tracks: list[Track], places: Array, deviations: Array) -> None:
        """More of them, at places (n, 2) that are known to so many metres (n,), and of unknown speed."""
        covariances = np.zeros((len(tracks), 4, 4))
        covariances[:, 0, 0] = covariances[:, 1, 1] = deviations**2
        covariances[:, 2, 2] = covariances[:, 3, 3] = FIRST_SPEED**2
        states = np.concatenate((places, np.zeros_like(places)), axis=1)
        self.known += tracks
        self.states = np.concatenate((self.states, states))
        self.covariances = np.concatenate((self.covariances, covariances))

    def note(self, number: int, came: bool, stood: bool, edges: int) -> None:
        """Note that a track was hit."""
        x, y = self.states[number, :2].tolist()
        self.known[number].lately.append(Update(self.tick, x, y, came, stood, edges))

    def keep(self, numbers: list[int]) -> None:
        """Forget all others."""
        if len(numbers) < len(self.known):
            self.known = [self.known[number] for number in numbers]
            self.states, self.covariances = self.states[numbers], self.covariances[numbers]

    def place_deviation(self, number: int) -> float:
        """Standard deviation in m of a place, along the axis in which it is greatest."""
        return math.sqrt(max(self.covariances[number, 0, 0], self.covariances[number, 1, 1]))

    def speed_deviation(self, number: int) -> float:
        """The same in m/s of a velocity."""
        return math.sqrt(max(self.covariances[number, 2, 2], self.covariances[number, 3, 3]))
