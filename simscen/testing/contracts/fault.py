"""The promises of a fault."""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Bump, Image, Imu, Odometry, Reading, Scan
from simscen.core.records.events import BELIEF, COMMAND, MAP, WHEELS
from simscen.core.records.events import FAULT_TARGET_KINDS as EVERY
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.testing.contracts.component import heard
from simscen.testing.promise import Contract, demand, promise

KINDS: dict[str, Callable[[int], Reading]] = {
    "Scan": lambda k: Scan("it", 24 * k, np.linspace(0.5, 5.0, 60) + 0.01 * k, -3.0, 0.1, 0.05, 8.0),
    "Odometry": lambda k: Odometry("it", 24 * k, Pose2(0.05 * k, 0.01 * k, 0.02 * k), Twist(0.5, 0.0, 0.2)),
    "Imu": lambda k: Imu("it", 24 * k, (0.0, 0.0, 0.2), (0.1, 0.0, 9.81)),
    "Bump": lambda k: Bump("it", 24 * k, k % 2 == 0),
    "Image": lambda k: Image("it", 24 * k, np.full((4, 6, 3), k % 200, np.uint8), np.full((4, 6), 2.0, np.float32)),
}
COUNT = 40
GRID = OccupancyGrid(np.where(np.eye(20, dtype=bool), OCCUPIED, FREE).astype(np.int8), 0.25)


class Elsewhere:
    """What is seen from elsewhere, or through something: two meters more, and another picture."""

    def distances(self, scan: Scan, error: Pose3 | None = None, without: Collection[str] = ()) -> Array:
        """Straight ahead a wall, for want of a world."""
        return np.full(len(scan.ranges), 2.0 if error is None and not without else 4.0)

    def image(self, error: Pose3) -> Image:
        """Gray."""
        return Image("it", 0, np.full((4, 6, 3), 90, np.uint8), np.full((4, 6), 3.0, np.float32))


@dataclass(frozen=True, eq=False)
class FaultContract(Contract):
    """Tried on forty readings or commands of each kind that it affects."""

    role = "fault"
    spec: Any
    subject: str = ""

    def begun(self, kind: str, now: Callable[[], int] = lambda: 0) -> Disturbance:
        """A new one at work on a kind of instance, with the same generator each time."""
        fault: Fault = self.spec
        setting = FaultSetting(0.3, now=now, kind=kind, sight=Elsewhere() if kind in ("Scan", "Image") else None)
        return heard("begins", fault.begin, np.random.default_rng(5), setting)

    def disturbed(self, kind: str) -> list[Any]:
        """What it makes of readings or commands of a kind, with what it kept back where that arrives."""
        tick = 0
        answers: list[Any] = []
        work = self.begun(kind, lambda: tick)
        for k in range(COUNT):
            tick = 24 * k
            if kind in (COMMAND, WHEELS):
                answers.append(heard("is asked for a late command", work.arriving_command))
                answers.append(heard("is handed a command", work.command, Twist(0.4, 0.0, 0.1 * (k % 5))))
            elif kind == BELIEF:
                answers.append(heard("is handed a belief", work.belief, _belief(k)))
            elif kind == MAP:
                answers.append(heard("is handed a map", work.map, GRID))
            else:
                answers += heard("is asked for what arrives", work.arriving)
                answers.append(heard(f"is handed a {kind}", work.reading, KINDS[kind](k)))
        return answers

    @promise
    def it_says_what_it_affects(self) -> None:
        """Given a fault then `affects` are kinds of readings that there are, or Command, and at least one."""
        affects = self.spec.affects
        demand(affects, "affects nothing")
        strange = sorted(set(affects) - set(EVERY))
        demand(not strange, f"affects {strange}, which there is not")

    @promise
    def it_answers_with_the_same_kind_or_none(self) -> None:
        """Given a reading then one of the same kind and sensor answers, or None; given a command a Twist, and so on.

        A command may be kept back on cmd_vel only; a belief and a map are always answered.
        """
        for kind in sorted(self.spec.affects):
            for answer in self.disturbed(kind):
                if kind in (COMMAND, WHEELS):
                    fine = answer is None or (isinstance(answer, Twist) and bool(np.isfinite(answer).all()))
                elif kind == BELIEF:
                    fine = isinstance(answer, Belief) and bool(np.isfinite(answer.pose).all())
                elif kind == MAP:
                    fine = isinstance(answer, OccupancyGrid)
                else:
                    asked = KINDS[kind](0)
                    fine = answer is None or (type(answer) is type(asked) and answer.sensor == asked.sensor)
                demand(fine, f"makes {answer!r} of a {kind}")

    @promise
    def the_same_generator_gives_the_same_answers_bit_for_bit(self) -> None:
        """Given the same readings and generator then the same answers: no clock, no global chance."""
        for kind in sorted(self.spec.affects):
            one, other = (self.disturbed(kind) for _ in range(2))
            demand(all(map(equal, one, other)), f"disturbs the same {kind} in two ways")

    @promise
    def a_reading_is_never_changed(self) -> None:
        """Given a reading then it stays what it is: the log keeps it, and the answer is another one."""
        for kind in sorted(set(self.spec.affects) & set(KINDS)):
            work = self.begun(kind)
            for k in range(COUNT):
                reading = KINDS[kind](k)
                before = copy.deepcopy(reading)
                heard(f"is handed a {kind}", work.reading, reading)
                demand(equal(reading, before), f"changes the {kind} that it was handed")

    @promise
    def its_end_leaves_a_disturbance_or_nothing(self) -> None:
        """Given the end of a fault then what stays is a Disturbance, or None."""
        for kind in sorted(self.spec.affects):
            left = heard("ends", self.begun(kind).end)
            demand(left is None or isinstance(left, Disturbance), f"leaves {left!r}")


def equal(one: Any, other: Any) -> bool:
    """Whether two readings, or two commands, are the same to the last bit."""
    if one is None or isinstance(one, tuple):
        return bool(one == other)
    return type(one) is type(other) and all(
        np.array_equal(a, b, equal_nan=a.dtype.kind == "f") if isinstance(a, np.ndarray) else a == b
        for a, b in ((getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    )


def _belief(number: int) -> Belief:
    pose, odometry = Pose2(1.0 + 0.05 * number, 2.0, 0.02 * number), Pose2(0.05 * number, 0.0, 0.02 * number)
    return Belief(pose, 0.01 * np.eye(3), pose.compose(odometry.inverse()), updated=24 * number)
