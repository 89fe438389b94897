"""Goals, faults, events, marks, collisions, violations, and places on the picture of a run.

Each function `draw_…` draws one layer on the canvas, and yields its labels. A layer without labels ends with
`yield from ()`, so that the function is a generator.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from simscen.core.messages.goals import matches_goal_name
from simscen.core.records.events import Event, EventKind
from simscen.core.records.verdict import Status
from simscen.criteria.goal_outcomes import GoalOutcome, goal_outcomes
from simscen.criteria.timeline import spans
from simscen.judge.finding_text import comparison, subject
from simscen.report.picture import palette
from simscen.report.picture.canvas import Canvas, printable
from simscen.report.picture.labels import Label
from simscen.report.picture.palette import Color
from simscen.report.picture.path_layer import driven_segments
from simscen.report.picture.scene import Scene

MAX_VIOLATION_CHARACTERS = 60
"""Maximum length of the label of a violation."""


@dataclass(frozen=True)
class GoalMark:
    """Color and text that show the outcome of a goal on the picture.

    `word` is reached, failed, canceled, "not reached", or "not tried". In the label, `text` follows the name of the
    goal; "" for a goal that was reached.
    """

    word: str
    color: Color
    text: str = ""


def error_code_text(event: Event) -> str:
    """Return the error of Nav2 in an event, for example "NO_VALID_PATH (208)"; "" if there is none."""
    name, code = event.data.get("error_name"), event.data.get("error_code")
    if not name or name == "NONE":
        return ""
    return f"{name} ({code})" if code else str(name)


def _goal_mark(outcome: GoalOutcome, scene: Scene) -> GoalMark:
    """Return the mark of a goal.

    A goal that the stack reported as reached counts as failed if the criterion goals_reached found the robot elsewhere.
    """
    if outcome.end is None:
        word = "not tried" if outcome.accepted_tick is None else "not reached"
        return GoalMark(word, palette.GRAY if outcome.accepted_tick is None else palette.AMBER, word)
    match outcome.end.kind:
        case EventKind.GOAL_FAILED:
            expected = "as expected" if outcome.failed_as_expected else ""
            text = ", ".join(part for part in (f"failed {expected}".strip(), error_code_text(outcome.end)) if part)
            return GoalMark("failed", palette.AMBER if expected else palette.RED, text)
        case EventKind.GOAL_CANCELED:
            return GoalMark("canceled", palette.GRAY, "canceled")
        case _:
            prefix = f"{scene.robot_name}/" if scene.robot_name else ""
            verdicts = [v for v in scene.result.verdicts if v.criterion == "goals_reached" and v.id.startswith(prefix)]
            findings = [finding for verdict in verdicts for finding in verdict.findings]
            if any(f.status is Status.FAIL and f.what == f"goal {outcome.goal.name}" for f in findings):
                return GoalMark(
                    "failed", palette.RED, "reached unexpectedly" if outcome.expected_failure else "robot elsewhere"
                )
            return GoalMark("reached", palette.GREEN)


def draw_goals(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw each goal with its tolerance as a ring, and with its heading and outcome.

    Goals at the same position have one label. Goals of actions `new_goal` that did not take place are omitted.
    """
    accepted_names = {event.name for event in scene.trace.of_kind(EventKind.GOAL_ACCEPTED)}
    goals = [goal for goal in scene.case.every_goal if goal.name in accepted_names or goal not in scene.case.sent]
    outcomes = {outcome.goal.name: outcome for outcome in goal_outcomes(scene.trace, scene.case)}
    marks = [(goal, _goal_mark(outcomes[goal.name], scene)) for goal in goals]
    names: dict[tuple[float, float], list[str]] = {}
    for goal, mark in marks:
        entries = names.setdefault((goal.pose.x, goal.pose.y), [])
        is_listed = any(matches_goal_name(goal.name, other.partition(":")[0]) for other in entries)
        if not is_listed or mark.text:  # goals of a second loop have the same position
            entries.append(f"{goal.name}: {mark.text}" if mark.text else goal.name)
    for goal, mark in marks:
        x, y, yaw = goal.pose
        radius = max(goal.xy_tolerance * canvas.scale, 5.0)
        is_hollow = mark.word in ("not tried", "canceled")
        canvas.disc(x, y, radius, None if is_hollow else (*mark.color, 46), mark.color, 1.8, blocks_labels=True)
        tip = (radius + 10) / canvas.scale
        heading = np.array([(x, y), (x + tip * math.cos(yaw), y + tip * math.sin(yaw))])
        canvas.line(heading, mark.color, 2.2, blocks_labels=True)
        if mark.word == "failed":
            bar = 0.72 * radius / canvas.scale
            for dy in (bar, -bar):
                canvas.line(np.array([(x - bar, y - dy), (x + bar, y + dy)]), mark.color, 2.0)
        else:
            canvas.disc(x, y, 2.6, mark.color)
        canvas.add_part(f"goal {scene.label(goal.name)} {mark.word}", heading)
        if texts := names.pop((x, y), None):
            rim = max(radius, 8.0)
            yield Label(1, x, y, printable(scene.label(", ".join(texts))), mark.color, 14, rim)


_STAR = [(r * math.cos(a), r * math.sin(a)) for k in range(16) for r, a in [((16, 7)[k % 2], k * math.pi / 8)]]
_CROSS = [(1.6, 0), (5.4, 3.8), (3.8, 5.4), (0, 1.6), (-3.8, 5.4), (-5.4, 3.8), (-1.6, 0)]
_CROSS += [(-5.4, -3.8), (-3.8, -5.4), (0, -1.6), (3.8, -5.4), (5.4, -3.8)]
FLAG = [(0, 0), (0, -18), (12, -13), (1.5, -9), (1.5, 0)]
_BOLT = [(1, -10), (-6, 2), (-1, 2), (-2, 10), (6, -3), (1, -3)]
DIAMOND, SMALL_DIAMOND = ([(0, -r), (r, 0), (0, r), (-r, 0)] for r in (6, 4))
"""Corners of the symbols in pixels from the center, x right and y down."""


def draw_fault_bands(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw a wide band along the part of the path on which a fault was active."""
    segments = driven_segments(scene)
    for start, end, name in _faults(scene):
        for segment in segments:
            is_active = (segment.ticks >= start) & (segment.ticks <= end)
            canvas.line(segment.values[is_active, :2], palette.FAULTY, 11.0)
            if is_active.any():
                canvas.add_part(f"fault {scene.label(name)}", segment.values[is_active][[0, -1], :2])
    yield from ()


def draw_faults(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw a bolt at the position of the robot at the start (amber) and at the end (gray) of each fault."""
    trace = scene.trace
    for start, end, name in _faults(scene):
        bolts = [(start, f"{name} from", palette.AMBER), (end, f"{name} over,", palette.FAINT_INK)]
        for tick, text, color in bolts if end < trace.end else bolts[:1]:
            x, y = trace.place(tick)
            canvas.disc(x, y, 11, (255, 255, 255, 225), color, 1.4, blocks_labels=True)
            canvas.symbol(x, y, _BOLT, color)
            label = printable(scene.label(f"{text} {trace.seconds(tick):.1f} s"))
            yield Label(2, x, y, label, palette.AMBER, 12, 12.0)


def _faults(scene: Scene) -> list[tuple[int, int, str]]:
    """Return (start tick, end tick, name) of each fault. A fault that is active to the end has the last tick as end."""
    names = dict.fromkeys(event.name for event in scene.trace.of_kind(EventKind.FAULT_STARTED))
    faults = [(span.start, span.end, name) for name in names for span in spans(scene.trace, name)]
    return sorted(faults, key=lambda fault: fault[0])


def draw_events(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw a diamond where the robot was when a named event of the scenario started or a new goal arrived."""
    trace = scene.trace
    events = [(event.tick, event.name) for event in trace.of_kind(EventKind.EVENT_STARTED) if event.name]
    new_goals = {goal.name for goal in scene.case.sent}
    events += [(e.tick, f"new goal {e.name}") for e in trace.of_kind(EventKind.GOAL_ACCEPTED) if e.name in new_goals]
    for tick, name in events:
        x, y = trace.place(tick)
        canvas.symbol(x, y, DIAMOND, palette.INK)
        canvas.add_part(f"event {scene.label(name)}", [(x, y)])
        yield Label(3, x, y, printable(scene.label(f"{name}, {trace.seconds(tick):.1f} s")), palette.INK, 12, 7.0)


def draw_marks(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw a flag where the robot was when an action `mark` recorded a name."""
    for event in scene.trace.of_kind(EventKind.MARK):
        x, y = scene.trace.place(event.tick)
        canvas.symbol(x, y, FLAG, palette.AMBER)
        canvas.add_part(f"mark {scene.label(event.name)}", [(x, y)])
        yield Label(3, x, y, printable(event.name), palette.AMBER, 12, 10.0)


def draw_collisions(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw a star at each collision: at the contact point if it is known, otherwise at the robot."""
    for event in scene.trace.of_kind(EventKind.COLLISION_STARTED):
        x, y = event.data.get("x"), event.data.get("y")
        if not isinstance(x, int | float) or not isinstance(y, int | float):
            x, y = scene.trace.place(event.tick)
        canvas.symbol(float(x), float(y), _STAR, palette.RED)
        canvas.add_part(f"collision {scene.label(event.name)}", [(x, y)])
    yield from ()


def draw_violations(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw a cross at the tightest finding of each criterion that did not pass, if the finding has a position."""
    for verdict in scene.result.verdicts:
        finding = verdict.tightest
        if verdict.status is Status.PASS or finding is None or finding.place is None:
            continue
        x, y = finding.place
        canvas.disc(x, y, 10, (255, 255, 255, 215), palette.RED, 2.0, blocks_labels=True)
        canvas.symbol(x, y, _CROSS, palette.RED)
        canvas.add_part(f"violation {verdict.id}", [(x, y)])
        text = printable(f"{subject(verdict, finding)}: {comparison(finding)}")
        if len(text) > MAX_VIOLATION_CHARACTERS:
            text = f"{text[: MAX_VIOLATION_CHARACTERS - 1].rstrip()}…"
        yield Label(0, x, y, text, palette.PAGE, 12, 11.0, palette.RED)


def draw_places(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw a small diamond and the name of each place (named pose) of the world, except at goals."""
    goals = [goal.pose for robot in scene.per_robot for goal in robot.case.every_goal]
    goal_positions = {(round(pose.x, 3), round(pose.y, 3)) for pose in goals}
    for name, pose in sorted(scene.scenery.places.items()):
        if (round(pose.x, 3), round(pose.y, 3)) not in goal_positions and canvas.shows(pose.x, pose.y):
            canvas.symbol(pose.x, pose.y, SMALL_DIAMOND, palette.PLACE)
            canvas.add_part(f"place {name}", [(pose.x, pose.y)])
            yield Label(9, pose.x, pose.y, printable(name), palette.FAINT_INK, 11, 5.0, is_optional=True)
