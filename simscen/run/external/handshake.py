"""Content of the frames HELLO and GOAL, with which simscen starts the work of an external stack.

docs/reference/stack-protocol.md defines these frames.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from simscen.core.environment.costmap_filters import Zones
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose3
from simscen.core.messages.goals import Goal, Mode
from simscen.core.messages.navigation import Estimate
from simscen.core.version import __version__
from simscen.peer import wire
from simscen.record.topics import Topic
from simscen.run.external.protocol import EXACT_SUFFIX, STACK_TOPICS
from simscen.stack.protocols import Surroundings


@dataclass(frozen=True)
class RunParameters:
    """Parameters of a run that a stack receives besides its surroundings (robot model, map, and zones).

    Attributes:
        control_period: Ticks between two commands.
        sensors: Type of the readings by sensor name, such as "Scan".
        mounts: Pose in the base frame by sensor name; sensors without a mount are missing.
        rates: Readings per second by sensor name; 0 for a sensor without a fixed rate, such as a bumper.
        robot_description: URDF of the robot.
        stop_on_failure: Whether the stack must stop after a failed goal, instead of driving to the next goal.
        mode: Nav2 action that receives the goals.
        robot_name: Name of the robot; "" for a single robot.
        switchable_zones: Zones that events can switch.
    """

    seed: int
    control_period: int
    sensors: dict[str, str]
    mounts: dict[str, Pose3]
    rates: dict[str, float]
    robot_description: str
    stop_on_failure: bool
    mode: Mode
    robot_name: str
    switchable_zones: Zones


def hello_content(
    surroundings: Surroundings,
    parameters: RunParameters,
    available: Mapping[str, Topic],
    sensor_topics: list[tuple[str, Topic]],
    zone_masks: list[dict[str, Any]],
    answer_limit: float,
) -> dict[str, Any]:
    """Return the content of HELLO.

    `available` are the topics to which the stack can subscribe, by name. `sensor_topics` are pairs of a sensor name and
    a topic with its readings. `zone_masks` describes the values of zone masks (see `ZoneMasks.meanings`).
    `answer_limit` is the wall time in s that the stack may take for each answer.
    """
    masks = surroundings.masks
    sensor_of = {topic.name: sensor for sensor, topic in sensor_topics}
    return {
        "protocols": [wire.PROTOCOL],
        "simscen": __version__,
        "seed": parameters.seed,
        "tick_rate": surroundings.tick_rate,
        "control_period": parameters.control_period,
        "answer_limit": answer_limit,
        "mode": parameters.mode,
        "robot_name": parameters.robot_name,
        "robot": {**asdict(surroundings.robot), "footprint": _polygon_data(surroundings.robot.footprint)},
        "map": _grid_data(surroundings.map),
        "keepout": [_polygon_data(area) for area in surroundings.keepout],
        "speed_zones": [{"polygon": _polygon_data(area), "speed_limit": v} for area, v in surroundings.speed_zones],
        "keepout_mask": _grid_data(masks.keepout),
        "speed_mask": masks.speed
        and {
            **(_grid_data(masks.speed.grid) or {}),
            "percent": masks.speed.percent,
            "base": masks.speed.base,
            "multiplier": masks.speed.multiplier,
        },
        "zone_masks": zone_masks,
        "lidars": list(surroundings.lidars),
        "sensors": {name: _sensor_data(name, parameters) for name in parameters.sensors},
        "says": [_topic_data(topic, number, sensor_of) for number, topic in enumerate(available.values(), start=1)],
        "hears": [
            {"topic": topic.name, "type": topic.type, "number": number}
            for number, topic in enumerate(STACK_TOPICS, start=1)
        ],
    }


def goal_content(estimate: Estimate, goals: tuple[Goal, ...], parameters: RunParameters) -> dict[str, Any]:
    """Return the content of GOAL: the initial pose estimate, all goals, and the behavior after a failed goal."""
    pose = estimate.pose
    return {
        "initial_estimate": {"pose": None if pose is None else list(pose), "std": list(estimate.std)},
        "goals": [goal_data(goal) for goal in goals],
        "on_goal_failure": "stop" if parameters.stop_on_failure else "continue",
        "mode": parameters.mode,
    }


def goal_data(goal: Goal) -> dict[str, Any]:
    """Return a goal as JSON data for GOAL and PREEMPT."""
    x, y, yaw = map(float, goal.pose)
    tolerances = {"xy_tolerance": goal.xy_tolerance, "yaw_tolerance": goal.yaw_tolerance}
    drive = {"timeout": goal.timeout, "via": goal.via, "wait": goal.wait}
    return {"name": goal.name, "x": x, "y": y, "yaw": yaw, **tolerances, **drive}


def _sensor_data(name: str, parameters: RunParameters) -> dict[str, Any]:
    mount = parameters.mounts.get(name)
    return {"says": parameters.sensors[name], "rate": parameters.rates.get(name), "mount": mount and list(mount)}


def _topic_data(topic: Topic, number: int, sensor_of: dict[str, str]) -> dict[str, Any]:
    sensor = sensor_of.get(topic.name.removesuffix(EXACT_SUFFIX))
    return {
        "topic": topic.name,
        "type": topic.type,
        "number": number,
        "latched": topic.latched,
        **({"sensor": sensor} if sensor is not None else {}),
    }


def _grid_data(grid: OccupancyGrid | None) -> dict[str, Any] | None:
    """Return the exact resolution (m), size (cells), and origin of a grid, without its cells; None if grid is None."""
    if grid is None:
        return None
    height, width = grid.shape
    return {"resolution": grid.resolution, "width": width, "height": height, "origin": [float(v) for v in grid.origin]}


def _polygon_data(corners: Any) -> list[list[float]]:
    return [[float(x), float(y)] for x, y in corners]
