"""Convert `<actor>` elements to bodies that follow a scripted trajectory and cannot be pushed.

As in Gazebo Classic (Actor::LoadScript), waypoints are world poses, trajectories follow each other by id, and an actor
waits at the first waypoint until the time of this waypoint. The interpolation is linear; Gazebo uses a spline.
"""

import math
from dataclasses import replace

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Body, Cylinder, MotionPath, Solid
from simscen.worlds.sdf.elements import Element, read_bool, read_numbers, read_pose
from simscen.worlds.sdf.link_poses import place_links
from simscen.worlds.sdf.links import read_link
from simscen.worlds.sdf.model_tree import ModelNode
from simscen.worlds.sdf.report import ImportReport
from simscen.worlds.sdf.shapes import ShapeReader

ACTOR_SHAPE = Cylinder(0.3, 1.8)
"""Shape (radius and height in m) of an actor that has a skin or visuals, but no collision geometry."""
MAX_ID_LENGTH = 18
"""Maximum number of characters of the id of a trajectory."""

Waypoint = tuple[float, Pose3]
"""Time in s and pose in the world."""


def read_actor(actor: ModelNode, world: ModelNode, reader: ShapeReader, report: ImportReport) -> Body | None:
    """Return the body of an actor, or None with a note in the report if the actor has no geometry.

    `world` is the node that contains the actor. Raises UnusableElement for invalid values.
    """
    element = actor.element
    script = element.child("script")
    waypoints = _read_waypoints(script) if script else []
    start = waypoints[0][1] if waypoints else world.scope.pose_of(actor.frame)
    ground_pose = Pose3.planar(start.plane)
    solids = _actor_solids(actor, start, ground_pose, reader, report)
    if not solids:
        report.note(element.location, "an actor without skin and collision geometry is ignored")
        return None
    path = _motion_path(script, waypoints, report) if script and waypoints and waypoints[-1][0] > 0 else None
    if path is None:
        report.note(element.location, "an actor without a scripted trajectory stands still")
    return Body(actor.name, solids, ground_pose, 0.0, path)


def _actor_solids(
    actor: ModelNode, start: Pose3, ground_pose: Pose3, reader: ShapeReader, report: ImportReport
) -> tuple[Solid, ...]:
    """Return the solids of an actor in the frame at `ground_pose`; () for an actor without any geometry.

    `start` is the initial pose of the actor in the world. `ground_pose` is the planar part of `start`.
    """
    links = [read_link(link, reader, report) for link in place_links(actor, start, report)]
    solids = [solid for link in links for solid in link.solids]
    if solids:
        ground_from_world = ground_pose.inverse()
        return tuple(replace(solid, pose=ground_from_world.compose(solid.pose)) for solid in solids)
    has_visual = any(descendant.tag == "visual" for descendant in actor.element.descendants())
    if actor.element.child("skin") is None and not has_visual:
        return ()
    report.note(
        actor.element.location,
        f"has no collision geometry: a cylinder of radius {ACTOR_SHAPE.radius:g} m and height {ACTOR_SHAPE.length:g} "
        "m stands in for its skin",
    )
    return (Solid(ACTOR_SHAPE, Pose3(z=ACTOR_SHAPE.length / 2), actor.name),)


def _read_waypoints(script: Element) -> list[Waypoint]:
    """Return the waypoints of all trajectories in the order of time. Time counts from the start of the script.

    Trajectories follow each other in the order of their ids.
    """
    waypoints: list[Waypoint] = []
    offset = 0.0
    for trajectory in sorted(script.all("trajectory"), key=_trajectory_id):
        poses = dict(_read_waypoint(element) for element in trajectory.all("waypoint"))
        if not poses:
            continue
        times = sorted(poses)
        for time in times if times[0] == 0.0 else [0.0, *times]:
            waypoints.append((offset + time, poses.get(time, poses[times[0]])))
        offset += times[-1]
    return _without_repetitions(waypoints)


def _without_repetitions(waypoints: list[Waypoint]) -> list[Waypoint]:
    """Return the waypoints without repeated ones. Two different poses at the same time remain as a jump."""
    result = waypoints[:1]
    for time, pose in waypoints[1:]:
        if time > result[-1][0] or pose != result[-1][1]:
            result.append((time, pose))
    return result


def _trajectory_id(trajectory: Element) -> int:
    text = trajectory.attributes.get("id", "0")
    if not (text.isascii() and text.strip().isdecimal() and len(text) <= MAX_ID_LENGTH):
        raise trajectory.unusable(f"the id must be a whole number, got {text[:40]!r}")
    return int(text)


def _read_waypoint(element: Element) -> Waypoint:
    time = element.child("time")
    seconds = read_numbers(time, 1)[0] if time else 0.0
    if seconds < 0:
        raise element.unusable("a time before the start")
    return seconds, read_pose(element.child("pose"))


def _motion_path(script: Element, waypoints: list[Waypoint], report: ImportReport) -> MotionPath | None:
    """Return the planar path of an actor; None with a note in the report if its script is never started."""
    if not read_bool(script.child("auto_start"), default=True):
        report.note(script.location, "auto_start is off and no plugin will start it")
        return None
    if any(_height_and_tilt(pose) != _height_and_tilt(waypoints[0][1]) for _, pose in waypoints):
        report.note(script.location, "the actor keeps the height and the tilt of its first waypoint")
    delay_element = script.child("delay_start")
    delay = read_numbers(delay_element, 1)[0] if delay_element else 0.0
    if delay_element and delay < 0:
        raise delay_element.unusable(f"must not be negative, got {delay_element.text}")
    times = [time for time, _ in waypoints]
    poses = [pose.plane for _, pose in waypoints]
    if not read_bool(script.child("loop"), default=True):
        return MotionPath(tuple(times), tuple(poses), "once", delay)
    if delay > 0:  # a loop waits before each round
        times, poses = [0.0, *(time + delay for time in times)], [poses[0], *poses]
    return MotionPath(tuple(times), tuple(poses), "loop")


def _height_and_tilt(pose: Pose3) -> tuple[float, ...]:
    """Return z rounded to 1 mm, and the tilt about two axes rounded to 1°."""
    up = pose.rotation()[2]
    return round(pose.z, 3), *(round(math.degrees(math.asin(max(-1.0, min(1.0, float(part)))))) for part in up[:2])
