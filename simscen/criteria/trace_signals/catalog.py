"""The named signals of a run: what temporal criteria speak of, and `simscen explain signals` lists."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from simscen.core.evidence import Evidence
from simscen.core.geometry import Array
from simscen.criteria.trace_signals import distances
from simscen.criteria.trace_signals import distances as places
from simscen.criteria.trace_signals import readers as values
from simscen.criteria.trace_signals.ground_truth import BELIEF_TIMEOUT_S
from simscen.spec.quantities import UNITS

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace

SignalName = Literal[
    "clearance", "speed", "forward_speed", "turn_rate", "yaw_rate", "acceleration", "angular_acceleration", "jerk",
    "travelled", "time", "goal_distance", "goal_heading_error", "distance_remaining", "plan_deviation", "distance_to",
    "person_distance",
    "localization_error", "localization_yaw_error", "position_std", "yaw_std", "nees", "belief_age", "scan_age",
    "command_speed", "command_turn_rate", "collision_count", "replan_count", "recovery_count",
    "localized", "in_region", "in_collision", "goal_active", "recovery_active", "fault_active", "event_active",
    "started",
]  # fmt: skip

YES_OR_NO = "yes or no"
NUMBER = "number"


@dataclass(frozen=True)
class Signal:
    """A quantity at every truth sample of a run.

    `dimension` is one of spec.quantities.UNITS, "number", or "yes or no". Its values lie between `least` and `most`,
    both possible. `about` are keys of which exactly one must name what it is about, `perhaps` such as may.
    """

    text: str
    dimension: str
    read: Callable[[values.SignalQuery], Array]
    least: float = 0.0
    most: float = math.inf
    about: tuple[str, ...] = ()
    perhaps: tuple[str, ...] = ()

    @property
    def unit(self) -> str:
        """The SI unit; "" for a plain number and for yes or no."""
        return next(iter(UNITS[self.dimension])) if self.dimension in UNITS else ""

    @property
    def asks(self) -> bool:
        """Whether its answer is yes or no."""
        return self.dimension == YES_OR_NO


def _yes_or_no(
    text: str, read_signal: Callable[[values.SignalQuery], Array], about: tuple[str, ...] = (), *perhaps: str
) -> Signal:
    return Signal(text, YES_OR_NO, read_signal, 0.0, 1.0, about, perhaps)


SIGNALS: dict[SignalName, Signal] = {
    "clearance": Signal(
        "True distance from the robot's hull to the nearest solid surface; negative by how far they overlap.",
        "length", values.clearance, -1.0,
    ),
    "speed": Signal("True speed over ground, in any direction.", "speed", values.ground_speed),
    "forward_speed": Signal(
        "True speed along the robot's own x axis; negative backwards.", "speed", values.forward_speed, -math.inf
    ),
    "turn_rate": Signal("True turn rate, either way.", "angular speed", values.turn_rate),
    "yaw_rate": Signal("True turn rate; positive to the left.", "angular speed", values.yaw_rate, -math.inf),
    "acceleration": Signal(
        "Change of the true speed over ground since the sample before, by time; negative while braking.",
        "acceleration", values.acceleration, -math.inf,
    ),
    "angular_acceleration": Signal(
        "Change of the true yaw rate since the sample before, by time.",
        "angular acceleration", values.angular_acceleration, -math.inf,
    ),
    "jerk": Signal(
        "Second difference of the true speed over ground, by time squared; without its sign.", "jerk", values.jerk
    ),
    "travelled": Signal("The true way driven so far, in moves of at least 1 cm.", "length", values.travelled),
    "time": Signal("Simulated time since the start.", "duration", values.time),
    "goal_distance": Signal(
        "True distance to the goal the robot was given last, as the crow flies; to the first before it is accepted.",
        "length", values.goal_distance,
    ),
    "goal_heading_error": Signal(
        "Angle between the true heading and that goal's.", "angle", values.goal_heading_error, 0.0, math.pi
    ),
    "distance_remaining": Signal(
        "Length of the newest plan from where the robot believes to be; before the first plan, the goal_distance.",
        "length", places.distance_remaining,
    ),
    "plan_deviation": Signal(
        "True distance to the nearest point of the newest plan; 0 before the first plan.",
        "length", places.plan_deviation,
    ),
    "distance_to": Signal(
        "True distance from the robot's centre to a point, a goal, or the origin of an object; infinite while the "
        "object is not there.",
        "length", places.distance_to, about=("object", "point", "goal"),
    ),
    "person_distance": Signal(
        "True gap between the robot's footprint and the body of the nearest pedestrian; infinite while nobody is "
        "there.",
        "length", distances.person_distance,
    ),
    "localization_error": Signal(
        "Distance between believed and true position when the newest belief came; against the truth of now once that "
        "is over 1 s old. Not aligned.",
        "length", values.localization_error,
    ),
    "localization_yaw_error": Signal(
        "Angle between believed and true heading, likewise.", "angle", values.localization_yaw_error, 0.0, math.pi
    ),
    "position_std": Signal(
        "What the robot believes its position error to be: the standard deviation along the worst direction.",
        "length", values.position_std,
    ),
    "yaw_std": Signal("What the robot believes its heading error to be.", "angle", values.yaw_std),
    "nees": Signal(
        "Squared pose error measured by the believed covariance, 3 on average when that is right; infinite when it is "
        "singular.",
        NUMBER, values.nees,
    ),
    "belief_age": Signal("Time since the newest belief.", "duration", values.belief_age),
    "scan_age": Signal("Time since the stack last received a scan.", "duration", values.scan_age),
    "command_speed": Signal("Speed that the stack commands, in any direction.", "speed", values.command_speed),
    "command_turn_rate": Signal("Turn rate that the stack commands, either way.", "angular speed",
                                values.command_turn_rate),
    "collision_count": Signal("Contacts begun so far.", NUMBER, values.collision_count),
    "replan_count": Signal("Plans made so far for another reason than a new goal.", NUMBER, values.replan_count),
    "recovery_count": Signal("Recoveries begun so far.", NUMBER, values.recovery_count),
    "localized": _yes_or_no(
        f"The newest belief is at most {BELIEF_TIMEOUT_S:g} s old and its position_std at most {values.LOCALIZED_STD_M:g} m.",
        values.localized,
    ),
    "in_region": _yes_or_no("The robot's centre is truly in a region of the world.", values.in_region, ("region",)),
    "in_collision": _yes_or_no("The robot touches something, or this thing.", values.in_collision, (), "with"),
    "goal_active": _yes_or_no("The robot drives to a goal, or to this one.", values.goal_active, (), "goal"),
    "recovery_active": _yes_or_no("A recovery is under way, or this one.", values.recovery_active, (), "recovery"),
    "fault_active": _yes_or_no("The fault is at work.", values.is_active, ("fault",)),
    "event_active": _yes_or_no(
        "The event has begun and not ended; one without an end goes on to the end of the run.",
        values.is_active, ("event",),
    ),
    "started": _yes_or_no(
        "The fault or event has begun just now: at the one sample after each start.",
        values.has_just_started, ("fault", "event"),
    ),
}  # fmt: skip
"""Every signal by name, in the order of the reference."""


_TRUTH, _VELOCITY, _BELIEF, _GOALS = Evidence.TRUTH, Evidence.VELOCITY, Evidence.BELIEF, Evidence.NAVIGATION

_EVIDENCE: dict[SignalName, frozenset[Evidence]] = {
    "clearance": frozenset({Evidence.CLEARANCE}),
    **dict.fromkeys(("speed", "forward_speed", "turn_rate", "yaw_rate"), frozenset({_VELOCITY})),
    **dict.fromkeys(("acceleration", "angular_acceleration", "jerk"), frozenset({_VELOCITY})),
    **dict.fromkeys(("travelled", "time"), frozenset()),
    "scan_age": frozenset({Evidence.SCANS}),
    **dict.fromkeys(("command_speed", "command_turn_rate"), frozenset({Evidence.COMMANDS})),
    **dict.fromkeys(("goal_distance", "goal_heading_error"), frozenset({Evidence.ALIGNMENT, _GOALS})),
    "distance_remaining": frozenset({Evidence.ALIGNMENT, Evidence.PLANS, _BELIEF, _GOALS}),
    "plan_deviation": frozenset({Evidence.ALIGNMENT, Evidence.PLANS}),
    **dict.fromkeys(("distance_to", "in_region"), frozenset({Evidence.ALIGNMENT})),
    **dict.fromkeys(("localization_error", "localization_yaw_error"), frozenset({Evidence.ALIGNMENT, _BELIEF})),
    "person_distance": frozenset({Evidence.ALIGNMENT, Evidence.OBJECTS, Evidence.FOOTPRINT}),
    "nees": frozenset({Evidence.ALIGNMENT, _BELIEF, Evidence.COVARIANCE}),
    **dict.fromkeys(("position_std", "yaw_std", "localized"), frozenset({_BELIEF, Evidence.COVARIANCE})),
    "belief_age": frozenset({_BELIEF}),
    **dict.fromkeys(("collision_count", "in_collision"), frozenset({Evidence.CONTACTS})),
    "replan_count": frozenset({Evidence.PLANNING}),
    **dict.fromkeys(("recovery_count", "recovery_active"), frozenset({Evidence.RECOVERIES})),
    "goal_active": frozenset({_GOALS}),
    **dict.fromkeys(("fault_active", "event_active", "started"), frozenset({Evidence.DISTURBANCES})),
}


def signal_evidence(name: SignalName) -> frozenset[Evidence]:
    """What a log must hold for the signal to be known; the truth is its clock."""
    return _EVIDENCE[name] | {_TRUTH}


def read_signal(name: SignalName, trace: Trace, case: Case, of: values.SignalArguments) -> Array:
    """The signal at each truth sample. Raises Unavailable, or InvalidTrace when it is not a number somewhere."""
    return SIGNALS[name].read(values.SignalQuery(trace, case, of))
