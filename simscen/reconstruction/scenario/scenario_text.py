"""Formats a reconstructed scenario as YAML, with a comment that gives the reason for each part.

The functions `_…_lines` yield or return the lines of a part of the file.
"""

from __future__ import annotations

import json
import math
import re
import textwrap
from collections.abc import Iterator, Mapping
from typing import Any

from simscen.core.geometry import Pose2
from simscen.loading.yaml.writing import CompactDumper, to_yaml
from simscen.reconstruction.objects.found_object import FittedPedestrian, FoundObject
from simscen.reconstruction.objects.pedestrians import is_person
from simscen.reconstruction.reasons import FoundFault
from simscen.reconstruction.scenario.contents import ScenarioContents

MAX_COLUMNS = 118
"""Maximum length of the lines of comments, of the description, and of the keys of a pedestrian."""
OBJECT_HEIGHT_M, PERSON_HEIGHT_M = 1.0, 1.7
"""Assumed heights of objects and people."""
NO_BREAK_SPACE = "\x00"
"""Placeholder for a space at which lines must not be broken."""
_PLAIN_SCALAR = re.compile(r"[\w./ %-]+")
"""Scalars that need no quotes in flow style."""


def scenario_text(contents: ScenarioContents) -> str:
    """Return the YAML text of the scenario file."""
    return "\n".join(_scenario_lines(contents)) + "\n"


def _scenario_lines(contents: ScenarioContents) -> Iterator[str]:
    yield from _comment_lines(
        f"Written by `simscen new --from-log` from {contents.source}. Times count from its start."
    )
    if contents.unknowns:
        yield from _comment_lines("The log does not show:")
        for unknown in contents.unknowns:
            yield from _comment_lines(f"- {unknown}", hanging="  ")
    yield "simscen: 1"
    yield f"name: {_text(contents.name)}"
    yield "description: >"
    for line in textwrap.wrap(" ".join(contents.summary), MAX_COLUMNS - 2, break_long_words=False):
        yield f"  {line}"
    yield "tags: [from-log]"
    yield f"seed: {contents.given.seed}"
    yield ""
    yield from _reason_lines(contents, "world")
    yield from _entry_lines("world", contents.given.world)
    if contents.given.map:
        yield from _reason_lines(contents, "map")
        yield from _entry_lines("map", contents.given.map)
    yield from _robot_lines(contents)
    if contents.given.stack:
        yield from _reason_lines(contents, "stack")
        yield from _entry_lines("stack", dict(contents.given.stack))
    if contents.passing_radius is not None:
        yield from _reason_lines(contents, "navigation")
        yield f"navigation: {{mode: navigate_through_poses, radius: {contents.passing_radius:g} m}}"
    if not contents.stops_at_failure:
        yield "on_goal_failure: continue"
    yield from _goal_lines(contents)
    yield f"time_limit: {contents.time_limit:.0f} s"
    yield from _event_lines(contents)
    if contents.estimated.faults:
        yield ""
        yield "faults:"
        for fault in contents.estimated.faults:
            yield from _comment_lines(fault.reason.comment, "  ")
            yield f"  - {_flow(_fault_entry(fault))}"
    yield ""
    yield "pass:"
    for criterion in contents.criteria:
        yield from _comment_lines(criterion.reason.comment, "  ")
        yield f"  - {criterion.kind}: {_flow(dict(criterion.values))}"


def _comment_lines(text: str, indent: str = "", hanging: str = "") -> list[str]:
    """Return the lines of a YAML comment. `hanging` is the additional indentation of the second and further lines."""
    return textwrap.wrap(
        text,
        MAX_COLUMNS,
        initial_indent=f"{indent}# ",
        subsequent_indent=f"{indent}# {hanging}",
        break_long_words=False,
        break_on_hyphens=False,
    )


def _reason_lines(contents: ScenarioContents, key: str) -> list[str]:
    """Return the reason for the value of a key as a comment; [] without a reason."""
    reason = contents.reasons.get(key)
    return [] if reason is None else _comment_lines(reason.comment)


def _robot_lines(contents: ScenarioContents) -> Iterator[str]:
    yield ""
    yield from _reason_lines(contents, "robot")
    yield "robot:"
    yield f"  model: {_text(contents.given.robot)}"
    if (start := contents.reasons.get("start")) is not None:
        yield from _comment_lines(start.comment, "  ")
    yield f"  pose: {_pose(contents.start)}"
    if contents.estimate is None:
        return
    if (estimate := contents.reasons.get("estimate")) is not None:
        yield from _comment_lines(estimate.comment, "  ")
    if isinstance(contents.estimate, str):
        yield f"  initial_estimate: {contents.estimate}"
        return
    pose, (x, y, yaw) = contents.estimate
    std = f"[{x:.3f}, {y:.3f}, {math.degrees(yaw):.1f} deg]"
    yield f"  initial_estimate: {_pose(pose)[:-1]}, std: {std}}}"


def _goal_lines(contents: ScenarioContents) -> Iterator[str]:
    yield ""
    yield "goals:" if contents.goals else "goals: []"
    for goal in contents.goals:
        yield from _comment_lines(goal.reason.comment, "  ")
        entry = f"name: {_text(goal.name)}, pose: {_pose(goal.pose)}, timeout: {goal.timeout:g} s"
        entry += f", expect: {{error_code: {goal.expect}}}" if goal.expect else ""
        entry += f", on_reached: {{wait: {goal.wait:.1f} s}}" if goal.wait else ""
        yield f"  - {{{entry}}}"


def _event_lines(contents: ScenarioContents) -> Iterator[str]:
    if not contents.estimated.objects and not contents.estimated.kidnaps:
        return
    yield ""
    yield "events:"
    for thing in contents.estimated.objects:
        yield from _comment_lines(thing.comment, "  ")
        yield from _object_lines(thing)
    for time, pose, reason in contents.estimated.kidnaps:
        yield from _comment_lines(reason.comment, "  ")
        yield f"  - name: robot is carried off at {time:.1f} s"
        yield f"    when: {{time: {time:.2f} s}}"
        yield f"    do: {{kidnap: {{pose: {_pose(pose)}}}}}"


def _object_lines(thing: FoundObject) -> Iterator[str]:
    yield from _scripted_object_lines(thing) if thing.pedestrian is None else _pedestrian_lines(thing.pedestrian)
    if thing.disappear_time is not None:
        yield f"  - name: {_text(f'{thing.name} disappears')}"
        yield f"    when: {{time: {thing.disappear_time:.2f} s}}"
        yield f"    do: {{remove: {{name: {_text(thing.name)}}}}}"


def _pedestrian_lines(fitted: FittedPedestrian) -> Iterator[str]:
    walker = fitted.walker
    goals = ", ".join(f"[{x:.2f}, {y:.2f}]" for x, y in walker.goals)
    keys = [
        f"name: {_text(walker.name)}",
        f"pose: {_pose(walker.pose)}",
        f"goals: [{goals}]",
        f"speed: {walker.speed:.2f} m/s",
        f"radius: {walker.radius:.2f} m",
    ]
    if walker.behavior != "regular":
        keys += [f"behavior: {walker.behavior}", f"reacts_for: {walker.reacts_for:.1f} s"]
    if walker.blind_to:
        keys.append(f"blind_to: [{', '.join(sorted(walker.blind_to))}]")
    yield f"  - name: {_text(f'{walker.name} appears')}"
    yield f"    when: {{time: {fitted.appear_time:.2f} s}}"
    yield "    do:"
    yield "      pedestrian:"
    mapping = ", ".join(key.replace(" ", NO_BREAK_SPACE) for key in keys)
    lines = textwrap.wrap(f"{{{mapping}}}", MAX_COLUMNS, initial_indent=" " * 8, subsequent_indent=" " * 9)
    yield from (line.replace(NO_BREAK_SPACE, " ") for line in lines)


def _scripted_object_lines(thing: FoundObject) -> Iterator[str]:
    begin = thing.appear_time or 0.0
    _, x, y, yaw = thing.keyframes[0]
    height = PERSON_HEIGHT_M if is_person(thing) else OBJECT_HEIGHT_M
    size = ", ".join(f"{value:.2f}" for value in (*thing.size, height))
    shape = f"{'cylinder' if thing.is_cylinder else 'box'}: [{size}]"
    spawn = f"spawn: {{name: {_text(thing.name)}, {shape}, pose: {_pose(Pose2(x, y, yaw))}}}"
    yield f"  - name: {_text(f'{thing.name} appears' if begin else f'{thing.name} is there')}"
    yield f"    when: {{time: {begin:.2f} s}}"
    if thing.is_moving:
        yield "    do:"
        yield f"      - {spawn}"
        yield f"      - move: {{name: {_text(thing.name)}, keyframes: ["
        for time, x, y, yaw in thing.keyframes:
            yield f"          [{max(time - begin, 0.0):.2f}, {x:.3f}, {y:.3f}, {math.degrees(yaw):.1f} deg],"
        yield "        ]}"
    else:
        yield f"    do: {{{spawn}}}"


def _fault_entry(fault: FoundFault) -> dict[str, Any]:
    """Return the entry of the key `faults` for a fault."""
    entry: dict[str, Any] = {"sensor": fault.target, fault.kind: dict(fault.values)}
    if fault.begin is not None:
        entry["when"] = {"time": f"{fault.begin:.2f} s"}
    if fault.duration is not None:
        entry["for"] = f"{fault.duration:.2f} s"
    return entry


def _pose(pose: Pose2) -> str:
    """Return a pose as a YAML mapping in flow style."""
    return f"{{x: {pose.x:.3f}, y: {pose.y:.3f}, yaw: {math.degrees(pose.yaw):.1f} deg}}"


def _text(text: str) -> str:
    """Return a string as a YAML scalar, with quotes if flow style requires them."""
    plain = to_yaml({"x": text}).removeprefix("x: ").rstrip("\n")
    return plain if _PLAIN_SCALAR.fullmatch(plain) else json.dumps(text, ensure_ascii=False)


def _entry_lines(key: str, value: Any) -> list[str]:
    """Return the lines of a key with its value."""
    if isinstance(value, str):
        return [f"{key}: {_text(value)}"]
    return to_yaml({key: value}, CompactDumper).rstrip("\n").split("\n")


def _flow(value: Any) -> str:
    """Return a mapping, sequence, or scalar in YAML's flow style, on one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key}: {_flow(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_flow(item) for item in value) + "]"
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, float):
        return f"{value:.4g}"
    return str(value)
