"""Catalog of all signals (quantities over time) that temporal criteria can compare."""

from __future__ import annotations

import math
from collections.abc import Callable, Set
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from simscen.core.geometry import Array
from simscen.core.records.verdict import Evidence
from simscen.criteria.trace_signals import distances, event_readers, readers
from simscen.criteria.trace_signals.estimation_errors import BELIEF_TIMEOUT_S
from simscen.criteria.trace_signals.sampling import SignalArguments, SignalQuery
from simscen.spec.quantities import UNITS

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace

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
"""Dimension of a signal with the values 0 and 1."""
NUMBER = "number"
"""Dimension of a signal without a unit."""


@dataclass(frozen=True)
class Signal:
    """Definition of a signal: a quantity with a value at each sample of the truth.

    Attributes:
        text: Description for the reference page.
        dimension: A key of spec.quantities.UNITS, NUMBER, or YES_OR_NO.
        read: Function that returns the values (n,) of a run in SI units.
        evidence: Kinds of information that a log must contain for this signal, besides the truth.
        minimum: Smallest possible value.
        maximum: Largest possible value.
        alternative_arguments: Keys of arguments of which exactly one must be given; empty if none is needed.
        optional_arguments: Keys of arguments that may be given.
    """

    text: str
    dimension: str
    read: Callable[[SignalQuery], Array]
    evidence: Set[Evidence] = frozenset()
    minimum: float = 0.0
    maximum: float = math.inf
    alternative_arguments: tuple[str, ...] = ()
    optional_arguments: tuple[str, ...] = ()

    @property
    def unit(self) -> str:
        """The SI unit; "" for a plain number and for a yes-or-no signal."""
        return next(iter(UNITS[self.dimension])) if self.dimension in UNITS else ""

    @property
    def is_boolean(self) -> bool:
        """Whether this is a yes-or-no signal."""
        return self.dimension == YES_OR_NO


SIGNALS: dict[SignalName, Signal] = {
    "clearance": Signal(
        "True distance from the robot's hull to the nearest solid surface; negative by the depth of an overlap.",
        "length",
        readers.clearance,
        {Evidence.CLEARANCE},
        minimum=-1.0,
    ),
    "speed": Signal("True speed over ground, in any direction.", "speed", readers.ground_speed, {Evidence.VELOCITY}),
    "forward_speed": Signal(
        "True speed along the robot's x axis; negative backwards.",
        "speed",
        readers.forward_speed,
        {Evidence.VELOCITY},
        minimum=-math.inf,
    ),
    "turn_rate": Signal("Magnitude of the true turn rate.", "angular speed", readers.turn_rate, {Evidence.VELOCITY}),
    "yaw_rate": Signal(
        "True turn rate; positive to the left.",
        "angular speed",
        readers.yaw_rate,
        {Evidence.VELOCITY},
        minimum=-math.inf,
    ),
    "acceleration": Signal(
        "Change of the true speed over ground since the previous sample, divided by the time; negative while braking.",
        "acceleration",
        readers.acceleration,
        {Evidence.VELOCITY},
        minimum=-math.inf,
    ),
    "angular_acceleration": Signal(
        "Change of the true yaw rate since the previous sample, divided by the time.",
        "angular acceleration",
        readers.angular_acceleration,
        {Evidence.VELOCITY},
        minimum=-math.inf,
    ),
    "jerk": Signal(
        "Magnitude of the second difference of the true speed over ground, divided by the time squared.",
        "jerk",
        readers.jerk,
        {Evidence.VELOCITY},
    ),
    "travelled": Signal("True distance driven so far, in moves of at least 1 cm.", "length", readers.travelled),
    "time": Signal("Simulated time since the start.", "duration", readers.time),
    "goal_distance": Signal(
        "True straight-line distance to the goal accepted last; before the first acceptance, to this first goal.",
        "length",
        readers.goal_distance,
        {Evidence.ALIGNMENT, Evidence.NAVIGATION},
    ),
    "goal_heading_error": Signal(
        "Angle between the true heading and the heading of the goal to which goal_distance is measured.",
        "angle",
        readers.goal_heading_error,
        {Evidence.ALIGNMENT, Evidence.NAVIGATION},
        maximum=math.pi,
    ),
    "distance_remaining": Signal(
        "Length of the newest plan from the estimated position on; before the first plan, the goal_distance.",
        "length",
        distances.distance_remaining,
        {Evidence.ALIGNMENT, Evidence.PLANS, Evidence.BELIEF, Evidence.NAVIGATION},
    ),
    "plan_deviation": Signal(
        "True distance to the nearest point of the newest plan; 0 before the first plan.",
        "length",
        distances.plan_deviation,
        {Evidence.ALIGNMENT, Evidence.PLANS},
    ),
    "distance_to": Signal(
        "True distance from the robot's center to a point, a goal, or the origin of an object; infinite while"
        " the object is absent.",
        "length",
        distances.distance_to,
        {Evidence.ALIGNMENT},
        alternative_arguments=("object", "point", "goal"),
    ),
    "person_distance": Signal(
        "True gap between the robot's footprint and the body of the nearest pedestrian; infinite while there is none.",
        "length",
        distances.person_distance,
        {Evidence.ALIGNMENT, Evidence.OBJECTS, Evidence.FOOTPRINT},
    ),
    "localization_error": Signal(
        "Distance of the newest estimated position from the true position at the time of the estimate, or from the "
        "current true position if the belief is over 1 s old. The trajectories are not aligned.",
        "length",
        readers.localization_error,
        {Evidence.ALIGNMENT, Evidence.BELIEF},
    ),
    "localization_yaw_error": Signal(
        "Angle between estimated and true heading, at the times of localization_error.",
        "angle",
        readers.localization_yaw_error,
        {Evidence.ALIGNMENT, Evidence.BELIEF},
        maximum=math.pi,
    ),
    "position_std": Signal(
        "Standard deviation of the estimated position in the direction with the largest variance.",
        "length",
        readers.position_std,
        {Evidence.BELIEF, Evidence.COVARIANCE},
    ),
    "yaw_std": Signal(
        "Standard deviation of the estimated heading.", "angle", readers.yaw_std, {Evidence.BELIEF, Evidence.COVARIANCE}
    ),
    "nees": Signal(
        "Normalized estimation error squared of the belief: 3 on average if its covariance is correct; infinite"
        " if its covariance is singular.",
        NUMBER,
        readers.nees,
        {Evidence.ALIGNMENT, Evidence.BELIEF, Evidence.COVARIANCE},
    ),
    "belief_age": Signal(
        "Time since the newest belief; before the first one, since the start of the run.",
        "duration",
        readers.belief_age,
        {Evidence.BELIEF},
    ),
    "scan_age": Signal(
        "Time since the stack last received a scan; before the first one, since the start of the run.",
        "duration",
        readers.scan_age,
        {Evidence.SCANS},
    ),
    "command_speed": Signal(
        "Magnitude of the speed that the stack commands; 0 before the first command.",
        "speed",
        readers.command_speed,
        {Evidence.COMMANDS},
    ),
    "command_turn_rate": Signal(
        "Magnitude of the turn rate that the stack commands; 0 before the first command.",
        "angular speed",
        readers.command_turn_rate,
        {Evidence.COMMANDS},
    ),
    "collision_count": Signal(
        "Number of contacts that have begun so far.", NUMBER, event_readers.collision_count, {Evidence.CONTACTS}
    ),
    "replan_count": Signal(
        "Number of plans made so far for another reason than a new goal.",
        NUMBER,
        event_readers.replan_count,
        {Evidence.PLANNING},
    ),
    "recovery_count": Signal(
        "Number of recoveries that have started so far.", NUMBER, event_readers.recovery_count, {Evidence.RECOVERIES}
    ),
    "localized": Signal(
        f"The newest belief is at most {BELIEF_TIMEOUT_S:g} s old and its position_std at most "
        f"{readers.LOCALIZED_STD_M:g} m.",
        YES_OR_NO,
        readers.localized,
        {Evidence.BELIEF, Evidence.COVARIANCE},
        maximum=1.0,
    ),
    "in_region": Signal(
        "The true position of the robot's center is in the region.",
        YES_OR_NO,
        readers.in_region,
        {Evidence.ALIGNMENT},
        maximum=1.0,
        alternative_arguments=("region",),
    ),
    "in_collision": Signal(
        "The robot touches something; with `with`, the robot touches this object.",
        YES_OR_NO,
        event_readers.in_collision,
        {Evidence.CONTACTS},
        maximum=1.0,
        optional_arguments=("with",),
    ),
    "goal_active": Signal(
        "The robot drives to a goal; with `goal`, to this goal.",
        YES_OR_NO,
        event_readers.goal_active,
        {Evidence.NAVIGATION},
        maximum=1.0,
        optional_arguments=("goal",),
    ),
    "recovery_active": Signal(
        "A recovery behavior is running; with `recovery`, this behavior.",
        YES_OR_NO,
        event_readers.recovery_active,
        {Evidence.RECOVERIES},
        maximum=1.0,
        optional_arguments=("recovery",),
    ),
    "fault_active": Signal(
        "The fault is active.",
        YES_OR_NO,
        event_readers.is_active,
        {Evidence.DISTURBANCES},
        maximum=1.0,
        alternative_arguments=("fault",),
    ),
    "event_active": Signal(
        "The event has begun and not ended; an event without a duration lasts to the end of the run.",
        YES_OR_NO,
        event_readers.is_active,
        {Evidence.DISTURBANCES},
        maximum=1.0,
        alternative_arguments=("event",),
    ),
    "started": Signal(
        "The fault or event has just begun: true at the first sample at or after each start.",
        YES_OR_NO,
        event_readers.has_just_started,
        {Evidence.DISTURBANCES},
        maximum=1.0,
        alternative_arguments=("fault", "event"),
    ),
}
"""Signals by name, in the order of the reference page."""


def signal_evidence(name: SignalName) -> frozenset[Evidence]:
    """Return the kinds of information that a log must contain for a signal, including the truth."""
    return frozenset({*SIGNALS[name].evidence, Evidence.TRUTH})


def read_signal(name: SignalName, trace: Trace, case: Case, arguments: SignalArguments) -> Array:
    """Return the values (n,) of a signal at each sample of the truth, in SI units; 0 or 1 for a yes-or-no signal.

    Raises MissingEvidence if the trace lacks the data of the signal, and InvalidTrace if they are not finite.
    """
    return SIGNALS[name].read(SignalQuery(trace, case, arguments))
