"""`<actor>`: a body that follows its scripted trajectory and cannot be pushed.

As in Gazebo Classic (Actor::LoadScript) waypoints are poses in the world, trajectories follow each other by id, and
an actor waits at its first waypoint until that waypoint's time. Between waypoints simscen moves it along straight
lines, Gazebo along a spline through the same points.
"""

import math
from dataclasses import replace

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Body, Cylinder, MotionPath, Solid
from simscen.worlds.sdf import values
from simscen.worlds.sdf.links import read_link
from simscen.worlds.sdf.markup import Element
from simscen.worlds.sdf.placing import place
from simscen.worlds.sdf.report import Report
from simscen.worlds.sdf.shapes import ShapeReader
from simscen.worlds.sdf.tree import Model

PERSON = Cylinder(0.3, 1.8)
"""Stands in for a skin, which has no collision geometry."""

Waypoint = tuple[float, Pose3]


def read_actor(actor: Model, world: Model, reader: ShapeReader, report: Report) -> Body | None:
    """The moving body of an actor; None (and a note) for one that has nothing to see. Raises Unusable."""
    element = actor.element
    script = element.child("script")
    waypoints = _waypoints(script) if script else []
    start = waypoints[0][1] if waypoints else world.scope.place(actor.frame)
    ground = Pose3.planar(start.plane)
    solids = _solids(actor, start, ground, reader, report)
    if not solids:
        report.note(element.place, "an actor without skin and collision geometry is ignored")
        return None
    path = _path(script, waypoints, report) if script and len(waypoints) > 1 else None
    if path is None:
        report.note(element.place, "an actor without a scripted trajectory stands still")
    return Body(actor.name, solids, ground, 0.0, path)


def _solids(actor: Model, start: Pose3, ground: Pose3, reader: ShapeReader, report: Report) -> tuple[Solid, ...]:
    """In the frame on the ground below the actor, so that a planar path carries height and tilt along."""
    links = [read_link(link, reader, report) for link in place(actor, start, report)]
    found = [solid for link in links for solid in link.solids]
    if found:
        below = ground.inverse()
        return tuple(replace(solid, pose=below.compose(solid.pose)) for solid in found)
    if actor.element.child("skin") is None and not any(below.tag == "visual" for below in actor.element.descendants()):
        return ()
    report.note(actor.element.place, f"has no collision geometry: a cylinder of radius {PERSON.radius:g} m and height"
                f" {PERSON.length:g} m stands in for its skin")  # fmt: skip
    return (Solid(PERSON, Pose3(z=PERSON.length / 2), actor.name),)


def _waypoints(script: Element) -> list[Waypoint]:
    """All waypoints on one clock, in the order of time."""
    trajectories = sorted(script.all("trajectory"), key=_id)
    result: list[Waypoint] = []
    offset = 0.0
    for trajectory in trajectories:
        points = dict(_waypoint(element) for element in trajectory.all("waypoint"))
        if not points:
            continue
        times = sorted(points)
        for time in times if times[0] == 0.0 else [0.0, *times]:
            result.append((offset + time, points.get(time, points[times[0]])))
        offset += times[-1]
    return _ascending(result)


def _ascending(waypoints: list[Waypoint]) -> list[Waypoint]:
    """Without repeated ones; two places at the same time are a jump."""
    result = waypoints[:1]
    for time, pose in waypoints[1:]:
        if time > result[-1][0] or pose != result[-1][1]:
            result.append((time, pose))
    return result


def _id(trajectory: Element) -> int:
    text = trajectory.attributes.get("id", "0")
    if not (text.isascii() and text.strip().isdecimal()):
        raise trajectory.unusable(f"the id must be a whole number, got {text[:40]!r}")
    return int(text)


def _waypoint(element: Element) -> Waypoint:
    time = element.child("time")
    seconds = values.numbers(time, 1)[0] if time else 0.0
    if seconds < 0:
        raise element.unusable("a time before the start")
    return seconds, values.pose(element.child("pose"))


def _path(script: Element, waypoints: list[Waypoint], report: Report) -> MotionPath | None:
    if not values.truth(script.child("auto_start"), default=True):
        report.note(script.place, "auto_start is off and no plugin will start it")
        return None
    if any(_height_and_tilt(pose) != _height_and_tilt(waypoints[0][1]) for _, pose in waypoints):
        report.note(script.place, "the actor keeps the height and the tilt of its first waypoint")
    delay = script.child("delay_start")
    wait = values.numbers(delay, 1)[0] if delay else 0.0
    times = [time for time, _ in waypoints]
    poses = [pose.plane for _, pose in waypoints]
    if not values.truth(script.child("loop"), default=True):
        return MotionPath(tuple(times), tuple(poses), "once", wait)
    if wait > 0:  # a loop waits before each round
        times, poses = [0.0, *(time + wait for time in times)], [poses[0], *poses]
    return MotionPath(tuple(times), tuple(poses), "loop")


def _height_and_tilt(pose: Pose3) -> tuple[float, ...]:
    up = pose.rotation()[2]
    return round(pose.z, 3), *(round(math.degrees(math.asin(max(-1.0, min(1.0, float(part)))))) for part in up[:2])
