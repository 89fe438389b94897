"""Layouts that show logs in viewers of others: of Foxglove and Lichtblick for the topics of a log, and of RViz."""

import copy
import json
from collections.abc import Iterator, Mapping, Sequence
from importlib.resources import files
from typing import Any

from simscen.record import frame_names, topics
from simscen.record.frame_names import RobotFrames
from simscen.record.log_reader.read import Log

_SCAN, _ROBOT = "/scan", "robot"
_OF_ALL = (topics.MAP.name, topics.GLOBAL_COSTMAP.name, topics.THINGS.name)
"""What is drawn once, though each robot has it."""


def rviz_config() -> str:
    """RViz's configuration. Its topics are relative: they follow the namespace that rviz2 is started in."""
    return _shipped("simscen.rviz")


def foxglove_layout(log: Log | None = None) -> str:
    """The layout of Foxglove and Lichtblick (JSON) for a log, with all its robots and lidars, or for most logs."""
    layout = json.loads(_shipped("foxglove.json"))
    if log is not None:
        each = log.robots or {"": log}
        scans = {name: list(one.seen.scans) for name, one in each.items()}
        _show(layout["configById"], scans)
    return json.dumps(layout, indent=2) + "\n"


def _shipped(name: str) -> str:
    return files("simscen").joinpath(f"data/viewers/{name}").read_text("utf-8")


def _show(panels: dict[str, Any], scans: Mapping[str, Sequence[str]]) -> None:
    """Let the panels show these robots; `scans` are the topics of each one's lidars, without its namespace."""
    first = next(iter(scans))
    scene = panels["3D!scene"]
    scene["followTf"] = RobotFrames(first).of(frame_names.TRUTH)
    plain, robot = scene["topics"], scene["layers"].pop(_ROBOT)
    scene["topics"] = {}
    for number, (name, lidars) in enumerate(scans.items()):
        for topic, settings in _topics(plain, lidars):
            hidden = number > 0 and topic in _OF_ALL
            scene["topics"][_within(name, topic)] = {**settings, "visible": False} if hidden else settings
        own = {"topic": _within(name, robot["topic"]), "framePrefix": RobotFrames(name).of("")}
        key = f"{_ROBOT} {name}" if name else _ROBOT
        scene["layers"][key] = {**robot, **own, "instanceId": key, "label": f"{robot['label']} {name}".rstrip()}
    for panel in panels.values():
        paths = panel.get("paths", [])
        panel["paths"] = [_line(path, name) for name in scans for path in paths]
        for key in ("topicToRender", "topicPath"):
            if key in panel:
                panel[key] = _within(first, panel[key])
        if not paths:
            del panel["paths"]


def _topics(plain: Mapping[str, Any], lidars: Sequence[str]) -> Iterator[tuple[str, dict[str, Any]]]:
    """The topics of a robot with their settings, each lidar as the plain one."""
    for topic, settings in plain.items():
        for name in lidars if topic == _SCAN else [topic]:
            yield name, copy.deepcopy(settings)


def _line(path: Mapping[str, Any], robot: str) -> dict[str, Any]:
    label = f"{robot}: {path['label']}" if robot else path["label"]
    return {**path, "value": _within(robot, path["value"]), "label": label}


def _within(robot: str, topic: str) -> str:
    return f"/{robot}{topic}" if robot else topic
