"""A scenario as a user writes it (`*.scenario.yaml`)."""

from itertools import count
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Estimate
from simscen.core.random_streams import LARGEST_SEED
from simscen.criteria.registry import AnyCriterion
from simscen.model.navigation import Expectation, Navigation, OnReached
from simscen.model.stack_files import AnyStack
from simscen.model.world import WorldSpec
from simscen.spec.base import LanguageVersion, Spec, by_default
from simscen.spec.lazy_spec import LazySpec
from simscen.spec.places import (
    Name,
    PlaceAllowed,
    PlaceName,
    PlaceOrPose,
    PlaceShorthand,
    PoseSpec,
    ReferenceTo,
    RobotName,
)
from simscen.spec.quantities import (
    Duration,
    Length,
    NonNegativeAngle,
    NonNegativeLength,
    PositiveAngle,
    PositiveDuration,
    PositiveLength,
    PositiveMass,
    Quantity,
    WholeQuantity,
)

if TYPE_CHECKING:
    from simscen.criteria.plugin_metric import AnyMeasure
    from simscen.model.disturbances import EventEntry, FaultEntry, Step
    from simscen.model.variations import Variations
    from simscen.triggers.registry import Trigger
else:
    AnyMeasure = Annotated[Spec, LazySpec("simscen.criteria.plugin_metric", "AnyMeasure")]
    EventEntry = Annotated[Spec, LazySpec("simscen.model.disturbances", "EventEntry")]
    FaultEntry = Annotated[Spec, LazySpec("simscen.model.disturbances", "FaultEntry")]
    Variations = Annotated[Spec, LazySpec("simscen.model.variations", "Variations")]


def _text_or_mapping(value: Any) -> str:
    return "text" if isinstance(value, str) else "mapping"


FilePath = Annotated[str, Field(min_length=1, max_length=4096)]
WorldOrFile = Annotated[
    Annotated[FilePath, Tag("text")]
    | Annotated[WorldSpec, LazySpec("simscen.model.world", "WorldSpec"), Tag("mapping")],
    Discriminator(_text_or_mapping),
]


class InitialEstimate(PoseSpec):
    """Initial pose estimate of the localizer with standard deviations."""

    std: Annotated[tuple[NonNegativeLength, NonNegativeLength, NonNegativeAngle], Field(strict=False)] = (
        0.5,
        0.5,
        0.2618,
    )
    """Standard deviations of x, y (m), and yaw (rad); the default is Nav2's covariance."""


class EstimateOrPlace(PlaceAllowed):
    """Annotation of an initial estimate that can also be given as the name of a place."""

    def value_at(self, pose: PoseSpec) -> InitialEstimate:
        """Return an estimate at the pose of the place with the default standard deviations."""
        return InitialEstimate(x=pose.x, y=pose.y, yaw=pose.yaw)


Unknown = Literal["unknown"]

if TYPE_CHECKING:
    EstimateOrUnknown = InitialEstimate | Unknown
else:
    EstimateOrUnknown = Annotated[InitialEstimate, EstimateOrPlace(keywords=get_args(Unknown))]


class Payload(Spec):
    """Something on the robot that neither its stack nor its datasheet knows of: mass and where that is."""

    mass: PositiveMass
    """In kg."""
    at: Annotated[list[Length], Field(min_length=3, max_length=3)] | None = None
    """[x, y, z] of its center of mass in the base frame; default: on top of the hull, above the base's origin."""


class RobotEntry(Spec):
    """The robot, where it truly starts, and where it thinks it starts."""

    model: FilePath = "turtlebot"
    """A shipped robot (turtlebot, amr, …) or a `*.robot.yaml` or `.urdf` file."""
    pose: PlaceOrPose
    """Where it truly stands: a pose or a place of the world."""
    initial_estimate: EstimateOrUnknown | None = None
    """A pose, or a place of the world; default: the true pose, with Nav2's default covariance; `unknown`: anywhere on
    the map."""
    payload: Payload | None = None
    """What it carries: motors are those of the empty robot."""
    motor_torque: Annotated[float, Field(gt=0, le=1), Quantity("ratio")] = 1.0
    """Share of their torque that its motors still have: worn, hot, or run from a weak battery."""


class GoalEntry(Spec):
    """A pose to drive to."""

    name: Name | None = None
    """What reports call it; default: the place's name, or goal-1, goal-2, …"""
    pose: PlaceOrPose
    """In the map frame: a pose or a place of the world."""
    timeout: PositiveDuration | None = None
    """Simulated time this goal may take; then it fails with NAVIGATE_TIMEOUT."""
    xy_tolerance: PositiveLength | None = None
    """Default: the stack's goal checker."""
    yaw_tolerance: PositiveAngle | None = None
    """Default: the stack's goal checker."""
    expect: Expectation = "succeeded"
    """What is to come of it: `succeeded`, `failed`, or the code of a failure, e.g. `{error_code: GOAL_OCCUPIED}`. A
    failure that is expected is a pass, and a success that is not expected is none."""
    on_reached: OnReached = by_default()
    """What the robot does there before it goes on."""


MAX_GOALS = 1000
"""Goals that a robot is sent to in one run, loops counted."""


class OneOfSeveral(RobotEntry):
    """One of several robots: where it starts, and what is its own.

    What is not said here holds as the scenario says it for all: `map`, `stack` (merged with what is said here) and
    `on_goal_failure`.

    Example: `robots: {left: {pose: {x: 1, y: 1}, goals: [{pose: dock}]}, right: {pose: {x: 4, y: 1}}}`
    """

    map: FilePath | None = None
    """The map this robot gets; `none` = no map, odometry only."""
    stack: AnyStack | None = None
    """What its stack has otherwise than that of all."""
    goals: Annotated[list[Annotated[GoalEntry, PlaceShorthand("pose")]], Field(max_length=MAX_GOALS)] = []
    """In this order; a robot without goals stands where it is."""
    navigation: Navigation | None = None
    """Which action takes its goals, and how often."""
    on_goal_failure: Literal["stop", "continue"] | None = None
    """After a goal that failed: end, or drive to the next one."""
    faults: Annotated[list[FaultEntry], Field(max_length=500)] = []
    """Of its sensors and wheels; their triggers are about this robot, where they do not say another."""
    pass_: Annotated[list[AnyCriterion], Field(max_length=200, alias="pass")] = []
    """What must hold for this robot, besides what must for all."""


MAX_ROBOTS = 20


def _in_words(reason: str) -> str:
    if not reason.strip():
        raise ValueError("a reason has words")
    return reason


Reason = Annotated[str, Field(max_length=500), AfterValidator(_in_words)]


class ExpectedFailure(Spec):
    """A failure that is known: the run is no failure as long as it fails, and one as soon as it does not.

    Example: `expected: {fail: "the planner hugs corners, NAV-123", criteria: [clearance]}`
    """

    fail: Reason
    """Why, for people: a ticket, and what is wrong."""
    criteria: Annotated[list[Annotated[Name, ReferenceTo("verdict")]], Field(max_length=200)] = []
    """Ids of the criteria, or names of the events and faults that do not happen, that must fail, and alone may;
    default: one or more criteria, whichever."""

    @model_validator(mode="before")
    @classmethod
    def _with_reason(cls, value: Any) -> Any:
        if isinstance(value, str):
            raise ValueError("say why it is known to fail: `{fail: REASON}`")
        return value


MIN_TRUTH_RATE_HZ = 20.0
"""At lower rates, short violations fall between two samples, and `smoothness` (SPARC) has no value."""


class Physics(Spec):
    """How the world is stepped."""

    tick_rate: Annotated[int, Field(ge=60, le=2000), WholeQuantity("frequency")] = 240
    """Physics steps for each simulated second."""
    solver_iterations: Annotated[int, Field(ge=1, le=1000)] = 10
    """Iterations of the contact solver for each physics step."""
    truth_rate: Annotated[float, Field(ge=MIN_TRUTH_RATE_HZ, le=1000), Quantity("frequency")] = 40.0
    """How often the truth is recorded and judged. Criteria need at least 20 Hz."""


def _once(measures: list[AnyMeasure]) -> list[AnyMeasure]:
    kinds = [measure.kind for measure in measures]
    twice = [kind for index, kind in enumerate(kinds) if kind in kinds[:index]]
    if twice:
        raise ValueError(f"`{twice[0]}` is there twice: a run reports one number of a name")
    return measures


class ScenarioSpec(Spec):
    """One navigation test: a world, a robot, goals, disturbances, and what must hold."""

    simscen: LanguageVersion
    """Version of this language."""
    name: Name | None = None
    """For people; default: the file's name."""
    description: Annotated[str, Field(max_length=10_000)] = ""
    """What is tested and why."""
    tags: Annotated[list[PlaceName], Field(max_length=50)] = []
    """For `--tag`."""
    seed: Annotated[int, Field(ge=1, le=LARGEST_SEED)] = 1
    """The root of all chance in a run."""
    world: WorldOrFile
    """A `*.world.yaml`, a ROS map `.yaml`, a Gazebo `.sdf`/`.world`, or the world itself."""
    map: FilePath | None = None
    """The map the robot gets, if it is not that of the world; `none` = no map, odometry only."""
    robot: RobotEntry | None = None
    """The robot under test; where there are several, `robots`."""
    robots: Annotated[dict[RobotName, OneOfSeveral], Field(min_length=2, max_length=MAX_ROBOTS)] | None = None
    """Several robots by name, instead of `robot`: each with its own goals, faults and criteria."""
    stack: AnyStack = by_default()
    """The stack under test: simscen's own, or `{external: NAME}`, a process."""
    goals: Annotated[list[Annotated[GoalEntry, PlaceShorthand("pose")]], Field(max_length=MAX_GOALS)] = []
    """In this order; places of the world alone will do: `[kitchen, office]`."""
    navigation: Navigation = by_default()
    """Which action takes the goals, and how often."""
    on_goal_failure: Literal["stop", "continue"] = "stop"
    """After a goal that failed: end, or drive to the next one (FollowWaypoints' stop_on_failure)."""
    time_limit: Annotated[PositiveDuration, Field(le=8000)] = 300.0
    """Simulated time after which the run ends, whatever happens."""
    linger: Annotated[Duration, Field(le=3600)] = 0.5
    """Simulated time that the run goes on after the last goal, to see that the robot stays where it is."""
    events: Annotated[list[EventEntry], Field(max_length=500)] = []
    """What happens in the world, and when."""
    faults: Annotated[list[FaultEntry], Field(max_length=500)] = []
    """What goes wrong with sensors, wheels and commands, and when."""
    physics: Physics = by_default()
    """How the world is stepped."""
    pass_: Annotated[list[AnyCriterion], Field(max_length=200, alias="pass")] = []
    """All of these must hold; of several robots, for each of them."""
    metrics: Annotated[list[AnyMeasure], Field(max_length=100), AfterValidator(_once)] = []
    """What is measured besides what every run reports; each is a type that an installed package adds."""
    expected: ExpectedFailure | None = None
    """Say that it is known to fail, and why. A run that breaks off is an error all the same."""
    skip: Reason | None = None
    """Do not run it, and say why. The file must be valid all the same."""
    variations: Variations | None = None
    """Values by their paths, each combination a run of its own; default: the file as it is."""

    @property
    def own(self) -> RobotEntry:
        """The only robot."""
        assert self.robot is not None
        return self.robot

    @property
    def steps(self) -> "list[Step]":
        """The events, each with the steps of its story after it: everything that is to happen to the world."""
        from simscen.model.disturbances import steps_of

        return steps_of(self.events)

    @property
    def triggers(self) -> "list[Trigger]":
        """What events and faults wait for, in their order."""
        waiting = [*(step.when for step in self.steps), *(fault.when for fault in self.faults)]
        return [trigger for trigger in waiting if trigger is not None]

    @property
    def goal_names(self) -> list[str]:
        """What the goals are called, in order: as written, or after their place, or goal-1, goal-2, …

        A place that is driven to again is `kitchen-2` then.
        """
        taken, names = {goal.name for goal in self.goals}, list[str]()
        for number, goal in enumerate(self.goals, start=1):
            default = goal.pose.place or f"goal-{number}"
            others = (name for again in count(2) if (name := f"{default}-{again}") not in taken)
            names.append(goal.name or (default if default not in taken else next(others)))
            taken.add(names[-1])
        return names


def estimate_of(entry: RobotEntry, truth: Pose2) -> Estimate:
    """What the localizer is told, given where the robot truly is."""
    match entry.initial_estimate:
        case None:
            return Estimate(truth)
        case "unknown":
            return Estimate(None)
        case InitialEstimate() as told:
            return Estimate(Pose2(told.x, told.y, told.yaw), told.std)
    raise AssertionError(entry.initial_estimate)
