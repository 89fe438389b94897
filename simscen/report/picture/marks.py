"""Everything on the map: ways, goals, places, objects, and where something went wrong."""

import math

import numpy as np

from simscen.core.events import EventKind
from simscen.core.geometry import Array, Pose2
from simscen.core.goalnames import named
from simscen.core.samples import Samples
from simscen.core.verdict import Status
from simscen.judge.wording import comparison, subject
from simscen.report.picture import palette
from simscen.report.picture.canvas import Canvas, Note, shown, text_size
from simscen.report.picture.outline import outlines, pose_of
from simscen.report.picture.scene import Scene

_STAR = [(r * math.cos(a), r * math.sin(a)) for k in range(16) for r, a in [((16, 7)[k % 2], k * math.pi / 8)]]
_CROSS = [(1.6, 0), (5.4, 3.8), (3.8, 5.4), (0, 1.6), (-3.8, 5.4), (-5.4, 3.8), (-1.6, 0)]
_CROSS += [(-5.4, -3.8), (-3.8, -5.4), (0, -1.6), (3.8, -5.4), (5.4, -3.8)]
_FLAG = [(0, 0), (0, -18), (12, -13), (1.5, -9), (1.5, 0)]
_DOT = 0.15 * np.column_stack((np.cos(np.arange(24) * np.pi / 12), np.sin(np.arange(24) * np.pi / 12)))
_GHOSTS = 6
_BANDS = 48


def draw_places(canvas: Canvas, scene: Scene) -> None:
    """Named places that are no goals: a small diamond and the name."""
    goals = [goal.pose for robot in scene.each for goal in robot.case.every_goal]
    taken = {(round(pose.x, 3), round(pose.y, 3)) for pose in goals}
    for name, pose in sorted(scene.places.items()):
        if (round(pose.x, 3), round(pose.y, 3)) in taken or not _visible(canvas, pose):
            continue
        canvas.sign(pose.x, pose.y, [(0, -4), (4, 0), (0, 4), (-4, 0)], palette.PLACE)
        u, v = canvas.pixel(pose.x, pose.y)
        canvas.note(Note(u + 8, v, shown(name), 11, palette.FAINT_INK, halo=palette.FREE))


def draw_plans(canvas: Canvas, scene: Scene) -> None:
    """All plans, faint; the newer the stronger."""
    plans = scene.trace.plans
    for k, plan in enumerate(plans):
        weight = 0.45 + 0.55 * (k + 1) / len(plans)
        colour = tuple(round(255 + weight * (part - 255)) for part in palette.PLAN)
        canvas.line(plan.points[:, :2], (colour[0], colour[1], colour[2]), 3.0)


def draw_objects(canvas: Canvas, scene: Scene) -> None:
    """Spawned and moving things: where they ended, their way, and ghosts on it in the colour of their time.

    A ghost has the colour that the robot's way has where the robot was at that moment.
    """
    shapes = outlines(scene.trace, scene.bodies)
    spawned = {event.name: pose_of(event) for event in scene.trace.of_kind(EventKind.OBJECT_SPAWNED)}
    for name in sorted(set(shapes) - set(scene.robots)):
        samples = scene.trace.objects.get(name)
        last = spawned.get(name)
        if samples is not None and len(samples):
            last = _pose(samples, -1)
            for k in _ghosts(samples):
                colour = palette.ramp(int(samples.ticks[k]) / max(scene.trace.end, 1))
                canvas.polygon(_pose(samples, k).apply(shapes[name]), (*colour, 36), colour, 1.0)
        if last is not None:
            canvas.polygon(last.apply(shapes[name]), (*palette.OBJECT, 150), palette.OBJECT)
            u, v = canvas.pixel(last.x, float(last.apply(shapes[name])[:, 1].max()))
            canvas.note(Note(u, v - 10, shown(name), 12, palette.OBJECT, "mm", halo=palette.FREE))


def draw_belief(canvas: Canvas, scene: Scene) -> None:
    """Where the robot thought it was."""
    canvas.dashes(_thinned(scene.trace.belief.values[:, :2], canvas), palette.BELIEF, 1.2, 4.0)


def draw_truth(canvas: Canvas, scene: Scene) -> None:
    """The driven way, coloured by time, with a dot and the time at round seconds."""
    truth, trace = scene.trace.truth, scene.trace
    if not len(truth):
        return
    edges = np.linspace(0, trace.end, _BANDS + 1)
    for k in range(_BANDS):
        first, last = np.searchsorted(truth.ticks, (edges[k], edges[k + 1]), side="left")
        points = truth.values[max(first - 1, 0) : last + 1, :2]
        canvas.line(_thinned(points, canvas), palette.ramp((k + 0.5) / _BANDS), 3.2)
    step = round_step(trace.seconds(trace.end))
    for number in range(1, int(trace.seconds(trace.end) / step) + 1):
        tick = round(number * step * trace.tick_rate)
        x, y = trace.place(tick)
        colour = palette.ramp(tick / max(trace.end, 1))
        canvas.disc(x, y, 3.6, palette.PAGE, colour, 1.6)


def draw_goals(canvas: Canvas, scene: Scene) -> None:
    """Each goal: its tolerance as a ring, its heading, its name."""
    names: dict[tuple[float, float], list[str]] = {}
    for goal in scene.case.every_goal:
        there = names.setdefault((goal.pose.x, goal.pose.y), [])
        if not any(named(goal.name, other) for other in there):  # the second loop comes to the same place
            there.append(goal.name)
    for goal in scene.case.every_goal:
        x, y, yaw = goal.pose
        reach = max(goal.xy_tolerance * canvas.scale, 5.0)
        canvas.disc(x, y, reach, (*palette.GOAL, 46), palette.GOAL, 1.8)
        tip = reach / canvas.scale + 10 / canvas.scale
        canvas.line(np.array([(x, y), (x + tip * math.cos(yaw), y + tip * math.sin(yaw))]), palette.GOAL, 2.2)
        canvas.disc(x, y, 2.6, palette.GOAL)
        if told := names.pop((x, y), None):
            u, v = canvas.pixel(x, y)
            canvas.note(
                Note(u, v - reach - 12, shown(scene.called(", ".join(told))), 14, palette.GOAL, "mm", halo=palette.FREE)
            )


def draw_robot(canvas: Canvas, scene: Scene) -> None:
    """The robot's hull where it began and where it ended."""
    if not len(scene.trace.truth):
        return
    first, last = (Pose2(*row) for row in scene.trace.truth.values[[0, -1]].tolist())
    hull = np.array(scene.case.footprint) if len(scene.case.footprint) > 2 else _DOT
    nose = np.array([(0.35, -0.4), (0.85, 0.0), (0.35, 0.4)]) * (float(hull[:, 0].max()), float(hull[:, 1].max()))
    for pose, colour, strength in ((first, palette.START, 40), (last, palette.ROBOT, 170)):
        canvas.polygon(pose.apply(hull), (*colour, strength), colour)
        canvas.polygon(pose.apply(nose), palette.PAGE if strength > 100 else colour)
    u, v = canvas.pixel(first.x, first.y)
    canvas.note(Note(u, v + 20, shown(scene.called("start")), 12, palette.START, "mm", halo=palette.FREE))


def draw_marks(canvas: Canvas, scene: Scene) -> None:
    """A flag with its name where the robot was when an event set a mark."""
    for event in scene.trace.of_kind(EventKind.MARK):
        x, y = scene.trace.place(event.tick)
        canvas.sign(x, y, _FLAG, palette.AMBER)
        u, v = canvas.pixel(x, y)
        canvas.note(Note(u + 14, v - 13, shown(event.name), 12, palette.AMBER, halo=palette.FREE))


def draw_collisions(canvas: Canvas, scene: Scene) -> None:
    """A star at every contact."""
    for event in scene.trace.of_kind(EventKind.COLLISION_STARTED):
        x, y = event.data.get("x"), event.data.get("y")
        if not isinstance(x, int | float) or not isinstance(y, int | float):
            x, y = scene.trace.place(event.tick)
        canvas.sign(float(x), float(y), _STAR, palette.RED)


def draw_violations(canvas: Canvas, scene: Scene) -> None:
    """A cross in a circle where each criterion failed, with what it says; labels give way to each other."""
    taken: list[tuple[float, float, float, float]] = []
    for verdict in scene.result.verdicts:
        finding = verdict.tightest
        if verdict.status is Status.PASS or finding is None or finding.place is None:
            continue
        x, y = finding.place
        canvas.disc(x, y, 10, (255, 255, 255, 215), palette.RED, 2.0)
        canvas.sign(x, y, _CROSS, palette.RED)
        text = _short(shown(f"{subject(verdict, finding)}: {comparison(finding)}"))
        u, v = _free_spot(canvas, canvas.pixel(x, y), text, taken)
        canvas.note(Note(u, v, text, 12, palette.PAGE, "lm", palette.RED))


def round_step(seconds: float) -> float:
    """A round number of seconds that divides a run into at most ten parts: 1, 2, 5, 10, …"""
    if seconds <= 0:
        return 1.0
    power = 10 ** math.floor(math.log10(seconds / 10)) if seconds > 10 else 1.0
    return next(power * factor for factor in (1, 2, 5, 10) if seconds / (power * factor) <= 10)


def _ghosts(samples: Samples) -> list[int]:
    """Samples evenly spread over the way of a thing, without the last; none of a thing that stood still."""
    steps = np.hypot(*np.diff(samples.values[:, :2], axis=0).T)
    way = np.concatenate(([0.0], np.cumsum(steps)))
    if way[-1] < 0.02:
        return []
    chosen = np.searchsorted(way, np.linspace(0, way[-1], _GHOSTS)[:-1], side="right") - 1
    return sorted(set(chosen.tolist()))


def _pose(samples: Samples, k: int) -> Pose2:
    return Pose2(*samples.values[k, :3].tolist())


def _thinned(points: Array, canvas: Canvas) -> Array:
    """Points at least a pixel apart, and the last one: more would only cost time."""
    if len(points) < 3:
        return points
    pixels = np.floor(points * canvas.scale)
    keep = np.concatenate(([True], np.any(np.diff(pixels, axis=0) != 0, axis=1)))
    keep[-1] = True
    kept: Array = points[keep]
    return kept


def _visible(canvas: Canvas, pose: Pose2) -> bool:
    u, v = canvas.pixel(pose.x, pose.y)
    return 0 <= u < canvas.width and 0 <= v < canvas.height


def _short(text: str, limit: int = 48) -> str:
    return text if len(text) <= limit else f"{text[: limit - 1]}…"


def _free_spot(
    canvas: Canvas, pixel: tuple[float, float], text: str, taken: list[tuple[float, float, float, float]]
) -> tuple[float, float]:
    """Where a label fits beside its mark: on the canvas and clear of the labels before it."""
    width, height = text_size(text, 12)
    u, v = pixel
    sides = [u + 18, u - 18 - width, u - width / 2]
    places = [(side, v + down) for down in (0, -24, 24, -48, 48, -72, 72, -96, 96) for side in sides]
    for wished_left, wished_middle in places:
        left = min(max(wished_left, 8.0), canvas.width - width - 8.0)
        middle = min(max(wished_middle, 14.0), canvas.height - 14.0)
        box = (left - 6, middle - height / 2 - 6, left + width + 6, middle + height / 2 + 6)
        over_mark = box[0] < u + 12 and box[2] > u - 12 and box[1] < v + 12 and box[3] > v - 12
        if not over_mark and not any(_overlap(box, other) for other in taken):
            taken.append(box)
            return left, middle
    return u + 18, v


def _overlap(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]
