"""The promises of a fault."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.motion import Twist
from simscen.core.sensing import Bump, Image, Imu, Odometry, Reading, Scan
from simscen.faults.base import Disturbance, Fault, Wheels
from simscen.testing.contracts.component import heard
from simscen.testing.promise import Contract, demand, promise

KINDS: dict[str, Callable[[int], Reading]] = {
    "Scan": lambda k: Scan("it", 24 * k, np.linspace(0.5, 5.0, 60) + 0.01 * k, -3.0, 0.1, 0.05, 8.0),
    "Odometry": lambda k: Odometry("it", 24 * k, Pose2(0.05 * k, 0.01 * k, 0.02 * k), Twist(0.5, 0.0, 0.2)),
    "Imu": lambda k: Imu("it", 24 * k, (0.0, 0.0, 0.2), (0.1, 0.0, 9.81)),
    "Bump": lambda k: Bump("it", 24 * k, k % 2 == 0),
    "Image": lambda k: Image("it", 24 * k, np.full((4, 6, 3), k % 200, np.uint8), np.full((4, 6), 2.0, np.float32)),
}
COMMAND = "Command"
COUNT = 40


@dataclass(frozen=True, eq=False)
class FaultContract(Contract):
    """Tried on forty readings or commands of each kind that it affects."""

    role = "fault"
    spec: Any
    subject: str = ""

    def begun(self) -> Disturbance:
        """A new one at work, with the same generator each time."""
        fault: Fault = self.spec
        return heard("begins", fault.begin, np.random.default_rng(5), Wheels(0.3))

    def disturbed(self, kind: str) -> list[Any]:
        """What it makes of readings or commands of a kind."""
        work = self.begun()
        if kind == COMMAND:
            return [heard("is handed a command", work.command, Twist(0.4, 0.0, 0.1 * (k % 5))) for k in range(COUNT)]
        return [heard(f"is handed a {kind}", work.reading, KINDS[kind](k)) for k in range(COUNT)]

    @promise
    def it_says_what_it_affects(self) -> None:
        """Given a fault then `affects` are kinds of readings that there are, or Command, and at least one."""
        affects = self.spec.affects
        demand(affects, "affects nothing")
        demand(
            set(affects) <= {*KINDS, COMMAND}, f"affects {sorted(set(affects) - {*KINDS, COMMAND})}, which there is not"
        )

    @promise
    def it_answers_with_a_reading_of_the_same_kind_or_none(self) -> None:
        """Given a reading then one of the same kind, sensor and tick answers, or None; given a command a Twist."""
        for kind in sorted(self.spec.affects):
            for k, answer in enumerate(self.disturbed(kind)):
                if kind == COMMAND:
                    fine = isinstance(answer, Twist) and bool(np.isfinite(answer).all())
                else:
                    asked = KINDS[kind](k)
                    fine = answer is None or (type(answer) is type(asked) and _origin(answer) == _origin(asked))
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
        for kind in sorted(set(self.spec.affects) - {COMMAND}):
            work = self.begun()
            for k in range(COUNT):
                reading = KINDS[kind](k)
                before = copy.deepcopy(reading)
                heard(f"is handed a {kind}", work.reading, reading)
                demand(equal(reading, before), f"changes the {kind} that it was handed")

    @promise
    def its_end_leaves_a_disturbance_or_nothing(self) -> None:
        """Given the end of a fault then what stays is a Disturbance, or None."""
        left = heard("ends", self.begun().end)
        demand(left is None or isinstance(left, Disturbance), f"leaves {left!r}")


def equal(one: Any, other: Any) -> bool:
    """Whether two readings, or two commands, are the same to the last bit."""
    if one is None or isinstance(one, tuple):
        return bool(one == other)
    return type(one) is type(other) and all(
        np.array_equal(a, b, equal_nan=a.dtype.kind == "f") if isinstance(a, np.ndarray) else a == b
        for a, b in ((getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    )


def _origin(reading: Reading) -> tuple[str, int]:
    return reading.sensor, reading.tick
