"""The lockstep loop: physics, sensors, stack, and recording take turns on one clock.

A beat is a tick at which a sensor, a stack, or a truth sample of any robot is due. One pass of the loop is one beat:

1. observe: update where each robot is and which collisions happened
2. direct: start the events and faults of the scenario whose triggers fire
3. decide: read the sensors that are due, apply faults, and ask each stack for a command
4. record: append what happened to the logs
5. drive: pass the commands to the wheels, then simulate until the next beat

All robots decide before any robot moves. The stack sees readings only, never the truth. Nothing here reads the wall
clock, so the speed of the machine has no effect on a run.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from simscen.core.records.events import Event
from simscen.core.records.trace import DeferredTruth, Moment, Truth
from simscen.record.backlog import Log
from simscen.run.faults.injector import FaultInjector
from simscen.run.live_world.director import Director
from simscen.run.live_world.stage import LiveStage
from simscen.run.sensing import SensorSuite, TickSchedule
from simscen.run.termination import EndCondition, run_end
from simscen.sim.robot import Robot
from simscen.sim.simulation import Simulation
from simscen.stack.protocols import Stack


@dataclass(eq=False)
class RobotUnderTest:
    """A robot with its sensors, its stack, its faults, and its logs.

    The methods are called in the order observe, decide, record, drive; all but `observe` only at beats of this robot,
    where `is_due` holds.
    """

    robot: Robot
    sensors: SensorSuite
    stack: Stack
    faults: FaultInjector
    stage: LiveStage
    end_condition: EndCondition
    schedule: TickSchedule
    truth_period: int
    """Ticks between two samples of the true state."""
    logs: tuple[Log, ...] = ()
    is_due: bool = field(default=True, init=False)
    """Whether the current tick is a beat of this robot."""
    next_tick: int = field(default=0, init=False)
    """The tick of the robot's next beat."""
    moment: Moment = field(init=False)
    """The record of the robot's last beat."""
    _truth: Truth | DeferredTruth | None = field(default=None, init=False)

    def observe(self, tick: int) -> None:
        """Sample the true state if a sample is due, and report new collisions."""
        self.is_due = tick == self.next_tick
        if self.is_due:
            self.next_tick = tick + self.schedule.until_next(tick)
            if tick < self.end_condition.limit < self.next_tick:
                self.next_tick = self.end_condition.limit
        is_sampled = tick % self.truth_period == 0 or tick == self.end_condition.limit
        if self.stage.is_observed:
            self._truth = truth = self.robot.truth() if is_sampled else None
            self.stage.begin_beat(truth, self.is_due)
        else:
            self._truth = self.robot.sample(self.truth_period) if is_sampled else None
        for collision in self.robot.collisions():
            self.stage.note(collision)

    def decide(self, tick: int) -> None:
        """Read the sensors, apply the active faults to the readings, and let the stack choose a command."""
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
        """Append the beat to all logs, with the event that ends the run if this is the last beat."""
        moment = self.moment if end is None else replace(self.moment, events=(*self.moment.events, end))
        for log in self.logs:
            log.append(moment)

    def drive(self) -> None:
        """Send the stack's command to the wheels, as changed by active faults."""
        command = self.moment.decision.command
        self.robot.drive(self.faults.command(self.moment.tick, command) if self.faults.possible else command)


@dataclass(frozen=True)
class RunSetup:
    """Everything that the lockstep loop needs for one run."""

    simulation: Simulation
    robots: Sequence[RobotUnderTest]
    directors: Sequence[Director]
    truth_period: int
    """Ticks between two samples of the true state."""


def run_lockstep(setup: RunSetup) -> Event:
    """Simulate a run to its end and return the event that ended it; each beat goes to the logs of its robot."""
    simulation, robots, directors = setup.simulation, setup.robots, setup.directors
    time_limit = robots[0].end_condition.limit
    while True:
        tick = simulation.tick
        for robot in robots:
            robot.observe(tick)
        for director in directors:
            director.direct()

        may_end = tick % setup.truth_period == 0 or tick == time_limit
        for robot in robots:
            if robot.is_due:
                robot.decide(tick)
            if tick < robot.end_condition.earliest_tick:
                may_end = False
        end = run_end(tick, [robot.end_condition for robot in robots]) if may_end else None
        for robot in robots:
            if robot.is_due:
                robot.record(end)
        if end is not None:
            return end

        for robot in robots:
            if robot.is_due:
                robot.drive()
        simulation.step(min([robot.next_tick for robot in robots]) - tick)
