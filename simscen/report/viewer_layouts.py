"""Layouts with which Foxglove, Lichtblick, and RViz show the MCAP log of a run."""

import copy
import json
from collections.abc import Mapping, Sequence
from importlib.resources import files
from typing import Any

from simscen.record import frame_names, topics
from simscen.record.frame_names import RobotFrames
from simscen.record.log_reader import Log

_SCAN_TOPIC, _ROBOT_LAYER = "/scan", "robot"
"""Lidar topic, and layer of the robot model, in the shipped Foxglove layout for a single robot."""
_SHARED_TOPICS = (topics.MAP.name, topics.GLOBAL_COSTMAP.name, topics.OBJECT_MARKERS.name)
"""Topics with the same content for all robots. The layout shows these topics of the first robot only."""


def rviz_config() -> str:
    """Return the shipped RViz configuration. Its topics are relative to the namespace in which rviz2 is started."""
    return _read_shipped("simscen.rviz")


def foxglove_layout(log: Log | None = None) -> str:
    """Return a Foxglove layout (JSON) for the robots and lidars of a log; without a log, for a single robot."""
    layout = json.loads(_read_shipped("foxglove.json"))
    if log is not None:
        logs = log.robots or {"": log}
        scans = {name: list(robot_log.sensors.scans) for name, robot_log in logs.items()}
        _show_robots(layout["configById"], scans)
    return json.dumps(layout, indent=2) + "\n"


def _read_shipped(name: str) -> str:
    return files("simscen").joinpath(f"data/viewers/{name}").read_text("utf-8")


def _show_robots(panels: dict[str, Any], scans: Mapping[str, Sequence[str]]) -> None:
    """Change `panels` (settings by panel name) to show all robots.

    `scans` are the lidar topics without namespace, by name of the robot ("" for a single robot).
    """
    first_robot = next(iter(scans))
    scene = panels["3D!scene"]
    scene["followTf"] = RobotFrames(first_robot).log_frame(frame_names.TRUTH)
    defaults, robot = scene["topics"], scene["layers"].pop(_ROBOT_LAYER)
    scene["topics"] = {}
    for number, (name, lidars) in enumerate(scans.items()):
        for default, settings in defaults.items():
            hidden = {"visible": False} if number > 0 and default in _SHARED_TOPICS else {}
            for topic in lidars if default == _SCAN_TOPIC else [default]:
                scene["topics"][_with_namespace(name, topic)] = {**copy.deepcopy(settings), **hidden}
        changes = {"topic": _with_namespace(name, robot["topic"]), "framePrefix": RobotFrames(name).log_frame("")}
        key = f"{_ROBOT_LAYER} {name}" if name else _ROBOT_LAYER
        scene["layers"][key] = {**robot, **changes, "instanceId": key, "label": f"{robot['label']} {name}".rstrip()}
    for panel in panels.values():
        paths = panel.get("paths", [])
        panel["paths"] = [_plot_path(path, name) for name in scans for path in paths]
        for key in ("topicToRender", "topicPath"):
            if key in panel:
                panel[key] = _with_namespace(first_robot, panel[key])
        if not paths:
            del panel["paths"]


def _plot_path(path: Mapping[str, Any], robot: str) -> dict[str, Any]:
    """Return the settings of a plotted message path with the topic and label of a robot."""
    label = f"{robot}: {path['label']}" if robot else path["label"]
    return {**path, "value": _with_namespace(robot, path["value"]), "label": label}


def _with_namespace(robot: str, topic: str) -> str:
    """Return the topic in the namespace of a robot, such as "/r1/scan"; the topic itself if `robot` is ""."""
    return f"/{robot}{topic}" if robot else topic
