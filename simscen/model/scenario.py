"""Specification of scenarios (`*.scenario.yaml`): world, robots, goals, disturbances, and pass criteria."""

from itertools import count
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Tag, model_validator

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Estimate
from simscen.core.random_streams import MAX_SEED
from simscen.core.records.verdict import ExpectedFailure as DeclaredFailure
from simscen.criteria.registry import AnyCriterion
from simscen.model.navigation import Expectation, Navigation, OnReached
from simscen.model.stack_files import AnyStack
from simscen.model.world import WorldSpec
from simscen.spec.base import LanguageVersion, LazySpec, Spec, by_default, text_or_mapping
from simscen.spec.places import (
    FilePath,
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
    from simscen.criteria.base import AnyMeasure
    from simscen.model.acceptance import Acceptance
    from simscen.model.disturbances import EventEntry, FaultEntry, SequenceStep
    from simscen.model.variations import Variations
    from simscen.triggers.base import Trigger
else:
    AnyMeasure = Annotated[Spec, LazySpec("simscen.criteria.base", "AnyMeasure")]
    EventEntry = Annotated[Spec, LazySpec("simscen.model.disturbances", "EventEntry")]
    FaultEntry = Annotated[Spec, LazySpec("simscen.model.disturbances", "FaultEntry")]
    Acceptance = Annotated[Spec, LazySpec("simscen.model.acceptance", "Acceptance")]
    Variations = Annotated[Spec, LazySpec("simscen.model.variations", "Variations")]


def _with_language_version(world: Any) -> Any:
    """Return the keys of an inline world with the version of the language; other values unchanged."""
    return {"simscen": 1, **world} if isinstance(world, dict) else world


WorldOrFile = Annotated[
    Annotated[FilePath, Tag("a text")]
    | Annotated[WorldSpec, LazySpec("simscen.model.world", "WorldSpec"), Tag("a mapping")],
    Discriminator(text_or_mapping),
    BeforeValidator(_with_language_version),
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
        """Return an estimate at the pose of a place, with the default standard deviations."""
        return InitialEstimate(x=pose.x, y=pose.y, yaw=pose.yaw)


Unknown = Literal["unknown"]

if TYPE_CHECKING:
    EstimateOrUnknown = InitialEstimate | Unknown
else:
    EstimateOrUnknown = Annotated[InitialEstimate, EstimateOrPlace(keywords=get_args(Unknown))]


class Payload(Spec):
    """Load on the robot. It is not part of the robot file, and the stack does not know it."""

    mass: PositiveMass
    """Mass in kg."""
    at: Annotated[list[Length], Field(min_length=3, max_length=3)] | None = None
    """Center of mass [x, y, z] in the base frame; default: on top of the hull, above the origin of the base frame."""


class RobotEntry(Spec):
    """The robot, its true start pose, and the initial pose estimate of its localizer."""

    model: FilePath = "turtlebot"
    """Robot that simscen ships (turtlebot, amr, …), or a `*.robot.yaml` or `.urdf` file."""
    pose: PlaceOrPose
    """True start pose: a pose, or the name of a place of the world."""
    initial_estimate: EstimateOrUnknown | None = None
    """Initial pose estimate of the localizer: a pose, the name of a place of the world, or `unknown` (anywhere on the
    map). Default: the true pose with Nav2's default covariance."""
    payload: Payload | None = None
    """Load that the robot carries."""
    motor_torque: Annotated[float, Field(gt=0, le=1), Quantity("ratio")] = 1.0
    """Fraction of the nominal motor torque that is available, e.g. because of wear, heat, or a weak battery."""


class GoalEntry(Spec):
    """Pose to which the robot navigates."""

    name: Name | None = None
    """Name in reports; default: the name of the place, or goal-1, goal-2, …"""
    pose: PlaceOrPose
    """Pose in the map frame, or name of a place of the world."""
    timeout: PositiveDuration | None = None
    """Simulated time after which this goal fails with NAVIGATE_TIMEOUT; default: only `time_limit` applies."""
    xy_tolerance: PositiveLength | None = None
    """Distance from the goal within which the goal counts as reached; default: tolerance of the goal checker."""
    yaw_tolerance: PositiveAngle | None = None
    """Heading error within which the goal counts as reached; default: tolerance of the goal checker."""
    expect: Expectation = "succeeded"
    """Expected outcome: `succeeded`, `failed`, or the code of a failure, e.g. `{error_code: GOAL_OCCUPIED}`. The goal
    passes only with this outcome."""
    on_reached: OnReached = by_default()
    """Action of the robot at the goal before it continues."""


MAX_GOALS = 1000
"""Maximum number of goals per robot and run, including loops."""


class MultiRobotEntry(RobotEntry):
    """One of several robots, with its own start, goals, faults, and criteria.

    A missing `map` or `on_goal_failure` is taken from the scenario. `stack` and `navigation` are merged with those of
    the scenario.

    Example: `robots: {left: {pose: {x: 1, y: 1}, goals: [{pose: dock}]}, right: {pose: {x: 4, y: 1}}}`
    """

    map: FilePath | None = None
    """Map for this robot; `none`: no map, odometry only."""
    stack: AnyStack | None = None
    """Parameters of this robot's stack that differ from the stack of the scenario."""
    goals: Annotated[list[Annotated[GoalEntry, PlaceShorthand("pose")]], Field(max_length=MAX_GOALS)] = []
    """Goals in this order; a robot without goals does not move."""
    navigation: Navigation | None = None
    """Navigation action for the goals, and number of loops."""
    on_goal_failure: Literal["stop", "continue"] | None = None
    """Behavior of this robot after a failed goal. `stop`: skip the remaining goals. `continue`: drive to the next goal.
    """
    faults: Annotated[list[FaultEntry], Field(max_length=500)] = []
    """Faults of this robot. Triggers refer to this robot unless they name another one."""
    pass_: Annotated[list[AnyCriterion], Field(max_length=200, alias="pass")] = []
    """Criteria for this robot, in addition to those for all robots."""


MAX_ROBOTS = 20
"""Maximum number of robots."""


def _check_reason(reason: str) -> str:
    if not reason.strip():
        raise ValueError("the reason is empty")
    return reason


Reason = Annotated[str, Field(max_length=500), AfterValidator(_check_reason)]


class ExpectedFailure(Spec):
    """Known failure. A run that fails counts as failed-as-expected, and a run that passes counts as failed.

    Example: `expected: {fail: "the planner hugs corners, NAV-123", criteria: [clearance]}`
    """

    fail: Reason
    """Reason, e.g. a ticket and the problem."""
    criteria: Annotated[list[Annotated[Name, ReferenceTo("verdict")]], Field(max_length=200)] = []
    """Ids of the criteria that must fail, and names of the events and faults that must not take place. Nothing else may
    fail. Default: at least one criterion must fail."""

    @model_validator(mode="before")
    @classmethod
    def _require_reason(cls, value: Any) -> Any:
        """Raise ValueError for text, to explain how a reason is written."""
        if isinstance(value, str):
            raise ValueError("give the reason for the known failure as `{fail: REASON}`")
        return value


MIN_TRUTH_RATE_HZ = 20.0
"""Minimum rate at which the ground truth is recorded. At lower rates, criteria could miss violations."""


class Physics(Spec):
    """Parameters of the physics simulation."""

    tick_rate: Annotated[int, Field(ge=60, le=2000), WholeQuantity("frequency")] = 240
    """Physics steps per simulated second."""
    solver_iterations: Annotated[int, Field(ge=1, le=1000)] = 10
    """Iterations of the contact solver per physics step."""
    truth_rate: Annotated[float, Field(ge=MIN_TRUTH_RATE_HZ, le=1000), Quantity("frequency")] = 40.0
    """Rate at which the ground truth is recorded and evaluated. Criteria need at least 20 Hz."""


def _check_unique(measures: list[AnyMeasure]) -> list[AnyMeasure]:
    kinds = [measure.kind for measure in measures]
    repeated = [kind for index, kind in enumerate(kinds) if kind in kinds[:index]]
    if repeated:
        raise ValueError(f"`{repeated[0]}` is given twice")
    return measures


class ScenarioSpec(Spec):
    """Navigation test: a world, a robot, goals, disturbances, and pass criteria."""

    simscen: LanguageVersion
    """Version of the scenario language."""
    name: Name | None = None
    """Name in reports; default: the name of the file."""
    description: Annotated[str, Field(max_length=10_000)] = ""
    """Description for people: the tested behavior, and the reason for the test."""
    tags: Annotated[list[PlaceName], Field(max_length=50)] = []
    """Tags; `--tag` selects scenarios by them."""
    seed: Annotated[int, Field(ge=1, le=MAX_SEED)] = 1
    """Seed of all random numbers of a run."""
    world: WorldOrFile
    """World: a `*.world.yaml` file, a ROS map `.yaml`, a Gazebo `.sdf` or `.world` file, or an inline world."""
    map: FilePath | None = None
    """Map for the robot; `none`: no map, odometry only. Default: the map of the world."""
    robot: RobotEntry | None = None
    """Robot under test; use `robots` for several."""
    robots: Annotated[dict[RobotName, MultiRobotEntry], Field(min_length=2, max_length=MAX_ROBOTS)] | None = None
    """Several robots by name, instead of `robot`, each with its own goals, faults, and criteria."""
    stack: AnyStack = by_default()
    """Navigation stack under test: the one of simscen, or an external process with `{external: NAME}`."""
    goals: Annotated[list[Annotated[GoalEntry, PlaceShorthand("pose")]], Field(max_length=MAX_GOALS)] = []
    """Goals in this order; names of places are also valid: `[kitchen, office]`."""
    navigation: Navigation = by_default()
    """Navigation action for the goals, and number of loops."""
    on_goal_failure: Literal["stop", "continue"] = "stop"
    """Behavior of the robot after a failed goal (stop_on_failure of FollowWaypoints). `stop`: skip the remaining goals.
    `continue`: drive to the next goal."""
    time_limit: Annotated[PositiveDuration, Field(le=8000)] = 300.0
    """Simulated time after which the run ends in any case."""
    linger: Annotated[Duration, Field(le=3600)] = 0.5
    """Simulated time for which the run continues after the last goal, to check that the robot stays there."""
    events: Annotated[list[EventEntry], Field(max_length=500)] = []
    """Changes to the world, and when they happen."""
    faults: Annotated[list[FaultEntry], Field(max_length=500)] = []
    """Faults of sensors, commands, wheels, localizer, and map, and when they begin."""
    physics: Physics = by_default()
    """Parameters of the physics simulation."""
    pass_: Annotated[list[AnyCriterion], Field(max_length=200, alias="pass")] = []
    """Criteria that all robots must meet."""
    metrics: Annotated[list[AnyMeasure], Field(max_length=100), AfterValidator(_check_unique)] = []
    """Additional metrics of installed plug-ins."""
    expected: ExpectedFailure | None = None
    """Known failure of the run, with a reason. An aborted run is still an error."""
    skip: Reason | None = None
    """Reason for not running this scenario. The file must still be valid."""
    variations: Variations | None = None
    """Values by path, such as `robot.motor_torque`. Each combination of values is a separate run."""
    acceptance: Acceptance | None = None
    """Claim about many random runs that `simscen study` tests. Other commands ignore the claim."""

    @property
    def only_robot(self) -> RobotEntry:
        """The robot of a scenario with a single robot. Raises AssertionError for several robots."""
        assert self.robot is not None
        return self.robot

    @property
    def steps(self) -> "list[SequenceStep]":
        """The events in order, each followed by the steps of its sequence."""
        if not self.events:  # the import takes 15 ms
            return []
        from simscen.model.disturbances import steps_of

        return steps_of(self.events)

    @property
    def triggers(self) -> "list[Trigger]":
        """Triggers of all events and faults in order."""
        triggers = [*(step.when for step in self.steps), *(fault.when for fault in self.faults)]
        return [trigger for trigger in triggers if trigger is not None]

    @property
    def goal_names(self) -> list[str]:
        """Names of the goals in order: as given, or the name of the place, or goal-1, goal-2, …

        A repeated place gets a suffix: `kitchen-2`.
        """
        taken, names = {goal.name for goal in self.goals}, list[str]()
        for number, goal in enumerate(self.goals, start=1):
            default = goal.pose.place or f"goal-{number}"
            others = (name for suffix in count(2) if (name := f"{default}-{suffix}") not in taken)
            names.append(goal.name or (default if default not in taken else next(others)))
            taken.add(names[-1])
        return names


def initial_estimate(entry: RobotEntry, truth: Pose2) -> Estimate:
    """Return the initial estimate of the localizer for a robot that starts at the pose `truth`."""
    match entry.initial_estimate:
        case None:
            return Estimate(truth)
        case "unknown":
            return Estimate(None)
        case InitialEstimate() as estimate:
            return Estimate(Pose2(estimate.x, estimate.y, estimate.yaw), estimate.std)
    raise AssertionError(entry.initial_estimate)


def expected_failure(spec: ScenarioSpec) -> DeclaredFailure | None:
    """Return the known failure that a scenario declares as `expected`; None if it declares none."""
    return None if spec.expected is None else DeclaredFailure(spec.expected.fail, tuple(spec.expected.criteria))


class CriteriaRobotEntry(RobotEntry):
    """Robot of a criteria file. Its start pose is optional, because it is not used to judge a log."""

    pose: PlaceOrPose | None = None  # type: ignore[assignment]
    """True start pose."""


class CriteriaMultiRobotEntry(MultiRobotEntry):
    """One of several robots of a criteria file. Its start pose is optional."""

    pose: PlaceOrPose | None = None  # type: ignore[assignment]
    """True start pose."""


_CriteriaRobots = Annotated[dict[RobotName, CriteriaMultiRobotEntry], Field(min_length=2, max_length=MAX_ROBOTS)]


class CriteriaSpec(ScenarioSpec):
    """Criteria file for judging existing logs: a scenario in which `world`, `robot`, and start poses are optional."""

    simscen: LanguageVersion = 1
    """Version of the scenario language."""
    world: WorldOrFile | None = None  # type: ignore[assignment]
    """World with the places and regions of the criteria; needed only for logs that simscen did not record."""
    robot: CriteriaRobotEntry | None = None
    """Robot with the footprint for the criteria; needed only for logs that simscen did not record."""
    robots: _CriteriaRobots | None = None  # type: ignore[assignment]
    """Criteria of several robots, by name."""
