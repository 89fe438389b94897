"""Goals and what came of each: reached, failed with which code, canceled, or never tried."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from simscen.core.messages.goal_names import matches_goal_name
from simscen.core.messages.navigation import Goal
from simscen.core.records.events import Event, EventKind
from simscen.core.records.verdict import Status
from simscen.report.picture import palette
from simscen.report.picture.canvas import Canvas, shown
from simscen.report.picture.labels import Label
from simscen.report.picture.palette import Color
from simscen.report.picture.scene import Scene

_ENDS = (EventKind.GOAL_REACHED, EventKind.GOAL_PASSED, EventKind.GOAL_FAILED, EventKind.GOAL_CANCELED)


@dataclass(frozen=True)
class Fate:
    """What came of a goal, in a word, its color, and what its label says of it."""

    word: str
    color: Color
    told: str = ""


def code_of(event: Event) -> str:
    """An error in Nav2's words: "NO_VALID_PATH (208)"; "" where the event names none."""
    name, code = event.data.get("error_name"), event.data.get("error_code")
    if not name or name == "NONE":
        return ""
    return f"{name} ({code})" if code else str(name)


def fate_of(goal: Goal, scene: Scene) -> Fate:
    """What the robot said of a goal; one that it claims to have reached and a criterion denies is failed."""
    ends = [event for event in scene.trace.of_kind(*_ENDS) if event.name == goal.name]
    if not ends:
        begun = any(event.name == goal.name for event in scene.trace.of_kind(EventKind.GOAL_ACCEPTED))
        return (
            Fate("not reached", palette.AMBER, "not reached") if begun else Fate("not tried", palette.GRAY, "not tried")
        )
    match ends[-1].kind:
        case EventKind.GOAL_FAILED:
            expected = "as expected" if goal.name in scene.case.expected else ""
            told = ", ".join(part for part in (f"failed {expected}".strip(), code_of(ends[-1])) if part)
            return Fate("failed", palette.AMBER if expected else palette.RED, told)
        case EventKind.GOAL_CANCELED:
            return Fate("canceled", palette.GRAY, "canceled")
        case _:
            denied = _denied(goal, scene)
            return Fate("failed", palette.RED, "not there") if denied else Fate("reached", palette.GREEN)


def _denied(goal: Goal, scene: Scene) -> bool:
    findings = [f for v in scene.result.verdicts if v.criterion == "goals_reached" for f in v.findings]
    return any(f.status is Status.FAIL and f.what.endswith(f"goal {goal.name}") for f in findings)


def draw_goals(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Each goal: its tolerance as a ring, its heading, its name, and what came of it."""
    sent = {event.name for event in scene.trace.of_kind(EventKind.GOAL_ACCEPTED)}
    goals = [goal for goal in scene.case.every_goal if goal.name in sent or goal not in scene.case.sent]
    names: dict[tuple[float, float], list[str]] = {}
    for goal in goals:
        fate = fate_of(goal, scene)
        there = names.setdefault((goal.pose.x, goal.pose.y), [])
        known = any(matches_goal_name(goal.name, other.partition(":")[0]) for other in there)
        if not known or fate.told:  # the second loop comes to the same place
            there.append(f"{goal.name}: {fate.told}" if fate.told else goal.name)
    for goal in goals:
        fate = fate_of(goal, scene)
        x, y, yaw = goal.pose
        reach = max(goal.xy_tolerance * canvas.scale, 5.0)
        hollow = fate.word in ("not tried", "canceled")
        canvas.disc(x, y, reach, None if hollow else (*fate.color, 46), fate.color, 1.8, busy=True)
        tip = (reach + 10) / canvas.scale
        heading = np.array([(x, y), (x + tip * math.cos(yaw), y + tip * math.sin(yaw))])
        canvas.line(heading, fate.color, 2.2, busy=True)
        if fate.word == "failed":
            bar = 0.72 * reach / canvas.scale
            for dy in (bar, -bar):
                canvas.line(np.array([(x - bar, y - dy), (x + bar, y + dy)]), fate.color, 2.0)
        else:
            canvas.disc(x, y, 2.6, fate.color)
        canvas.tell(f"goal {scene.called(goal.name)} {fate.word}", heading)
        if told := names.pop((x, y), None):
            rim = max(reach, 8.0)
            yield Label(1, x, y, shown(scene.called(", ".join(told))), fate.color, 14, rim)
