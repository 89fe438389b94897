"""One thing that moves by a script, or because it is pushed, or that may be moved some time."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pybullet

from simscen.core.geometry import Pose3, wrap
from simscen.core.geometry.motion_paths import MAX_STEP_M, PathSampler, SweptSegment
from simscen.core.geometry.scripted_poses import BatchPathSampler, PosesAtTick, PredictedPoses
from simscen.core.geometry.shapes import Body, Mesh, MotionPath
from simscen.sim.body.inertia import GRAVITY

FALLING = 0.1 * GRAVITY
"""m/s that what rests may gain within a tenth of a second."""

Vector = tuple[float, float, float]
Placing = tuple[Vector, tuple[float, float, float, float]]


@dataclass
class Actor:
    """A body, and the `path` that it has followed since tick `since`, if any.

    `ways` are all on which its origin ever is, `speed` is the fastest that any part of it ever moves on them, in m/s,
    `size` how far from its origin it extends, and `radius` how far from its axis, in meters. Where the engine has it as
    a surface without an inside, `surface` is that, in the body's frame.
    """

    body: Body
    path: MotionPath | None
    since: int
    ways: Sequence[SweptSegment]
    speed: float
    size: float
    radius: float
    surface: Mesh | None
    led: bool = False
    """Whether it may be given another path at any time."""
    number: int | None = None
    """The engine's, once that has it."""
    shown: Pose3 | None = None
    """Where the engine has it, once that has it."""
    center_from_base: Pose3 = Pose3()
    placed: tuple[Placing, Pose3] | None = None
    """What the engine last said of its center of mass, and the pose that comes of it."""
    resting: bool = False
    """Whether it has not moved at all since the engine was asked before."""
    track: PathSampler | None = None
    """Its path as it is asked for."""
    scripted: dict[int, Pose3] = field(default_factory=dict)
    """Where its path has it at the ticks that were asked for last."""

    @property
    def id(self) -> int:
        """The engine's number of it. Raises LookupError where that has not got it: better no run than a wrong one."""
        if self.number is None:
            raise LookupError(f'"{self.body.name}" is not in the engine')
        return self.number

    @property
    def pushable(self) -> bool:
        """Whether the engine moves it, rather than a script or nothing."""
        return self.body.mass > 0 and self.path is None

    def parked(self, since: float, seconds: float) -> bool:
        """Whether its path, set off `since` seconds ago, leaves it where it is for so many more."""
        if self.path is None or self.led:
            return False
        return self.path.over(since) or since + seconds < self.path.start

    def follow(self, path: MotionPath, speed: float, tick: int) -> None:
        """Follow another path from `tick` on."""
        self.path, self.since, self.speed, self.track = path, tick, speed, None
        self.scripted.clear()

    def at(self, tick: int, rate: int) -> Pose3:
        """Where its path has it."""
        there = self.scripted.get(tick)
        if there is None:
            if len(self.scripted) > 1:
                self.scripted.clear()
            if self.track is None:
                assert self.path is not None
                self.track = PathSampler(self.path, self.body.pose.z)
            self.scripted[tick] = there = self.track.at((tick - self.since) / rate)
        return there

    def velocity(self, tick: int, rate: int) -> tuple[Vector, float]:
        """The velocity in m/s and rad/s that leads along its path to the next tick."""
        here, there = self.at(tick, rate), self.at(tick + 1, rate)
        vx, vy = (there.x - here.x) * rate, (there.y - here.y) * rate
        if math.hypot(vx, vy) > MAX_STEP_M * rate:  # a path that jumps sets its body down elsewhere
            return (0.0, 0.0, 0.0), 0.0
        return (vx, vy, 0.0), wrap(there.yaw - here.yaw) * rate

    def width(self, pose: Pose3) -> float:
        """How far from its origin it extends along the ground, at most, in meters: where it leans its top does, too."""
        height = math.sqrt(self.size**2 - self.radius**2)
        return min(self.size, self.radius + 2 * height * math.hypot(pose.qx, pose.qy))

    def away(self, place: Vector, pose: Pose3) -> float:
        """How far from a place it is in meters, being at `pose`, or is as the engine has it."""
        away = math.dist(pose[:3], place)
        return away if self.shown is None else min(away, math.dist(self.shown[:3], place))

    def show(self, client: int, pose: Pose3) -> None:
        """Put it somewhere, if the engine has it."""
        if self.number is not None and pose != self.shown:
            self.shown = pose
            pybullet.resetBasePositionAndOrientation(self.id, pose[:3], pose[3:], client)

    def ask(self, client: int) -> Pose3 | None:
        """See where the engine has moved it, which can be pushed; None where it has not."""
        said: Placing = pybullet.getBasePositionAndOrientation(self.id, client)
        self.resting = self.placed is not None and self.placed[0] == said
        if self.resting:
            return None
        pose = Pose3(*said[0], *said[1]).compose(self.center_from_base)
        self.placed = said, pose
        return pose

    def fastest(self, client: int) -> float:
        """How fast any part of it may be within a tenth of a second, in m/s, which can be pushed."""
        if self.resting:
            return FALLING
        linear, angular = pybullet.getBaseVelocity(self.id, physicsClientId=client)
        return math.hypot(*linear) + math.hypot(*angular) * self.size + FALLING


LOOKAHEAD_S = 4
"""Seconds that are worked out at once."""


class ScheduledPoses:
    """Of things that follow paths; make another one when one of them is given another path."""

    def __init__(self, travelling: Sequence[Actor], tick_rate: int) -> None:
        self._travelling, self._rate = travelling, tick_rate
        self._foreseen: PredictedPoses | None = None
        self._tracks: BatchPathSampler | None = None

    def at(self, tick: int) -> PosesAtTick | None:
        """Where everything is at a tick; None where that was not worked out."""
        return None if self._foreseen is None else self._foreseen.at(tick)

    def forget(self) -> None:
        """Something else has moved than scripts say."""
        self._foreseen = None

    def look(self, tick: int, period: int, everything: Mapping[str, Pose3]) -> None:
        """Work it out from `tick` on for every `period` ticks, unless it is; of `everything` there is, others stay."""
        if (self._foreseen is not None and tick in self._foreseen.ticks) or any(a.led for a in self._travelling):
            return
        if self._tracks is None:
            paths = [(actor.path, actor.body.pose.z) for actor in self._travelling]
            self._tracks = BatchPathSampler([(path, z) for path, z in paths if path is not None])
        ticks = range(tick, tick + max(1, LOOKAHEAD_S * self._rate // period) * period, period)
        since = np.array([actor.since for actor in self._travelling])
        table = self._tracks.at((np.array(ticks)[:, np.newaxis] - since) / self._rate)
        names = tuple(actor.body.name for actor in self._travelling)
        self._foreseen = PredictedPoses(ticks, names, table, {**everything})
