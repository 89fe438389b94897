"""Data of the events that record how the world changes: poses, bodies, and paths."""

from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import Body, Box, Capsule, Cone, Cylinder, Extrusion, MotionPath, Shape, Sphere
from simscen.core.records.events import Value
from simscen.sim.body.outline import outlines_in_z_range
from simscen.worlds.routes.shortest_paths import Z_RANGE_M


def pose_data(pose: Pose2) -> dict[str, Value]:
    """Return a pose as event data."""
    return {"x": pose.x, "y": pose.y, "yaw": pose.yaw}


def path_data(path: MotionPath) -> dict[str, Value]:
    """Return the parameters of a path as event data."""
    poses: list[Value] = [[pose.x, pose.y, pose.yaw] for pose in path.poses]
    return {
        "waypoints": poses,
        "times": list(path.times),
        "repeat": path.mode,
        "ease": path.ease,
        "start": path.start,
        "phase": path.phase,
    }


def body_data(body: Body) -> dict[str, Value]:
    """Return the pose, mass, first shape, and outlines (in the body frame) of a body as event data."""
    outlines: list[Value] = [
        [[round(x, 3), round(y, 3)] for x, y in outline] for outline in outlines_in_z_range(body.solids, Z_RANGE_M)
    ]
    return {
        **pose_data(body.pose.plane),
        "mass": body.mass,
        **_shape_data(body.solids[0].shape),
        "parts": outlines,
    }


def _shape_data(shape: Shape) -> dict[str, Value]:
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
