"""Connect the crowd model of pedestrians to the physics simulation of a run."""

import math
from collections.abc import Callable
from functools import cached_property

import numpy as np
import numpy.typing as npt

from simscen.core.clock import Clock
from simscen.core.environment.world_model import BuiltWorld, WalkingPedestrian
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.meshes import submesh
from simscen.core.geometry.polygons import distance_to_polygon
from simscen.core.geometry.shapes import Body, Cylinder, MotionPath, Solid, TriangleMesh
from simscen.core.records.events import Event, EventKind, Value
from simscen.pedestrians.crowd import Crowd, Point
from simscen.pedestrians.surroundings import ObservedObject, ObservedRobot, Surroundings, WallMap
from simscen.sim.body.outline import convex_hull, footprint, hull_points, outlines_in_z_range
from simscen.sim.robots.robot import Robot
from simscen.sim.simulation import Simulation
from simscen.worlds.geometry.cross_section import CrossSection, cross_section, sections_between, winds_around
from simscen.worlds.routes.shortest_paths import ShortestPaths, shortest_paths_in

OBSTACLE_HEIGHTS_M = (0.15, 0.5, 0.95)
"""Heights of horizontal sections of the static world. Walls in these sections block the way of pedestrians.

Walls in the last section also block the view of pedestrians. More sections are computed for solids that are not prisms,
and for solids that are at none of these heights.
"""
HEIGHT_TOLERANCE_M = 0.001
"""Difference up to which heights of vertices count as equal."""
BODY_HEIGHT_RANGE_M = (0.05, 1.7)
"""Range of heights above the floor (z = 0) in which objects block the way of pedestrians."""
MAX_LEVEL_TILT = 0.01
"""Sine of half the largest tilt at which an object counts as level."""
PATH_CELL_M = 0.1
"""Cell size of the grid for path planning."""
PREFERRED_CLEARANCE_M = 0.2
"""Clearance between pedestrians and walls on planned paths, if there is enough space."""


class PedestrianMap:
    """Walls that block pedestrians, and paths around these walls. Both are computed when first needed."""

    def __init__(self, built: BuiltWorld) -> None:
        self._built = built
        self._planners: dict[float, ShortestPaths] = {}

    @cached_property
    def _cuts(self) -> list[CrossSection]:
        """Cross sections of the static world that block the way of pedestrians; the last one also blocks the view."""
        mesh = self._built.mesh
        cuts = [cross_section(mesh, height) for height in OBSTACLE_HEIGHTS_M]
        # Most solids are prisms, for which these cuts suffice. Other solids, such as tables, are cut at more heights.
        is_complete = _has_two_heights(mesh) & np.isin(
            np.arange(len(mesh.names)), np.concatenate([cut.owners for cut in cuts])
        )
        faces = ~is_complete[mesh.owners]
        part = submesh(mesh.vertices, mesh.faces[faces])
        other_solids = TriangleMesh(part.vertices, part.faces, mesh.owners[faces], mesh.names)
        return [*sections_between(other_solids, (OBSTACLE_HEIGHTS_M[0], BODY_HEIGHT_RANGE_M[1])), *cuts]

    @cached_property
    def walls(self) -> WallMap:
        """Walls that block pedestrians."""
        cuts = self._cuts
        opaque = np.concatenate([np.full(len(cut.owners), cut is cuts[-1]) for cut in cuts])
        owners = np.concatenate([cut.owners for cut in cuts]).astype(np.int64)
        return WallMap(np.concatenate([cut.segments for cut in cuts]), owners, opaque)

    def has_room(self, center: Point, radius: float) -> bool:
        """Return whether a pedestrian of `radius` m at `center` neither touches a wall nor is inside a solid."""
        is_inside = any(winds_around(cut.segments, center) for cut in self._cuts)
        return not is_inside and self.walls.distance(center) >= radius

    def plan_path(self, start: Point, goal: Point, radius: float) -> list[Point]:
        """Return the corners of a path around walls, without `start`; only `goal` if there is no path.

        `radius` is the radius of the pedestrian in m.
        """
        for clearance in (radius + PREFERRED_CLEARANCE_M, radius):
            if clearance not in self._planners:
                self._planners[clearance] = shortest_paths_in(
                    self._built, (), clearance, BODY_HEIGHT_RANGE_M, PATH_CELL_M
                )
            corners = self._planners[clearance].path(Pose2(*start, 0.0), Pose2(*goal, 0.0))
            if corners is not None:
                return [(x, y) for x, y in corners[1:].tolist()]
        return [goal]


def _has_two_heights(mesh: TriangleMesh) -> npt.NDArray[np.bool_]:
    """Return for each solid (n,) of a mesh whether all vertices are at its minimum height or at its maximum height."""
    z = mesh.vertices[mesh.faces, 2]
    lowest, highest = np.full(len(mesh.names), np.inf), np.full(len(mesh.names), -np.inf)
    np.minimum.at(lowest, mesh.owners, z.min(axis=1))
    np.maximum.at(highest, mesh.owners, z.max(axis=1))
    low, high = lowest[mesh.owners, np.newaxis], highest[mesh.owners, np.newaxis]
    is_between = ((z > low + HEIGHT_TOLERANCE_M) & (z < high - HEIGHT_TOLERANCE_M)).any(axis=1)
    has_two: npt.NDArray[np.bool_] = np.bincount(mesh.owners[is_between], minlength=len(mesh.names)) == 0
    return has_two


MAX_STEP_S = 0.05
"""Longest time step of the pedestrian model."""
EVENT_KINDS = {
    "reached": EventKind.PEDESTRIAN_REACHED,
    "reacted": EventKind.PEDESTRIAN_REACTED,
    "calmed": EventKind.PEDESTRIAN_CALMED,
}
"""Kind of the recorded event by `PedestrianEvent.kind`."""


class PedestrianSimulation:
    """Moves all pedestrians of a run, and passes their events to `listeners`."""

    def __init__(self, built: BuiltWorld, simulation: Simulation, clock: Clock) -> None:
        self._map, self._simulation = PedestrianMap(built), simulation
        self._period = max(1, int(MAX_STEP_S * clock.rate + 1e-9))
        self._step_s = self._period / clock.rate
        self._behaviors: dict[str, str] = {}
        self._hulls: dict[str, Array] = {}
        self._outlines: dict[str, tuple[tuple[Solid, ...] | None, float, tuple[Array, ...]]] = {}
        """Solids, height in m, and outlines in the body frame of each level object by name."""
        self.listeners: list[Callable[[Event], None]] = []

    @cached_property
    def _crowd(self) -> Crowd:
        return Crowd(self._map.walls, self._map.plan_path)

    def add(self, walker: WalkingPedestrian) -> Body:
        """Add a pedestrian and return its body."""
        crowd = self._crowd
        crowd.add(walker)
        self._behaviors[walker.name] = walker.behavior
        shape = Cylinder(walker.radius, walker.height)
        solids = (Solid(shape, Pose3(z=walker.height / 2), walker.name),)
        body = Body(walker.name, solids, Pose3.planar(walker.pose))
        self._simulation.add_steered_body(body, crowd.top_speed(walker.name))
        self._simulation.call_before_steps(self._period, self._step)
        return body

    def simulates(self, name: str) -> bool:
        """Return whether the body with this name is a pedestrian."""
        return name in self._behaviors

    def remove(self, name: str) -> None:
        """Stop simulating a pedestrian. Has no effect on other names."""
        if self._behaviors.pop(name, None) is not None:
            self._crowd.remove(name)

    def has_room(self, center: Point, radius: float, walls_only: bool) -> bool:
        """Return whether a pedestrian of `radius` m fits at `center`.

        `walls_only` ignores objects, robots, and other pedestrians.
        """
        if not self._map.has_room(center, radius):
            return False
        if walls_only:
            return True
        surroundings = self._surroundings()
        outlines = [outline for observed in surroundings.objects for outline in observed.outlines]
        outlines += [robot.pose.apply(robot.outline) for robot in surroundings.robots]
        position = Pose2(*center, 0.0)
        if any(distance_to_polygon(position, outline.tolist()) < radius for outline in outlines):
            return False
        others = [(pose, self._crowd.radius(name)) for name, pose in self._crowd.poses().items()]
        return all(position.distance(pose) >= radius + other for pose, other in others)

    def _step(self) -> None:
        crowd, step_s = self._crowd, self._step_s
        before = crowd.poses()
        events = crowd.step(self._surroundings(), step_s)
        for name, pose in crowd.poses().items():
            path = MotionPath((0.0, step_s), (before[name], pose))
            self._simulation.follow(name, path, crowd.top_speed(name))
        for event in events:
            data: dict[str, Value] = {"behavior": self._behaviors[event.name], "robot": event.goal_or_robot}
            if event.kind == "reached":
                data = {"goal": int(event.goal_or_robot)}
            recorded = Event(self._simulation.tick, EVENT_KINDS[event.kind], event.name, data)
            for listener in self.listeners:
                listener(recorded)

    # Perception of the pedestrians

    def _surroundings(self) -> Surroundings:
        robots = tuple(self._observe_robot(robot) for robot in self._simulation.robots.values())
        bodies = self._simulation.bodies_and_poses()
        others = [(name, body, pose) for name, (body, pose) in bodies.items() if name not in self._behaviors]
        return Surroundings(
            robots, tuple(ObservedObject(name, self._world_outlines(body, pose)) for name, body, pose in others)
        )

    def _world_outlines(self, body: Body, pose: Pose3) -> tuple[Array, ...]:
        """Return the outlines, in the world frame, of the solids of a body that block the way of pedestrians."""
        low, high = BODY_HEIGHT_RANGE_M
        if math.hypot(pose.qx, pose.qy) > MAX_LEVEL_TILT:
            corners = [pose.compose(solid.pose).apply(hull_points(solid.shape)) for solid in body.solids]
            in_range = [points[:, :2] for points in corners if points[:, 2].min() < high and points[:, 2].max() > low]
            return tuple(np.array(convex_hull(points)) for points in in_range)
        # Rounded, because the height of an object that rests on the ground varies by some micrometers.
        z = round(pose.z, 2)
        solids, cached_z, outlines = self._outlines.get(body.name, (None, 0.0, ()))
        if solids is not body.solids or cached_z != z:
            outlines = tuple(map(np.array, outlines_in_z_range(body.solids, (low - z, high - z))))
            self._outlines[body.name] = body.solids, z, outlines
        return tuple(pose.plane.apply(outline) for outline in outlines)

    def _observe_robot(self, robot: Robot) -> ObservedRobot:
        if robot.name not in self._hulls:
            self._hulls[robot.name] = np.array(footprint(robot.body.solids))
        outline = self._hulls[robot.name]
        (vx, vy, _), _ = robot.base_velocity()
        radius = float(np.hypot(outline[:, 0], outline[:, 1]).max())
        return ObservedRobot(robot.name, robot.base_pose().plane, (vx, vy), radius, outline)
