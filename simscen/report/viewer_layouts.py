"""Layouts for the programs Foxglove, Lichtblick, and RViz, which show the MCAP log of a run."""

import copy
import json
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from typing import Any

from simscen.record import frame_names, topics
from simscen.record.frame_names import RobotFrames
from simscen.record.log_reader import Log

_SCAN, _ROBOT = "/scan", "robot"
"""Topic of the lidar and key of the robot model in the shipped layout, which is for a single robot."""
_SHARED_TOPICS = (topics.MAP.name, topics.GLOBAL_COSTMAP.name, topics.OBJECT_MARKERS.name)
"""Topics that each robot has with the same content. Only those of the first robot are visible."""


def rviz_config() -> str:
    """Return a configuration for RViz. Topics are relative to the namespace in which rviz2 is started."""
    return _read_shipped("simscen.rviz")


def foxglove_layout(log: Log | None = None) -> str:
    """Return a layout for Foxglove and Lichtblick (JSON): for the robots and lidars of a log, or for a single robot."""
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

    `scans` maps the name of each robot, "" for a single one, to its lidar topics without namespace.
    """
    first = next(iter(scans))
    scene = panels["3D!scene"]
    scene["followTf"] = RobotFrames(first).log_frame(frame_names.TRUTH)
    defaults, robot = scene["topics"], scene["layers"].pop(_ROBOT)
    scene["topics"] = {}
    for number, (name, lidars) in enumerate(scans.items()):
        for topic, settings in _robot_topics(defaults, lidars):
            hidden = number > 0 and topic in _SHARED_TOPICS
            scene["topics"][_with_namespace(name, topic)] = {**settings, "visible": False} if hidden else settings
        changes = {"topic": _with_namespace(name, robot["topic"]), "framePrefix": RobotFrames(name).log_frame("")}
        key = f"{_ROBOT} {name}" if name else _ROBOT
        scene["layers"][key] = {**robot, **changes, "instanceId": key, "label": f"{robot['label']} {name}".rstrip()}
    for panel in panels.values():
        paths = panel.get("paths", [])
        panel["paths"] = [_plot_path(path, name) for name in scans for path in paths]
        for key in ("topicToRender", "topicPath"):
            if key in panel:
                panel[key] = _with_namespace(first, panel[key])
        if not paths:
            del panel["paths"]


def _robot_topics(defaults: Mapping[str, Any], lidars: Sequence[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the topics of a robot with their settings. All lidars have the settings of the default one."""
    for topic, settings in defaults.items():
        for name in lidars if topic == _SCAN else [topic]:
            yield name, copy.deepcopy(settings)


def _plot_path(path: Mapping[str, Any], robot: str) -> dict[str, Any]:
    """Return the settings of a plotted value for a robot."""
    label = f"{robot}: {path['label']}" if robot else path["label"]
    return {**path, "value": _with_namespace(robot, path["value"]), "label": label}


def _with_namespace(robot: str, topic: str) -> str:
    """Return the topic in the namespace of a robot, for example "/r1/scan"; "" is a single robot without namespace."""
    return f"/{robot}{topic}" if robot else topic
