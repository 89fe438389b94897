"""The running world as triggers see it and as actions change it."""

import math
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np

from simscen.core.clock import Clock
from simscen.core.environment.costmap_filters import ZoneSwitch
from simscen.core.environment.pedestrians import WalkingPedestrian
from simscen.core.environment.world_model import Patch, Polygon, World
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.shapes import Body, Box, Capsule, Cone, Cylinder, Extrusion, MotionPath, Shape, Sphere
from simscen.core.messages.localization import Belief
from simscen.core.messages.navigation import Goal, Path
from simscen.core.messages.sensor_data import Readings, Scan
from simscen.core.random_streams import Streams
from simscen.core.records.events import Event, EventKind, Value
from simscen.core.records.trace import Decision, Truth
from simscen.run.live_world.costmap_filters import CostmapFilters
from simscen.run.live_world.pedestrians import PedestrianSimulation
from simscen.sim.outline import parts
from simscen.sim.robot import Robot
from simscen.sim.simulation import Simulation
from simscen.stack.installed.stack import InstalledStack
from simscen.stack.protocols import Stack
from simscen.worlds.shortest import Z_RANGE


class LiveStage:
    """Implements core.stage.Stage for one robot, on the simulation and its stack, and keeps the events of its run.

    What happens to the world happens to all robots, and is in the events of each.
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
        walking: PedestrianSimulation,
        streams: Streams,
        fellows: "dict[str, LiveStage]",
    ) -> None:
        """`filters` are those of its stack's costmap, `goals` those that events may send.

        To `fellows`, the stages of all robots, this one is added.
        """
        self._world, self._simulation, self._robot, self._stack = world, simulation, robot, stack
        self._filters, self.clock = filters, clock
        self._walking, self._streams = walking, streams
        walking.tell.append(self.note)
        self._fellows = fellows
        fellows[robot.name] = self
        self._goals = {goal.name: goal for goal in goals}
        self._look()
        self._belief: Belief | None = None
        self._clearance: float | None = None
        self._scanned: dict[str, int] = {}
        self._travelled = 0.0
        self._due = True
        self.pending_orders: list[Callable[[int], None]] = []
        """What the stack is to be told at its next beat."""
        self._history: tuple[Event, ...] = ()
        self.new_events: list[Event] = []
        """What has been noted since `take_events` was last asked."""
        self.is_observed = True
        """Whether anybody looks at it; else it need not be told of beats and of what the stack does."""

    # what the lockstep tells it

    def begin_beat(self, truth: Truth | None, due: bool = True) -> None:
        """Time has passed: see where the robot is now, by the truth where it was sampled.

        Where the beat is not `due` for this robot but for another, its stack hears orders at the next that is.
        """
        self._due = due
        before = self._pose
        self._look(truth)
        self._travelled += math.hypot(self._pose.x - before.x, self._pose.y - before.y)

    def deliver_orders(self, tick: int) -> None:
        """Give the stack the orders that have waited for this beat of its own."""
        orders, self.pending_orders = self.pending_orders, []
        for order in orders:
            order(tick)

    def _order(self, order: Callable[[int], None]) -> None:
        self.pending_orders.append(order)
        if self._due:
            self.deliver_orders(self.tick)

    def _look(self, truth: Truth | None = None) -> None:
        if truth is not None:
            self._pose, self._twist, self._clearance = truth.pose, truth.twist, truth.clearance
        else:
            self._pose, self._twist = self._robot.base_pose(), self._robot.base_twist()

    def update_from_stack(self, decision: Decision, readings: Readings = ()) -> None:
        """What the stack was told, and what it decided and published."""
        for reading in readings:
            if isinstance(reading, Scan):
                self._scanned[reading.sensor] = self.tick
        self._belief = decision.belief or self._belief
        self._history += decision.events

    def take_events(self) -> tuple[Event, ...]:
        """What has been noted since this was last asked, in the order of its ticks."""
        fresh = tuple(sorted(self.new_events, key=lambda event: event.tick))
        self.new_events.clear()
        return fresh

    # what triggers see

    @property
    def clearance(self) -> float | None:
        """Metres from the robot's hull to the nearest obstacle by the newest sample of the truth."""
        return self._clearance

    def scanned(self, sensor: str | None) -> int | None:
        """The tick at which the stack last received a scan of this lidar, or of any."""
        return max(self._scanned.values(), default=None) if sensor is None else self._scanned.get(sensor)

    @property
    def tick(self) -> int:
        """Simulated time in whole ticks."""
        return self._simulation.tick

    @property
    def robots(self) -> tuple[str, ...]:
        """The names of all robots; none where there is one only."""
        return tuple(self._fellows) if len(self._fellows) > 1 else ()

    def of(self, robot: str) -> "LiveStage":
        """The stage of another robot."""
        return self._fellows[robot]

    @property
    def robot(self) -> Pose2:
        """The true pose of the robot."""
        return self._pose.plane

    @property
    def twist(self) -> Twist:
        """The true velocity of the robot in its own frame."""
        return self._twist

    @property
    def travelled(self) -> float:
        """Metres driven so far; being set down elsewhere is no drive."""
        return self._travelled

    @property
    def belief(self) -> Belief | None:
        """What the stack last said about its pose."""
        return self._belief

    @property
    def events(self) -> tuple[Event, ...]:
        """Everything that has happened so far."""
        return self._history

    @property
    def plan(self) -> Path | None:
        """The plan the robot is following."""
        return self._stack.plan

    @property
    def goal(self) -> Goal | None:
        """The goal the robot is driving to."""
        return self._stack.goal

    def region(self, name: str) -> Polygon:
        """A named region of the world."""
        return self._world.regions[name]

    def object(self, name: str) -> Pose2 | None:
        """Where a named object is now."""
        pose = self._simulation.object_pose(name)
        return pose.plane if pose else None

    # what actions change

    def spawn(self, body: Body) -> None:
        """Put a body into the world; one of the same name is replaced."""
        if self._simulation.object_pose(body.name):
            self.remove(body.name)
        self._simulation.spawn(body)
        self.tell(Event(0, EventKind.OBJECT_SPAWNED, body.name, body_data(body)))

    def remove(self, name: str) -> None:
        """Take a body out of the world."""
        self._walking.go(name)
        self._simulation.remove(name)
        self.tell(Event(0, EventKind.OBJECT_REMOVED, name))

    def walk(self, walker: WalkingPedestrian) -> None:
        """Let somebody come; one of the same name is replaced."""
        if self._simulation.object_pose(walker.name):
            self.remove(walker.name)
        about = {**body_data(self._walking.come(walker)), "person": True, "behavior": walker.behavior}
        self.tell(Event(0, EventKind.OBJECT_SPAWNED, walker.name, about))

    def room(self, place: tuple[float, float], radius: float, walls_only: bool = False) -> bool:
        """Whether a person of a radius in metres can stand there."""
        return self._walking.room(place, radius, walls_only)

    def chance(self, name: str) -> np.random.Generator:
        """The random stream of this name, anew each time it is asked for."""
        return self._streams.generator(name)

    def door(self, name: str) -> tuple[Pose2, Pose2]:
        """The poses of a door's panel when closed and when open."""
        return self._world.doors[name]

    def move(self, name: str, path: MotionPath) -> None:
        """Let a body follow a path that begins now."""
        self._walking.go(name)
        self._simulation.move(name, path)
        self.tell(Event(0, EventKind.OBJECT_MOVED, name, path_data(path)))

    def motion(self, name: str) -> tuple[MotionPath, float] | None:
        """The path that moves an object now, and the seconds since it was set off."""
        here = self.object(name)
        if here is not None and self._walking.walks(name):
            return MotionPath((0.0, 1.0), (here, here), "loop"), 0.0  # no path says where somebody walks next
        return self._simulation.motion(name)

    def mass(self, name: str) -> float:
        """In kg, of an object that can be pushed."""
        return self._simulation.mass(name)

    def place(self, name: str, pose: Pose2) -> None:
        """Set an object down somewhere else."""
        self._walking.go(name)
        self._simulation.place(name, pose)
        self.tell(Event(0, EventKind.OBJECT_PLACED, name, {"x": pose.x, "y": pose.y, "yaw": pose.yaw}))

    def place_robot(self, pose: Pose2) -> None:
        """Set the robot down somewhere else."""
        self._robot.place(pose)
        self._look()
        self.note(Event(0, EventKind.ROBOT_PLACED, "", {"x": pose.x, "y": pose.y, "yaw": pose.yaw}))

    def push(self, impulse: tuple[float, float], name: str | None = None, seconds: float = 0.0) -> None:
        """Push the robot, or an object."""
        if name is not None:
            self._simulation.push_object(name, impulse, seconds)
        elif seconds:
            self._robot.press(impulse, seconds)
        else:
            self._robot.push(impulse)
        about: dict[str, Value] = {"impulse": list(impulse), **({"seconds": seconds} if seconds else {})}
        kind = EventKind.ROBOT_PUSHED if name is None else EventKind.OBJECT_PUSHED
        (self.note if name is None else self.tell)(Event(0, kind, name or "", about))

    def lay(self, name: str, patch: Patch) -> None:
        """Make a piece of floor slippery, or dry again."""
        self._simulation.lay(name, patch)
        outline: list[Value] = [[round(x, 3), round(y, 3)] for x, y in patch.outline]
        about: dict[str, Value] = {"outline": outline, "friction": patch.friction}
        about |= {} if math.isinf(patch.until) else {"until": patch.until / self.clock.rate}
        self.tell(Event(0, EventKind.FLOOR_CHANGED, name, about))

    def send_goal(self, name: str) -> None:
        """Preempt with a new goal."""
        goal = self._goals[name]
        self._order(lambda tick: self._stack.preempt(tick, goal))

    def cancel_goal(self) -> None:
        """Cancel what the robot is doing."""
        self._order(self._stack.cancel)

    def tell(self, event: Event) -> None:
        """Write an event to the logs of all robots: it happened to the world."""
        for stage in self._fellows.values():
            stage.note(event)

    def switch_zone(self, order: ZoneSwitch) -> str:
        """Tell the stack that a zone is on or off."""
        if not isinstance(self._stack, InstalledStack) or not self._stack.can_switch_zones:
            return "the stack cannot be told of zones that are switched"
        if refused := self._filters.refused(order):
            return refused
        for region in self._filters.switch(order):
            limit = self._filters.limit(region) if order.filter == "speed" else 0.0
            about: dict[str, Value] = {"filter": order.filter, "enabled": order.enabled}
            about |= {"speed_limit": limit} if limit and order.enabled else {}
            self.note(Event(0, EventKind.ZONE_SWITCHED, region, about))
        zones, told = self._filters.zones, self._stack.set_zones
        self._order(lambda tick: told(tick, zones))
        return ""

    def note(self, event: Event) -> None:
        """Write an event to the log of this robot; one without a tick happened now."""
        stamped = event if event.tick else replace(event, tick=self.tick)
        self.new_events.append(stamped)
        self._history += (stamped,)


def path_data(path: MotionPath) -> dict[str, Value]:
    """All that tells where something on the path is when; see core.shapes.MotionPath."""
    poses: list[Value] = [[pose.x, pose.y, pose.yaw] for pose in path.poses]
    clock: dict[str, Value] = {"start": path.start, "phase": path.phase}
    return {"waypoints": poses, "times": list(path.times), "repeat": path.mode, "ease": path.ease, **clock}


def body_data(body: Body) -> dict[str, Value]:
    """Pose, first shape, and the outlines in its own frame of what a robot may touch, for pictures and judging."""
    pose = body.pose.plane
    place: dict[str, Value] = {"x": pose.x, "y": pose.y, "yaw": pose.yaw, "mass": body.mass}
    outlines: list[Value] = [
        [[round(x, 3), round(y, 3)] for x, y in outline] for outline in parts(body.solids, Z_RANGE)
    ]
    return {**place, **_outline(body.solids[0].shape), "parts": outlines}


def _outline(shape: Shape) -> dict[str, Value]:
    match shape:
        case Box(size):
            return {"shape": "box", "size": list(size)}
        case Cylinder(radius, length) | Capsule(radius, length) | Cone(radius, length):
            return {"shape": "cylinder", "size": [radius, length]}
        case Sphere(radius):
            return {"shape": "cylinder", "size": [radius, 2 * radius]}
        case Extrusion(polygon, height):
            return {"shape": "polygon", "points": [list(corner) for corner in polygon], "size": [height]}
        case _:
            return {"shape": "mesh", "size": []}
