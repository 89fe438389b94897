"""Where a robot was when something happened to it: faults, events, new goals, marks, collisions, violations."""

import math
from collections.abc import Iterator

import numpy as np

from simscen.core.records.events import EventKind
from simscen.core.records.verdict import Status
from simscen.judge.finding_text import comparison, subject
from simscen.report.picture import palette
from simscen.report.picture.canvas import Canvas, shown
from simscen.report.picture.labels import Label
from simscen.report.picture.scene import Scene
from simscen.report.picture.ways import driven

_STAR = [(r * math.cos(a), r * math.sin(a)) for k in range(16) for r, a in [((16, 7)[k % 2], k * math.pi / 8)]]
_CROSS = [(1.6, 0), (5.4, 3.8), (3.8, 5.4), (0, 1.6), (-3.8, 5.4), (-5.4, 3.8), (-1.6, 0)]
_CROSS += [(-5.4, -3.8), (-3.8, -5.4), (0, -1.6), (3.8, -5.4), (5.4, -3.8)]
_FLAG = [(0, 0), (0, -18), (12, -13), (1.5, -9), (1.5, 0)]
_BOLT = [(1, -10), (-6, 2), (-1, 2), (-2, 10), (6, -3), (1, -3)]
_DIAMOND = [(0, -6), (6, 0), (0, 6), (-6, 0)]


def draw_faulty(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """A broad band under the way where a fault was on."""
    for begun, ended, name in _faults(scene):
        for piece in driven(scene):
            on = (piece.ticks >= begun) & (piece.ticks <= ended)
            canvas.line(piece.values[on, :2], palette.FAULTY, 11.0)
            if on.any():
                canvas.tell(f"fault {scene.called(name)}", piece.values[on][[0, -1], :2])
    yield from ()


def draw_faults(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """A bolt where the robot was when a fault began, a gray one where it was when that was over."""
    trace = scene.trace
    for begun, ended, name in _faults(scene):
        ends = [(begun, f"{name} from", palette.AMBER), (ended, f"{name} over,", palette.FAINT_INK)]
        for tick, told, color in ends if ended < trace.end else ends[:1]:
            x, y = trace.place(tick)
            canvas.disc(x, y, 11, (255, 255, 255, 225), color, 1.4, busy=True)
            canvas.sign(x, y, _BOLT, color)
            text = shown(scene.called(f"{told} {trace.seconds(tick):.1f} s"))
            yield Label(2, x, y, text, palette.AMBER, 12, 12.0)


def _faults(scene: Scene) -> list[tuple[int, int, str]]:
    """When each fault began and ended, and its name."""
    ended = list(scene.trace.of_kind(EventKind.FAULT_ENDED))
    found = []
    for event in scene.trace.of_kind(EventKind.FAULT_STARTED):
        own = [end for end in ended if end.name == event.name and end.tick >= event.tick]
        found.append((event.tick, own[0].tick if own else scene.trace.end, event.name))
        if own:
            ended.remove(own[0])
    return found


def draw_events(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """A diamond where the robot was when an event of the scenario began, and where it got a new goal."""
    trace = scene.trace
    told = [(event.tick, event.name) for event in trace.of_kind(EventKind.EVENT_STARTED) if event.name]
    sent = {goal.name for goal in scene.case.sent}
    told += [(e.tick, f"new goal {e.name}") for e in trace.of_kind(EventKind.GOAL_ACCEPTED) if e.name in sent]
    for tick, name in told:
        x, y = trace.place(tick)
        canvas.sign(x, y, _DIAMOND, palette.INK)
        canvas.tell(f"event {scene.called(name)}", [(x, y)])
        yield Label(3, x, y, shown(scene.called(f"{name}, {trace.seconds(tick):.1f} s")), palette.INK, 12, 7.0)


def draw_marks(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """A flag with its name where the robot was when an event set a mark."""
    for event in scene.trace.of_kind(EventKind.MARK):
        x, y = scene.trace.place(event.tick)
        canvas.sign(x, y, _FLAG, palette.AMBER)
        canvas.tell(f"mark {scene.called(event.name)}", [(x, y)])
        yield Label(3, x, y, shown(event.name), palette.AMBER, 12, 10.0)


def draw_collisions(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """A star at every contact."""
    for event in scene.trace.of_kind(EventKind.COLLISION_STARTED):
        x, y = event.data.get("x"), event.data.get("y")
        if not isinstance(x, int | float) or not isinstance(y, int | float):
            x, y = scene.trace.place(event.tick)
        canvas.sign(float(x), float(y), _STAR, palette.RED)
        canvas.tell(f"collision {scene.called(event.name)}", [(x, y)])
    yield from ()


def draw_violations(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """A cross in a circle where each criterion failed, with what it says."""
    for verdict in scene.result.verdicts:
        finding = verdict.tightest
        if verdict.status is Status.PASS or finding is None or finding.place is None:
            continue
        x, y = finding.place
        canvas.disc(x, y, 10, (255, 255, 255, 215), palette.RED, 2.0, busy=True)
        canvas.sign(x, y, _CROSS, palette.RED)
        canvas.tell(f"violation {verdict.id}", [(x, y)])
        text = _short(shown(f"{subject(verdict, finding)}: {comparison(finding)}"))
        yield Label(0, x, y, text, palette.PAGE, 12, 11.0, palette.RED)


def draw_places(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Named places that are no goals: a small diamond and the name."""
    goals = [goal.pose for robot in scene.each for goal in robot.case.every_goal]
    taken = {(round(pose.x, 3), round(pose.y, 3)) for pose in goals}
    for name, pose in sorted(scene.scenery.places.items()):
        if (round(pose.x, 3), round(pose.y, 3)) not in taken and canvas.shows(pose.x, pose.y):
            canvas.sign(pose.x, pose.y, [(0, -4), (4, 0), (0, 4), (-4, 0)], palette.PLACE)
            canvas.tell(f"place {name}", np.array([(pose.x, pose.y)]))
            yield Label(9, pose.x, pose.y, shown(name), palette.FAINT_INK, 11, 5.0, spare=True)


def _short(text: str, limit: int = 60) -> str:
    """The beginning of a text; the whole of it is beside the map."""
    return text if len(text) <= limit else f"{text[: limit - 1].rstrip()}…"
