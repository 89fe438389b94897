"""The lockstep loop: physics, sensors, stack, and recording take turns on one clock.

A tick is one physics step. A beat is a tick at which a sensor, a stack, or a sample of the true state is due. Each pass
of the loop processes one beat:

1. observe: sample the true states, and collect new collisions
2. direct: start events, and start and end faults
3. decide: read the sensors, apply faults, and request a command from each stack
4. record: append the beat to the logs
5. drive: send the commands to the wheels, and simulate until the next beat

All robots decide before any robot moves.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from simscen.core.clock import Clock
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Decision, DeferredTruth, Moment, Truth
from simscen.record.moment_buffer import MomentSink
from simscen.run.faults.injector import FaultInjector
from simscen.run.live_world.director import Director
from simscen.run.live_world.stage import LiveStage
from simscen.run.robot_interface import SensorSuite, TickSchedule
from simscen.sim.robots.robot import Robot
from simscen.sim.simulation import Simulation
from simscen.stack.protocols import Stack

TIME_LIMIT = "time limit"
"""Name of the event that ends a run at its time limit."""


class EndCondition:
    """Condition under which one robot is done: `linger` seconds after its task has ended, or at the time limit.

    The robot continues if it accepts a new goal during these `linger` seconds, or later while another robot is not
    done. The run ends when all robots are done.
    """

    def __init__(self, clock: Clock, time_limit: float, linger: float, is_idle: bool = False) -> None:
        """`time_limit` and `linger` are in seconds. A robot that `is_idle` starts without a task and counts as done."""
        self.time_limit_tick = clock.ticks(time_limit)
        self._linger = clock.ticks(linger)
        self._end_tick: int | None = 0 if is_idle else None
        self.earliest_tick = self._compute_earliest_tick()
        """Earliest tick at which the robot can be done."""

    def update(self, decision: Decision) -> None:
        """Process the events in a decision of the robot's stack. Call it for each decision that has events."""
        for event in decision.events:
            if event.kind == EventKind.NAVIGATION_ENDED:
                self._end_tick = event.tick + self._linger
            elif event.kind == EventKind.GOAL_ACCEPTED:
                self._end_tick = None
        self.earliest_tick = self._compute_earliest_tick()

    def _compute_earliest_tick(self) -> int:
        return self.time_limit_tick if self._end_tick is None else min(self._end_tick, self.time_limit_tick)

    def end_event(self, tick: int) -> Event | None:
        """Return the event that ends the run for this robot at `tick`, or None if the robot is not done."""
        if self._end_tick is not None and tick >= self._end_tick:
            return Event(tick, EventKind.RUN_ENDED, "navigation ended")
        if tick >= self.time_limit_tick:
            return Event(tick, EventKind.RUN_ENDED, TIME_LIMIT)
        return None


def run_end_event(tick: int, conditions: Iterable[EndCondition]) -> Event | None:
    """Return the event that ends the run at `tick`, or None if a robot is not done yet.

    The event has the name TIME_LIMIT if the time limit ended the drive of any robot.
    """
    run_end: Event | None = None
    for condition in conditions:
        end = condition.end_event(tick)
        if end is None:
            return None
        run_end = end if run_end is None or end.name == TIME_LIMIT else run_end
    return run_end


@dataclass(eq=False)
class RobotUnderTest:
    """A robot with its sensors, its stack, its faults, and its logs.

    Call `observe` at each beat of any robot. If it sets `is_due`, then call `decide`, `record`, and `drive`.
    """

    robot: Robot
    sensors: SensorSuite
    stack: Stack
    faults: FaultInjector
    stage: LiveStage
    """Interface of triggers and actions to the world and to this robot."""
    end_condition: EndCondition
    schedule: TickSchedule
    """Computes the ticks of this robot's beats."""
    truth_period: int
    """Ticks between two samples of the true state."""
    logs: tuple[MomentSink, ...] = ()
    is_due: bool = field(default=True, init=False)
    """Whether the current tick is a beat of this robot."""
    next_tick: int = field(default=0, init=False)
    """Tick of the robot's next beat."""
    moment: Moment = field(init=False)
    """Record of the robot's last beat."""
    _truth: Truth | DeferredTruth | None = field(default=None, init=False)

    def observe(self, tick: int) -> None:
        """Set `is_due`, sample the true state if a sample is due, and record new collisions."""
        self.is_due = tick == self.next_tick
        if self.is_due:
            self.next_tick = tick + self.schedule.ticks_until_next(tick)
            if tick < self.end_condition.time_limit_tick < self.next_tick:
                self.next_tick = self.end_condition.time_limit_tick
        is_sampled = tick % self.truth_period == 0 or tick == self.end_condition.time_limit_tick
        if self.stage.is_observed:
            self._truth = truth = self.robot.truth() if is_sampled else None
            self.stage.begin_beat(truth, self.is_due)
        else:
            self._truth = self.robot.sample(self.truth_period) if is_sampled else None
        for collision in self.robot.collisions():
            self.stage.record_event(collision)

    def decide(self, tick: int) -> None:
        """Send the stack the pending orders of events, read the sensors, apply faults, and get the stack's decision."""
        stage, faults = self.stage, self.faults
        if stage.pending_orders:
            stage.deliver_orders(tick)
        readings = self.sensors.read(tick)
        if faults.active:
            readings = faults.disturb(readings)
        decision = self.stack.decide(tick, readings)
        if stage.is_observed:
            stage.update_from_stack(decision, readings)
        if decision.events:
            self.end_condition.update(decision)
        events = stage.take_events() if stage.new_events else ()
        self.moment = Moment(tick, self._truth, readings, decision, events)

    def record(self, end: Event | None) -> None:
        """Append the beat to all logs. `end` is the event that ends the run (None: the run continues)."""
        moment = self.moment if end is None else replace(self.moment, events=(*self.moment.events, end))
        for log in self.logs:
            log.append(moment)

    def drive(self) -> None:
        """Apply active faults to the stack's command, and send it to the wheels."""
        command = self.moment.decision.command
        self.robot.drive(self.faults.command(self.moment.tick, command) if self.faults.has_faults else command)


@dataclass(frozen=True)
class RunSetup:
    """Everything that the lockstep loop needs for one run."""

    simulation: Simulation
    robots: Sequence[RobotUnderTest]
    directors: Sequence[Director]


def run_lockstep(setup: RunSetup) -> Event:
    """Simulate and log a run until it ends; return the event that ended it."""
    simulation, robots, directors = setup.simulation, setup.robots, setup.directors
    truth_period, time_limit_tick = robots[0].truth_period, robots[0].end_condition.time_limit_tick
    while True:
        tick = simulation.tick
        for robot in robots:
            robot.observe(tick)
        for director in directors:
            director.process_beat()

        may_end = tick % truth_period == 0 or tick == time_limit_tick
        for robot in robots:
            if robot.is_due:
                robot.decide(tick)
            if tick < robot.end_condition.earliest_tick:
                may_end = False
        end = run_end_event(tick, [robot.end_condition for robot in robots]) if may_end else None
        for robot in robots:
            if robot.is_due:
                robot.record(end)
        if end is not None:
            return end

        for robot in robots:
            if robot.is_due:
                robot.drive()
        simulation.step(min([robot.next_tick for robot in robots]) - tick)
