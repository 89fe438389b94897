"""For each promise a component that breaks it, and the contract says so: one that cannot fail promises nothing."""

import math
import random
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import count
from typing import Any, ClassVar

import numpy as np
import pytest

from simscen.actions.base import Action
from simscen.core.belief import Belief
from simscen.core.events import Event, EventKind
from simscen.core.geometry import Pose2
from simscen.core.motion import Twist
from simscen.core.navigation import Path
from simscen.core.sensing import Odometry
from simscen.core.stage import Effect
from simscen.core.trace import Decision
from simscen.core.verdict import Finding, Status
from simscen.criteria.base import Criterion
from simscen.criteria.measure import Measure
from simscen.faults.base import Disturbance, Fault
from simscen.model.checkers import SimpleGoalChecker
from simscen.model.controllers import RegulatedPurePursuit
from simscen.model.localizers import GroundTruth, OdometryOnly
from simscen.model.planners import OmplPlanner
from simscen.model.recovery import BackUp, Spin
from simscen.model.robot import Bumper, Lidar
from simscen.model.stack import StackSpec
from simscen.spec.base import Spec
from simscen.stack.protocols import NavigationFailure
from simscen.testing import PromiseBroken, promises_of
from simscen.testing.flatland import round_robot
from simscen.triggers.base import Condition

ROUND = {"round": round_robot()}
COUNT = count()


@dataclass(frozen=True)
class Case:
    name: str
    spec: Any
    promise: str
    seen: str


CASES: list[Case] = []


class Wrapper:
    """A component that does as the one it wraps, but for what a subclass does otherwise."""

    def __init__(self, inner: Any, setting: Any) -> None:
        self.inner, self.setting = inner, setting

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)


def breaks(spec: Any, promise: str, seen: str) -> Callable[[type[Wrapper]], type[Wrapper]]:
    """Adds a case: the component of `spec` in this wrapper breaks a promise, and `seen` is said of it."""

    def add(wrapper: type[Wrapper]) -> type[Wrapper]:
        def made(inner: Any, setting: Any) -> Any:
            return wrapper(type(spec).implementation()(inner, setting), setting)

        kind = type(wrapper.__name__, (type(spec),), {"implementation": classmethod(lambda cls: made)})
        CASES.append(Case(wrapper.__name__, kind.model_construct(**dict(spec)), promise, seen))
        return wrapper

    return add


def word(promise: str, seen: str) -> Callable[[type[Spec]], type[Spec]]:
    """Adds a case: a criterion, fault, trigger or action that breaks a promise."""

    def add(kind: type[Spec]) -> type[Spec]:
        CASES.append(Case(kind.__name__, kind(), promise, seen))
        return kind

    return add


# planners

PLANNER = OmplPlanner()


@breaks(PLANNER, "success begins at the start", "begins 0.5")
class BeginsElsewhere(Wrapper):
    def plan(self, costmap, start, goal, seed):
        return self.inner.plan(costmap, Pose2(start.x + 0.5, start.y, 0), goal, seed)


@breaks(PLANNER, "success begins at the start", "from the goal, tolerance")
class StopsShort(Wrapper):
    def plan(self, *asked):
        return Path(self.inner.plan(*asked).points[:-30])


@breaks(PLANNER, "points are at most", "m apart")
class LeavesOutPoints(Wrapper):
    def plan(self, *asked):
        return Path(self.inner.plan(*asked).points[::4])


@breaks(PLANNER, "the footprint is never", "does not fit at")
class GoesThroughWalls(Wrapper):
    def plan(self, costmap, start, goal, seed):
        self.inner.plan(costmap, start, goal, seed)
        share = np.linspace(0, 1, 200)[:, None]
        return Path(np.array(start) * (1 - share) + np.array(goal) * share)


@breaks(PLANNER, "what cannot be fails", "raises ValueError when it plans, not a NavigationFailure")
class RaisesWhatItLikes(Wrapper):
    def plan(self, *asked):
        try:
            return self.inner.plan(*asked)
        except NavigationFailure as failure:
            raise ValueError("no way") from failure


@breaks(PLANNER, "what cannot be fails", "which is no ErrorCode")
class HasItsOwnCodes(Wrapper):
    def plan(self, *asked):
        try:
            return self.inner.plan(*asked)
        except NavigationFailure as failure:
            raise NavigationFailure(4711, "no way") from failure  # type: ignore[arg-type]


@breaks(PLANNER, "what cannot be fails", "without points")
class AnswersWithNothing(Wrapper):
    def plan(self, *asked):
        try:
            return self.inner.plan(*asked)
        except NavigationFailure:
            return Path()


@breaks(PLANNER, "what cannot be fails", "does not come to an end")
class NeverGivesUp(Wrapper):
    def plan(self, *asked):
        while True:
            try:
                return self.inner.plan(*asked)
            except NavigationFailure:
                continue


@breaks(PLANNER, "the same seed", "two paths from the same seed differ")
class DrawsFromTheGlobalGenerator(Wrapper):
    def plan(self, costmap, start, goal, seed):
        return self.inner.plan(costmap, start, goal, random.randint(1, 10**6))


@breaks(PLANNER, "the same seed", "two paths from the same seed differ")
class AsksTheClock(Wrapper):
    def plan(self, costmap, start, goal, seed):
        return self.inner.plan(costmap, start, goal, time.perf_counter_ns() % 10**6 + 1)


@breaks(PLANNER, "the same seed", "two paths from the same seed differ")
class RemembersHowOften(Wrapper):
    plans = 0

    def plan(self, costmap, start, goal, seed):
        self.plans += 1
        return self.inner.plan(costmap, start, goal, seed + 101 * self.plans)


@breaks(PLANNER, "a costmap is neither", "not what it was before")
class DrawsIntoTheCostmap(Wrapper):
    def plan(self, costmap, *asked):
        costmap.costs[0, 0] = 7
        return self.inner.plan(costmap, *asked)


@breaks(PLANNER, "a costmap is neither", "an old costmap shows in a new plan")
class KeepsItsFirstCostmap(Wrapper):
    kept = None

    def plan(self, costmap, start, goal, seed):
        self.kept = self.kept or costmap
        lethal = (self.kept.costs == 254).all()
        return self.inner.plan(costmap, start, goal, seed + int(lethal))


@breaks(PLANNER, "success begins", "no finite float64")
class PlansNothings(Wrapper):
    def plan(self, *asked):
        points = self.inner.plan(*asked).points.copy()
        points[3, 0] = math.nan
        return Path(points)


@breaks(PLANNER, "success begins", "points are not (n, 3)")
class ForgetsHeadings(Wrapper):
    def plan(self, *asked):
        return Path(self.inner.plan(*asked).points[:, :2])


# controllers

CONTROLLER = RegulatedPurePursuit()


class Commanding(Wrapper):
    def command(self, *asked):
        return self.changed(self.inner.command(*asked))

    def changed(self, command: Twist) -> Any:
        return command


@breaks(CONTROLLER, "it follows the path", "from the end of the path")
class StandsStill(Commanding):
    def changed(self, command):
        return Twist()


@breaks(CONTROLLER, "it follows the path", "m beside the path")
class Swerves(Commanding):
    k = 0

    def changed(self, command):
        self.k += 1
        return Twist(0.3, 0.0, 0.4) if self.k < 60 else command


@breaks(CONTROLLER, "no command exceeds", "more than the base can do")
class TurnsTooFast(Commanding):
    def changed(self, command):
        return command._replace(wz=9.0)


@breaks(CONTROLLER, "no command exceeds", "more than the base can do")
class SlidesSideways(Commanding):
    def changed(self, command):
        return command._replace(vy=0.1)


@breaks(CONTROLLER, "no command exceeds", "nan")
class CommandsNothings(Commanding):
    def changed(self, command):
        return command._replace(vx=math.nan)


@breaks(CONTROLLER, "a speed limit", "under a limit of 0.15")
class MindsNoLimit(Wrapper):
    def set_speed_limit(self, limit):
        pass


@breaks(CONTROLLER, "a speed limit", "without a limit")
class NeverLiftsALimit(Wrapper):
    def set_speed_limit(self, limit):
        self.inner.set_speed_limit(limit or 0.15)


@breaks(CONTROLLER, "what it is about to drive", "with an obstacle")
class IsBlind(Wrapper):
    def command(self, pose, twist, costmap, goal):
        return Twist(0.5, 0.0, 0.0)


@breaks(CONTROLLER, "it never drives into a wall", "drives into the wall")
class DrivesOn(Wrapper):
    def command(self, *asked):
        try:
            return self.inner.command(*asked)
        except NavigationFailure:
            return Twist(0.2, 0.0, 0.0)


@breaks(CONTROLLER, "the same calls", "two drives with the same generator differ")
class Trembles(Commanding):
    def changed(self, command):
        return command._replace(wz=command.wz * (1.0 + 1e-9 * random.random()))


@breaks(CONTROLLER, "an empty path", "takes a path without points")
class TakesEverything(Wrapper):
    def set_path(self, path):
        if len(path.points):
            self.inner.set_path(path)


@breaks(CONTROLLER, "path and costmap", "the path is not what it was")
class StraightensThePath(Wrapper):
    def set_path(self, path):
        self.inner.set_path(path)
        path.points[:, 1] += 0.01


@breaks(CONTROLLER, "path and costmap", "an old costmap shows in a new command")
class KeepsACostmap(Wrapper):
    kept = None

    def command(self, pose, twist, costmap, goal):
        self.kept = self.kept or costmap
        slower = 0.5 if (self.kept.costs == 254).all() else 1.0
        command = self.inner.command(pose, twist, costmap, goal)
        return command._replace(vx=slower * command.vx, wz=slower * command.wz)


@breaks(CONTROLLER, "its local plan", "no path of finite poses")
class ExpectsPoints(Wrapper):
    local_plan = ((0.0, 0.0), (1.0, 0.0))


# localizers

LOCALIZER = OdometryOnly(type="odometry")


class Believing(Wrapper):
    @property
    def belief(self) -> Belief:
        return self.changed(self.inner.belief)

    def changed(self, belief: Belief) -> Belief:
        return belief


@breaks(LOCALIZER, "the same calls", "two runs differ in pose")
class BelievesInChance(Believing):
    def changed(self, belief):
        return replace(belief, pose=belief.pose._replace(x=belief.pose.x + 1e-9 * random.random()))


@breaks(LOCALIZER, "without motion", "wanders off")
class Drifts(Believing):
    off = 0.0

    def changed(self, belief):
        self.off += 1e-3
        return replace(belief, pose=belief.pose._replace(x=belief.pose.x + self.off))


@breaks(LOCALIZER, "a belief does not change", "covariance changes")
class UsesOneArray(Believing):
    def __init__(self, *made):
        super().__init__(*made)
        self.array = np.zeros((3, 3))

    def changed(self, belief):
        self.array[:] = belief.covariance
        return replace(belief, covariance=self.array)

    def on_scan(self, scan):
        self.array += 1.0


@breaks(LOCALIZER, "a scan is neither", "ranges of a scan are not what they were")
class CleansTheScan(Wrapper):
    def on_scan(self, scan):
        scan.ranges[:] = 1.0


@breaks(LOCALIZER, "a scan is neither", "shows in the belief")
class KeepsTheScan(Believing):
    scan = None

    def on_scan(self, scan):
        self.scan = scan

    def changed(self, belief):
        blind = self.scan is not None and np.isnan(self.scan.ranges).all()
        return replace(belief, pose=belief.pose._replace(x=belief.pose.x + (1.0 if blind else 0.0)))


@breaks(LOCALIZER, "a lidar that is blind", "believes to be at")
class BelievesTheLidar(Believing):
    last = 0.0

    def on_scan(self, scan):
        self.last = float(scan.ranges[0]) if len(scan.ranges) else 0.0

    def changed(self, belief):
        return replace(belief, pose=belief.pose._replace(x=self.last))


@breaks(LOCALIZER, "odometry and gyroscope that lie", "with a covariance that is not")
class BelievesTheGyroscope(Believing):
    rate = 0.0

    def on_imu(self, imu):
        self.rate = imu.angular_velocity[2]

    def changed(self, belief):
        return replace(belief, covariance=belief.covariance + self.rate)


@breaks(LOCALIZER, "odometry and gyroscope that lie", "not positive semidefinite")
class IsTooSure(Believing):
    def changed(self, belief):
        return replace(belief, covariance=-belief.covariance)


@breaks(LOCALIZER, "scans of any size", "raises IndexError when it takes a scan")
class WantsAllBeams(Wrapper):
    def on_scan(self, scan):
        scan.ranges[359]


@breaks(LOCALIZER, "scans of any size", "weights that add up to")
class WeighsNothing(Believing):
    def changed(self, belief):
        return replace(belief, particles=np.zeros((3, 4)))


@breaks(LOCALIZER, "a reset forgets", "after a reset")
class NeverForgets(Wrapper):
    told = 0

    def reset(self, estimate):
        self.told += 1
        if self.told == 1:
            self.inner.reset(estimate)


# behaviours

SPIN, BACKUP = Spin(), BackUp()


class Stepping(Wrapper):
    def step(self, pose, costmap, seconds):
        return self.changed(self.inner.step(pose, costmap, seconds), seconds)

    def changed(self, command: Any, seconds: float) -> Any:
        return command


@breaks(SPIN, "it ends", "has not ended after 120 s")
class WaitsForEver(Wrapper):
    def step(self, pose, costmap, seconds):
        return Twist()


@breaks(SPIN, "it ends", "more than the base can do")
class SpinsTooFast(Stepping):
    def changed(self, command, seconds):
        return command and command._replace(wz=5.0)


@breaks(SPIN, "it has a name", "is called ''")
class IsNameless(Wrapper):
    name = ""


@breaks(BACKUP, "it never drives into anything", "drives into a wall")
class BacksBlindly(Wrapper):
    def step(self, pose, costmap, seconds):
        return Twist(-0.15) if seconds < 3.0 else None


@breaks(BACKUP, "it never drives into anything", "raises RuntimeError")
class FailsInItsOwnWay(Wrapper):
    def step(self, *asked):
        try:
            return self.inner.step(*asked)
        except NavigationFailure as failure:
            raise RuntimeError("no room") from failure


@breaks(BACKUP, "the same calls", "two tries with the same generator differ")
class BacksByChance(Stepping):
    def changed(self, command, seconds):
        return command and command._replace(vx=command.vx * (0.9 + 0.1 * random.random()))


@breaks(BACKUP, "a costmap is not changed", "not what it was")
class ClearsTheCostmapItself(Wrapper):
    def step(self, pose, costmap, seconds):
        costmap.costs[:] = 0
        return self.inner.step(pose, costmap, seconds)


# goal checkers

CHECKER = SimpleGoalChecker()


class Checking(Wrapper):
    def reached(self, goal, pose, twist):
        return self.inner.reached(goal, pose, twist)


@breaks(CHECKER, "a robot that stands", "does not say")
class IsNeverContent(Checking):
    def reached(self, *asked):
        return False


@breaks(CHECKER, "outside the tolerances", "says that a robot at")
class IsGenerous(Checking):
    def reached(self, goal, pose, twist):
        return goal.pose.distance(pose) < 1.0


@breaks(CHECKER, "outside the tolerances", "says that a robot at")
class MindsNoHeading(Checking):
    def reached(self, goal, pose, twist):
        return goal.pose.distance(pose) <= goal.xy_tolerance


@breaks(CHECKER, "a heading is compared", "after a whole turn")
class CountsTurns(Checking):
    def reached(self, goal, pose, twist):
        return goal.pose.distance(pose) <= 0.25 and abs(goal.pose.yaw - pose.yaw) <= 0.25


@breaks(CHECKER, "a reset forgets", "because the one before was")
class StaysContent(Checking):
    content = False

    def reset(self):
        pass

    def reached(self, *asked):
        self.content = self.content or self.inner.reached(*asked)
        return self.content


@breaks(CHECKER, "a pose that is no number", "is there")
class ComparesTheWrongWay(Checking):
    def reached(self, goal, pose, twist):
        return not (goal.pose.distance(pose) > 0.25 or abs(goal.pose.yaw - pose.yaw) > 0.25)


@breaks(CHECKER, "the same calls", "answer differently")
class TossesACoin(Checking):
    def reached(self, *asked):
        return self.inner.reached(*asked) and random.random() < 0.9


@breaks(CHECKER, "a robot that stands", "answers 'yes'")
class AnswersInWords(Checking):
    def reached(self, *asked):
        return "yes" if self.inner.reached(*asked) else "no"


# whole stacks

STACK = StackSpec(localizer=GroundTruth(type="ground_truth"))


class Deciding(Wrapper):
    tick = 0

    def decide(self, tick, readings):
        self.tick = tick
        return self.changed(self.inner.decide(tick, readings))

    def changed(self, decision: Decision) -> Any:
        return decision


@breaks(STACK, "it reaches a goal", "touches something")
class RamsThings(Deciding):
    def changed(self, decision):
        near = self.tick < 1440
        return replace(decision, command=Twist(0.5, 0.0, 0.0) if near else decision.command)


@breaks(STACK, "it reaches a goal", "navigation ends with")
class FallsAsleep(Deciding):
    def changed(self, decision):
        return replace(decision, command=Twist())


@breaks(STACK, "without a goal", "commands a velocity without a goal")
class CannotStandStill(Deciding):
    def changed(self, decision):
        return replace(decision, command=decision.command if any(decision.command) else Twist(0.0, 0.0, 0.01))


@breaks(STACK, "once a task has ended", "after the end of its task")
class GoesOn(Deciding):
    ended = False

    def changed(self, decision):
        self.ended = self.ended or any(event.kind == EventKind.NAVIGATION_ENDED for event in decision.events)
        return replace(decision, command=Twist(0.05)) if self.ended else decision


@breaks(STACK, "a canceled task", "does not tell that its goal is canceled")
class TellsNobody(Deciding):
    def changed(self, decision):
        kept = tuple(event for event in decision.events if event.kind != EventKind.GOAL_CANCELED)
        return replace(decision, events=kept)


@breaks(STACK, "a canceled task", "commands a velocity after it was canceled")
class MindsNoCancel(Deciding):
    def cancel(self, tick):
        pass


@breaks(STACK, "a goal that preempts", "drives to")
class MindsNoOtherGoal(Deciding):
    def preempt(self, tick, goal):
        pass


@breaks(STACK, "every goal is accepted once", "accepts")
class AcceptsTwice(Deciding):
    def changed(self, decision):
        again = tuple(event for event in decision.events if event.kind == EventKind.GOAL_ACCEPTED)
        return replace(decision, events=decision.events + again)


@breaks(STACK, "the same seed", "differ in their commands")
class DrivesByChance(Deciding):
    def changed(self, decision):
        vx, vy, wz = decision.command
        return replace(decision, command=Twist(vx, vy, wz * (1 + 1e-12 * random.random()) + 1e-15 * random.random()))


@breaks(STACK, "without a goal", "of goal.reached at tick -5")
class TellsOfThePast(Deciding):
    def changed(self, decision):
        return replace(decision, events=(Event(-5, EventKind.GOAL_REACHED, "x"),))


@breaks(STACK, "a blind lidar", "raises ValueError when it decides")
class CannotBeBlind(Deciding):
    def decide(self, tick, readings):
        for reading in readings:
            if hasattr(reading, "ranges") and np.isnan(reading.ranges).any():
                raise ValueError("nan in the scan")
        return self.inner.decide(tick, readings)


@breaks(STACK, "it reaches a goal", "the ranges of a scan are not what they were")
class CleansScans(Deciding):
    def decide(self, tick, readings):
        for reading in readings:
            if hasattr(reading, "ranges"):
                reading.ranges[np.isinf(reading.ranges)] = 100.0
                reading.ranges[0] = 3.0
        return self.inner.decide(tick, readings)


# criteria

FINE = Finding(Status.PASS, "it", "0", "≤ 1", margin=1.0)


@word("every bound yields", "finds nothing in")
class ChecksNothing(Spec, Criterion):
    def judge(self, trace, case):
        return []


@word("every bound yields", "raises IndexError when it judges a robot that stands")
class NeedsABelief(Spec, Criterion):
    def judge(self, trace, case):
        trace.belief.values[0]
        return [FINE]


@word("a margin has the sign", "pass with a margin of -1")
class PassesBelow(Spec, Criterion):
    def judge(self, trace, case):
        return [replace(FINE, margin=-1.0)]


@word("the same trace gives", "judged otherwise")
class Counts(Spec, Criterion):
    def judge(self, trace, case):
        return [replace(FINE, measured=str(next(COUNT)))]


@word("a trace is not changed", "not what it was")
class SmoothesTheTrace(Spec, Criterion):
    def judge(self, trace, case):
        trace.truth.values[:] = 0.0
        return [FINE]


@word("its horizon", "has a horizon of nan")
class HasNoHorizon(Spec, Criterion):
    @property
    def horizon(self):
        return math.nan

    def judge(self, trace, case):
        return [FINE]


# faults


class Disturbing(Disturbance):
    def __init__(self, change: Callable[[Any], Any]) -> None:
        self.reading = change  # type: ignore[method-assign]


class OnScans(Spec, Fault):
    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})

    def begin(self, chance, wheels):
        return Disturbing(self.changed)

    def changed(self, reading):
        return reading


@word("it says what it affects", "which there is not")
class AffectsGhosts(OnScans):
    affects: ClassVar[frozenset[str]] = frozenset({"Sonar"})


@word("it says what it affects", "affects nothing")
class AffectsNothing(OnScans):
    affects: ClassVar[frozenset[str]] = frozenset()


@word("it answers with the same kind", "of a Scan")
class AnswersForAnother(OnScans):
    def changed(self, reading):
        return replace(reading, sensor="other")


@word("the same generator", "in two ways")
class IsUnsteady(OnScans):
    def changed(self, reading):
        return replace(reading, ranges=reading.ranges + random.random())


@word("a reading is never changed", "changes the Scan")
class WritesIntoTheReading(OnScans):
    def changed(self, reading):
        reading.ranges[:] = 0.0
        return reading


@word("its end leaves", "leaves 'dust'")
class LeavesDust(OnScans):
    def begin(self, chance, wheels):
        work = Disturbance()
        work.end = lambda: "dust"  # type: ignore[method-assign,assignment,return-value]
        return work


# triggers


@word("it says yes or no", "raises AttributeError")
class NeedsAGoal(Spec, Condition):
    def holds(self, now):
        return now.goal.pose.x > 0


@word("it says yes or no", "answers 0")
class AnswersANumber(Spec, Condition):
    def holds(self, now):
        return now.tick and 240


@word("the same situation", "depend on what was asked before")
class HoldsEverySecondTime(Spec, Condition):
    def holds(self, now):
        return next(COUNT) % 3 == 0


@word("it only looks", "does something")
class Meddles(Spec, Condition):
    def holds(self, now):
        now.push((1.0, 0.0))
        return True


# actions


@word("it says what came of it", "does not say what came of it")
class SaysNothing(Spec, Action):
    def perform(self, stage):
        stage.push((1.0, 0.0))
        return Effect(True, "")


@word("it says what came of it", "and did nothing")
class Boasts(Spec, Action):
    def perform(self, stage):
        return Effect(True, "moved the earth")


@word("the same stage", "something else the second time")
class ActsByChance(Spec, Action):
    def perform(self, stage):
        stage.push((random.random(), 0.0))
        return Effect(True, "pushed")


# sensors

SENSOR = Bumper()


@breaks(SENSOR, "it says what it says", "signs a reading of tick")
class SignsForAnother(Wrapper):
    def read(self, tick):
        return replace(self.inner.read(tick), sensor="other")


@breaks(SENSOR, "it says what it says", "says Odometry, not Bump")
class SaysSomethingElse(Wrapper):
    def read(self, tick):
        return Odometry(self.name, tick, Pose2(0, 0, 0), Twist())


@breaks(Lidar(), "what it says are numbers", "says angle_min of nan")
class KnowsNoAngles(Wrapper):
    def read(self, tick):
        return replace(self.inner.read(tick), angle_min=math.nan)


@breaks(Lidar(), "the same world", "in two ways")
class MeasuresByChance(Wrapper):
    def read(self, tick):
        scan = self.inner.read(tick)
        return replace(scan, ranges=scan.ranges + random.random())


@breaks(Lidar(), "a reading does not change", "changes when the next one is taken")
class UsesItsArrayAgain(Wrapper):
    kept = None

    def read(self, tick):
        scan = self.inner.read(tick)
        self.kept = scan.ranges.copy() if self.kept is None else self.kept
        self.kept[:] = scan.ranges
        return replace(scan, ranges=self.kept)


# metrics


@word("it is a number", "measures nan")
class MeasuresNothing(Spec, Measure):
    def measure(self, trace, case):
        return math.nan


@word("the same trace gives", "measured otherwise")
class CountsCalls(Spec, Measure):
    def measure(self, trace, case):
        return float(next(COUNT))


@word("a trace is not changed", "not what it was")
class Resets(Spec, Measure):
    def measure(self, trace, case):
        trace.truth.values[:] = 0.0
        return 0.0


@word("it says in what unit", "has the unit 3")
class HasNoUnit(Spec, Measure):
    unit: ClassVar[Any] = 3

    def measure(self, trace, case):
        return 0.0


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_component_that_breaks_a_promise_is_caught(case: Case) -> None:
    (promise,) = [each for each in promises_of(case.spec, robots=ROUND) if each.name.startswith(case.promise)]
    with pytest.raises(PromiseBroken) as broken:
        promise.check(limit=1.0 if case.name == "NeverGivesUp" else 60.0)
    assert case.seen in str(broken.value)


def test_every_promise_has_a_component_that_breaks_it() -> None:
    caught = {case.promise for case in CASES}
    specs = (
        PLANNER,
        CONTROLLER,
        LOCALIZER,
        SPIN,
        CHECKER,
        STACK,
        NeedsABelief(),
        OnScans(),
        Meddles(),
        SaysNothing(),
        SENSOR,
        HasNoUnit(),
    )
    every = {promise.name for spec in specs for promise in promises_of(spec, robots=ROUND)}
    assert [name for name in sorted(every) if not any(name.startswith(each) for each in caught)] == []
