"""Interface of triggers and actions to a running simulation: triggers observe the world, and actions change it."""

import math
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from simscen.core.clock import Clock
from simscen.core.environment.costmap_filters import Filter, ZoneSwitch
from simscen.core.environment.world_model import FloorPatch, WalkingPedestrian, World
from simscen.core.geometry import Polygon, Pose2
from simscen.core.geometry.shapes import Body, MotionPath
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Belief, Path
from simscen.core.messages.sensor_data import Readings, Scan
from simscen.core.random_streams import Streams
from simscen.core.records.events import Event, EventKind, Value
from simscen.core.records.trace import Decision, Truth
from simscen.run.external.stack import ExternalStack
from simscen.run.live_world.costmap_filters import CostmapFilters
from simscen.run.live_world.event_data import body_data, path_data, pose_data
from simscen.run.live_world.pedestrians import PedestrianSimulation
from simscen.sim.robots.robot import Robot
from simscen.sim.simulation import Simulation
from simscen.stack.protocols import Stack
from simscen.stack.validation.stack import CheckedStack


class LiveStage:
    """Interface of triggers and actions for one robot; implements core.stage.Stage. Keeps the robot's events.

    An order is a request of an action to the robot's stack: a new goal, a cancellation, or a change of zones. Orders
    are delivered at the beats of the robot.
    """

    def __init__(
        self,
        world: World,
        simulation: Simulation,
        robot: Robot,
        stack: Stack,
        filters: CostmapFilters,
        clock: Clock,
        goals: Iterable[Goal],
        pedestrians: PedestrianSimulation,
        streams: Streams,
        stages: "dict[str, LiveStage]",
    ) -> None:
        """Add the stage to `stages`, the stages of all robots by name.

        `goals` are the goals that events can send. `streams` gives random numbers for actions.
        """
        self._world, self._simulation, self._robot, self._stack = world, simulation, robot, stack
        self._filters, self.clock = filters, clock
        self._pedestrians, self._streams = pedestrians, streams
        pedestrians.listeners.append(self.record_event)
        self._stages = stages
        stages[robot.name] = self
        self._goals = {goal.name: goal for goal in goals}
        self._update_pose()
        self.belief: Belief | None = None
        self.clearance: float | None = None
        self.travelled = 0.0
        self._scan_ticks: dict[str, int] = {}
        self._is_due = True
        self.pending_orders: list[Callable[[int], None]] = []
        """Orders for the robot's next beat: functions that take the current tick."""
        self.events: list[Event] = []
        self.new_events: list[Event] = []
        """Events since the last call of `take_events`."""
        self.is_observed = True
        """Whether a Director observes this stage. If so, the stage must be updated at each beat."""

    # Updates by the lockstep loop

    def begin_beat(self, truth: Truth | None, is_due: bool) -> None:
        """Update the robot's pose at a beat, from a truth sample if there is one.

        `is_due` is whether this is a beat of this robot. Orders that actions send during such a beat are delivered at
        once, all others at the robot's next beat.
        """
        self._is_due = is_due
        previous = self._pose
        self._update_pose(truth)
        self.travelled += math.hypot(self._pose.x - previous.x, self._pose.y - previous.y)

    def deliver_orders(self, tick: int) -> None:
        """Deliver the pending orders to the stack. Call it at a beat of this robot."""
        orders, self.pending_orders = self.pending_orders, []
        for order in orders:
            order(tick)

    def _send_order(self, order: Callable[[int], None]) -> None:
        """Deliver an order now if a beat of this robot is due, else at its next beat."""
        self.pending_orders.append(order)
        if self._is_due:
            self.deliver_orders(self.tick)

    def _update_pose(self, truth: Truth | None = None) -> None:
        """Update the true pose and the twist in the base frame, and the clearance if there is a truth sample."""
        if truth is not None:
            self._pose, self.twist, self.clearance = truth.pose, truth.twist, truth.clearance
        else:
            self._pose, self.twist = self._robot.base_pose(), self._robot.state().twist

    def update_from_stack(self, decision: Decision, readings: Readings) -> None:
        """Update belief, events, and ticks of scans from the stack's decision and the readings that it received."""
        for reading in readings:
            if isinstance(reading, Scan):
                self._scan_ticks[reading.sensor] = self.tick
        self.belief = decision.belief or self.belief
        self.events += decision.events

    def take_events(self) -> tuple[Event, ...]:
        """Return the events since the last call, ordered by tick."""
        events = tuple(sorted(self.new_events, key=lambda event: event.tick))
        self.new_events.clear()
        return events

    # Observed by triggers

    def last_scan_tick(self, sensor: str | None) -> int | None:
        return max(self._scan_ticks.values(), default=None) if sensor is None else self._scan_ticks.get(sensor)

    @property
    def tick(self) -> int:
        return self._simulation.tick

    @property
    def robots(self) -> tuple[str, ...]:
        return tuple(self._stages) if len(self._stages) > 1 else ()

    def of(self, robot: str) -> "LiveStage":
        return self._stages[robot]

    @property
    def robot(self) -> Pose2:
        return self._pose.plane

    @property
    def plan(self) -> Path | None:
        return self._stack.plan

    @property
    def goal(self) -> Goal | None:
        return self._stack.goal

    def region(self, name: str) -> Polygon:
        return self._world.regions[name]

    def object(self, name: str) -> Pose2 | None:
        pose = self._simulation.object_pose(name)
        return pose.plane if pose else None

    # Changed by actions

    def spawn(self, body: Body) -> None:
        if self._simulation.object_pose(body.name):
            self.remove(body.name)
        self._simulation.spawn(body)
        self.record_world_event(Event(0, EventKind.OBJECT_SPAWNED, body.name, body_data(body)))

    def remove(self, name: str) -> None:
        self._pedestrians.remove(name)
        self._simulation.remove(name)
        self.record_world_event(Event(0, EventKind.OBJECT_REMOVED, name))

    def add_pedestrian(self, walker: WalkingPedestrian) -> None:
        if self._simulation.object_pose(walker.name):
            self.remove(walker.name)
        data = {**body_data(self._pedestrians.add(walker)), "person": True, "behavior": walker.behavior}
        self.record_world_event(Event(0, EventKind.OBJECT_SPAWNED, walker.name, data))

    def has_room(self, place: tuple[float, float], radius: float, walls_only: bool = False) -> bool:
        return self._pedestrians.has_room(place, radius, walls_only)

    def rng(self, name: str) -> np.random.Generator:
        return self._streams.generator(name)

    def door(self, name: str) -> tuple[Pose2, Pose2]:
        return self._world.doors[name]

    def move(self, name: str, path: MotionPath) -> None:
        self._pedestrians.remove(name)
        self._simulation.move(name, path)
        self.record_world_event(Event(0, EventKind.OBJECT_MOVED, name, path_data(path)))

    def motion(self, name: str) -> tuple[MotionPath, float] | None:
        pose = self.object(name)
        if pose is not None and self._pedestrians.simulates(name):
            return MotionPath((0.0, 1.0), (pose, pose), "loop"), 0.0
        return self._simulation.motion(name)

    def mass(self, name: str) -> float:
        return self._simulation.mass(name)

    def place(self, name: str, pose: Pose2) -> None:
        self._pedestrians.remove(name)
        self._simulation.place(name, pose)
        self.record_world_event(Event(0, EventKind.OBJECT_PLACED, name, pose_data(pose)))

    def place_robot(self, pose: Pose2) -> None:
        self._simulation.place_robot(self._robot.name, pose)
        self._update_pose()
        self.record_event(Event(0, EventKind.ROBOT_PLACED, "", pose_data(pose)))

    def push(self, impulse: tuple[float, float], name: str | None = None, seconds: float = 0.0) -> None:
        if name is not None:
            self._simulation.push_object(name, impulse, seconds)
        else:
            self._simulation.push_robot(self._robot.name, impulse, seconds)
        data: dict[str, Value] = {"impulse": list(impulse), **({"seconds": seconds} if seconds else {})}
        kind = EventKind.ROBOT_PUSHED if name is None else EventKind.OBJECT_PUSHED
        (self.record_event if name is None else self.record_world_event)(Event(0, kind, name or "", data))

    def add_friction_patch(self, name: str, patch: FloorPatch) -> None:
        self._simulation.add_friction_patch(name, patch)
        outline: list[Value] = [[round(x, 3), round(y, 3)] for x, y in patch.outline]
        data: dict[str, Value] = {"outline": outline, "friction": patch.friction}
        data |= {} if math.isinf(patch.until) else {"until": patch.until / self.clock.rate}
        self.record_world_event(Event(0, EventKind.FLOOR_CHANGED, name, data))

    def send_goal(self, name: str) -> None:
        goal = self._goals[name]
        self._send_order(lambda tick: self._stack.preempt(tick, goal))

    def cancel_goal(self) -> None:
        self._send_order(self._stack.cancel)

    def record_world_event(self, event: Event) -> None:
        for stage in self._stages.values():
            stage.record_event(event)

    def switch_zone(self, order: ZoneSwitch) -> str:
        stack = self._zone_receiver(order.filter)
        if stack is None:
            return f"the stack does not support switching {order.filter} zones"
        if reason := self._filters.rejection_reason(order):
            return reason
        for region in self._filters.switch(order):
            limit = self._filters.speed_limit(region) if order.filter == "speed" else 0.0
            data: dict[str, Value] = {"filter": order.filter, "enabled": order.enabled}
            data |= {"speed_limit": limit} if limit and order.enabled else {}
            self.record_event(Event(0, EventKind.ZONE_SWITCHED, region, data))
        zones = self._filters.zones
        self._send_order(lambda tick: stack.set_zones(tick, zones))
        return ""

    def _zone_receiver(self, costmap_filter: Filter) -> CheckedStack | ExternalStack | None:
        """Return the stack if it can switch the zones of this costmap filter, else None."""
        stack = self._stack
        if isinstance(stack, ExternalStack):
            return stack if stack.receives_zones_of(costmap_filter) else None
        return stack if isinstance(stack, CheckedStack) and stack.can_switch_zones else None

    def record_event(self, event: Event) -> None:
        event = event if event.tick else replace(event, tick=self.tick)
        self.new_events.append(event)
        self.events.append(event)
