"""What an external stack is told before the first step: the objects of HELLO and GOAL."""

from dataclasses import dataclass
from typing import Any

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose3
from simscen.core.messages.goal_names import Mode
from simscen.core.messages.localization import Estimate
from simscen.core.messages.navigation import Goal
from simscen.core.version import __version__
from simscen.peer import wire
from simscen.record.topics import Topic
from simscen.run.external.topics import EXACT, Offer
from simscen.stack.protocols import RobotModel, Surroundings


@dataclass(frozen=True)
class Ordered:
    """What of a run a stack is told besides its surroundings; `robot_name` is "" where there is one robot."""

    seed: int
    control_period: int
    sensors: dict[str, str]
    mounts: dict[str, Pose3]
    rates: dict[str, float]
    robot_description: str
    stop_on_failure: bool
    mode: Mode = "navigate_to_pose"
    robot_name: str = ""


def hello(
    surroundings: Surroundings, ordered: Ordered, offer: Offer, named: list[tuple[str, Topic]], answer_limit: float
) -> dict[str, Any]:
    """The object of HELLO; `named` are the topics of each sensor."""
    masks = surroundings.masks
    sensor_of = {topic.name: sensor for sensor, topic in named}
    return {
        "protocols": [wire.PROTOCOL],
        "simscen": __version__,
        "seed": ordered.seed,
        "tick_rate": surroundings.tick_rate,
        "control_period": ordered.control_period,
        "answer_limit": answer_limit,
        "mode": ordered.mode,
        "robot_name": ordered.robot_name,
        "robot": _robot(surroundings.robot),
        "map": _grid(surroundings.map),
        "keepout": [_polygon(area) for area in surroundings.keepout],
        "speed_zones": [{"polygon": _polygon(area), "speed_limit": v} for area, v in surroundings.speed_zones],
        "keepout_mask": _grid(masks.keepout),
        "speed_mask": masks.speed
        and {
            **(_grid(masks.speed.grid) or {}),
            "percent": masks.speed.percent,
            "base": masks.speed.base,
            "multiplier": masks.speed.multiplier,
        },
        "lidars": list(surroundings.lidars),
        "sensors": {name: _sensor(name, ordered) for name in ordered.sensors},
        "says": [_topic(topic, offer.numbers[name], sensor_of) for name, topic in offer.says.items()],
        "hears": [
            {"topic": name, "type": offer.hears[name].type, "number": number} for number, name in offer.answers.items()
        ],
    }


def task(estimate: Estimate, goals: tuple[Goal, ...], ordered: Ordered) -> dict[str, Any]:
    """The object of GOAL."""
    pose = estimate.pose
    return {
        "initial_estimate": {"pose": None if pose is None else list(pose), "std": list(estimate.std)},
        "goals": [goal_data(goal) for goal in goals],
        "on_goal_failure": "stop" if ordered.stop_on_failure else "continue",
        "mode": ordered.mode,
    }


def goal_data(goal: Goal) -> dict[str, Any]:
    """A goal as GOAL and PREEMPT say it."""
    x, y, yaw = map(float, goal.pose)
    tolerances = {"xy_tolerance": goal.xy_tolerance, "yaw_tolerance": goal.yaw_tolerance}
    drive = {"timeout": goal.timeout, "via": goal.via, "wait": goal.wait}
    return {"name": goal.name, "x": x, "y": y, "yaw": yaw, **tolerances, **drive}


def _robot(robot: RobotModel) -> dict[str, Any]:
    return {
        "footprint": _polygon(robot.footprint),
        "radius": robot.radius,
        "max_linear": robot.max_linear,
        "max_reverse": robot.max_reverse,
        "max_lateral": robot.max_lateral,
        "max_angular": robot.max_angular,
        "linear_acceleration": robot.linear_acceleration,
        "linear_deceleration": robot.linear_deceleration,
        "angular_acceleration": robot.angular_acceleration,
        "turning_radius": robot.turning_radius,
        "holonomic": robot.holonomic,
    }


def _sensor(name: str, ordered: Ordered) -> dict[str, Any]:
    mount = ordered.mounts.get(name)
    return {"says": ordered.sensors[name], "rate": ordered.rates.get(name), "mount": mount and list(mount)}


def _topic(topic: Topic, number: int, sensor_of: dict[str, str]) -> dict[str, Any]:
    sensor = sensor_of.get(topic.name.removesuffix(EXACT))
    return {
        "topic": topic.name,
        "type": topic.type,
        "number": number,
        "latched": topic.latched,
        **({"sensor": sensor} if sensor is not None else {}),
    }


def _grid(grid: OccupancyGrid | None) -> dict[str, Any] | None:
    """What a nav_msgs/msg/OccupancyGrid rounds or turns into a quaternion."""
    if grid is None:
        return None
    height, width = grid.shape
    return {"resolution": grid.resolution, "width": width, "height": height, "origin": [float(v) for v in grid.origin]}


def _polygon(corners: Any) -> list[list[float]]:
    return [[float(x), float(y)] for x, y in corners]
