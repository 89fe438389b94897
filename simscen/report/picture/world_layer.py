"""World on the picture of a run: ramps, floors, zones of costmap filters, objects, doors, and pedestrians.

Each function `draw_…` draws one layer on the canvas, and yields its labels. A layer without labels ends with
`yield from ()`, so that the function is a generator.
"""

import math
from collections.abc import Iterator

import numpy as np

from simscen.core.environment.costmap_filters import MaskBlocks
from simscen.core.environment.scenery import DrivableSurface, FilterZone, MovableObject
from simscen.core.geometry import Array, Pose2
from simscen.core.records.event_shapes import polygon_from_data, spawn_pose
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Samples
from simscen.report.picture import palette
from simscen.report.picture.canvas import Canvas, printable
from simscen.report.picture.labels import Label
from simscen.report.picture.object_outlines import Outlines, object_outlines
from simscen.report.picture.path_layer import split_at_jumps
from simscen.report.picture.scene import Scene

LABEL_RANK = 6
"""Rank of the labels of ramps and floors. These labels are placed after the labels of robots, goals, and objects."""


def draw_ground(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw ramps, sills, and platforms with their heights. Ramps have chevrons that point uphill."""
    for ground in scene.scenery.ground:
        outline = np.array(ground.outline)
        if len(outline) < 3:
            continue
        canvas.polygon(outline, (*palette.GROUND, 120), palette.GROUND)
        canvas.add_part(f"ground {ground.name}", outline)
        _draw_chevrons(canvas, ground, outline)
        x, y = outline.mean(axis=0).tolist()
        height = f"{ground.height:.2g} m" if ground.height >= 0.995 else f"{100 * ground.height:.2g} cm"
        text = printable(f"{ground.name}, {height} high" if ground.name else f"{height} high")
        yield Label(LABEL_RANK, x, y, text, palette.FAINT_INK, 11, _label_distance(canvas, outline), is_optional=True)


def _draw_chevrons(canvas: Canvas, ground: DrivableSurface, outline: Array) -> None:
    """Draw three arrowheads that point uphill. Draw nothing on a level surface."""
    slope = math.hypot(*ground.uphill)
    if slope < 0.01:
        return
    up = np.array(ground.uphill) / slope
    across, middle = np.array((-up[1], up[0])), outline.mean(axis=0)
    length, width = np.ptp(outline @ up), np.ptp(outline @ across)
    size = min(width, length / 2) / 6
    for position in (-0.25, 0.05, 0.35):
        tip = middle + position * length * up
        canvas.line(np.array([tip - size * (up - across), tip, tip - size * (up + across)]), palette.FAINT_INK, 1.6)


def draw_floors(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw floors whose friction differs from dry concrete. Labels show when the friction changed during the run."""
    for floor in scene.scenery.floors:
        yield from _draw_floor(canvas, floor.region, np.array(floor.outline), f"friction {floor.friction:g}")
    for event in scene.per_robot[0].trace.of_kind(EventKind.FLOOR_CHANGED):
        outline, friction = polygon_from_data(event.data.get("outline")), event.data.get("friction")
        if not outline or not isinstance(friction, int | float):
            continue
        text = f"friction {friction:g} from {scene.trace.seconds(event.tick):.1f} s"
        until = event.data.get("until")
        text += f" to {until:.1f} s" if isinstance(until, int | float) else ""
        yield from _draw_floor(canvas, event.name, np.array(outline), text)


def _draw_floor(canvas: Canvas, name: str, outline: Array, text: str) -> Iterator[Label]:
    canvas.polygon(outline, (*palette.SLIPPERY, 40), palette.SLIPPERY, 1.0)
    canvas.add_part(f"floor {name}: {text}", outline)
    x, y = outline.mean(axis=0).tolist()
    rim = _label_distance(canvas, outline)
    yield Label(LABEL_RANK, x, y, printable(f"{name}: {text}"), palette.OBJECT, 11, rim, is_optional=True)


def draw_zones(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw the zones of costmap filters: keepout zones with red hatching, speed zones with amber hatching."""
    for zone, text in _active_zones(scene):
        outlines = [np.array(zone.outline)] if zone.outline else _mask_outlines(zone)
        color = palette.RED if zone.filter == "keepout" else palette.AMBER
        canvas.hatch(outlines, (*color, 110), rising=zone.filter == "speed")
        if zone.outline:
            canvas.polygon(outlines[0], None, color, 1.2)
        for outline in outlines:
            canvas.add_part(f"{zone.filter} zone {scene.label(text)}", outline)
        if outlines:
            x, y = outlines[0].mean(axis=0).tolist()
            rim = min(18.0, _label_distance(canvas, outlines[0]))
            yield Label(2, x, y, printable(scene.label(text)), color, 12, rim)


def _active_zones(scene: Scene) -> Iterator[tuple[FilterZone, str]]:
    """Yield (zone, text of the label) for each zone of the robot that was enabled at any time."""
    initial = {(str(zone.filter), zone.region): zone for zone in scene.scenery.zones if zone.robot == scene.robot_name}
    switched: dict[tuple[str, str], list[Event]] = {}
    for event in scene.trace.of_kind(EventKind.ZONE_SWITCHED):
        switched.setdefault((str(event.data.get("filter")), event.name), []).append(event)
    for key in dict.fromkeys((*initial, *switched)):
        zone = initial.get(key)
        if zone is None and (outline := scene.case.regions.get(key[1])):  # a zone that was added during the run
            zone = FilterZone("speed" if key[0] == "speed" else "keepout", key[1], outline)
        if zone is not None:
            yield zone, _zone_text(scene, zone, switched.get(key, []))


def _zone_text(scene: Scene, zone: FilterZone, events: list[Event]) -> str:
    """Return the text of a label, for example "gate: keep out, on at 2.0 s" or "ward: at most 0.25 m/s".

    `events` are the events that enabled or disabled the zone.
    """
    limits = [zone.speed_limit, *(event.data.get("speed_limit") for event in events)]
    limit = next((value for value in reversed(limits) if isinstance(value, int | float) and value), 0.0)
    slow = f"at most {limit:g} m/s" if limit else "slow zone"
    rule = "keep out" if zone.filter == "keepout" else slow
    changes = [f"{'on' if e.data.get('enabled') else 'off'} at {scene.trace.seconds(e.tick):.1f} s" for e in events]
    return f"{zone.region}: {', '.join([rule, *changes])}" if zone.region else ", ".join([f"{rule} (mask)", *changes])


def _mask_outlines(zone: FilterZone) -> list[Array]:
    """Return the blocks of a filter mask that restrict the robot, as rectangles (4, 2) in m."""
    cells = zone.cells or MaskBlocks(1.0)
    restricted = [block for block in cells.blocks if block[4] == 100 or zone.filter == "speed"]
    boxes = [[(c, r), (c + w, r), (c + w, r + h), (c, r + h)] for c, r, w, h, _ in restricted]
    return [cells.origin.apply(np.array(box, dtype=np.float64) * cells.resolution) for box in boxes]


def _label_distance(canvas: Canvas, outline: Array) -> float:
    """Return the distance of a label from the center of an outline in pixels: half of the outline's shorter side."""
    return float(np.ptp(outline, axis=0).min()) * canvas.scale / 2


_EARLIER_POSE_COUNT = 6
"""Maximum number of earlier poses at which a moving object is drawn."""
_MIN_MOTION_M = 0.02
"""Motion of an object above which its path and earlier poses are drawn. A rotation counts as 0.3 m per rad."""


def draw_objects(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Draw each object at its last pose, with its path and earlier poses colored by time.

    Removed objects are drawn without a fill.
    """
    trace = scene.trace
    shapes = object_outlines(trace, scene.scenery.things)
    spawned = {event.name: event for event in trace.of_kind(EventKind.OBJECT_SPAWNED)}
    removed: dict[str, int] = {}
    for event in trace.of_kind(EventKind.OBJECT_SPAWNED, EventKind.OBJECT_REMOVED):
        if event.kind == EventKind.OBJECT_REMOVED:
            removed[event.name] = event.tick
        else:  # an object that replaces another one is spawned at the tick of the removal
            removed.pop(event.name, None)
    doors = {each.name: each for each in scene.scenery.things if each.closed and each.opened}
    for name in sorted(set(shapes) - set(scene.robots)):
        samples, spawn = trace.objects.get(name), spawned.get(name)
        is_person = spawn is not None and spawn.data.get("person") is True
        kind = "person" if is_person else "door" if name in doors else "object"
        color = palette.PEDESTRIAN if is_person else palette.OBJECT
        if samples is not None:
            _draw_object_path(canvas, scene, samples, shapes[name])
        if name in doors:
            _draw_door_positions(canvas, doors[name], shapes[name])
        if samples is not None and len(samples):
            last = _pose(samples, -1)
        elif spawn is not None:
            last = spawn_pose(spawn)
        else:
            continue
        is_removed = name in removed
        outlines = [last.apply(outline) for outline in shapes[name]]
        for outline in outlines:
            fill, width = (None, 1.0) if is_removed else ((*color, 150), 1.5)
            canvas.polygon(outline, fill, color, width, blocks_labels=not is_removed)
            canvas.add_part(f"{kind} {name}{' removed' if is_removed else ''}", outline)
        if is_person:
            radius = float(np.hypot(*(outlines[0] - (last.x, last.y)).T).max())
            canvas.line(last.apply(np.array([(0.0, 0.0), (1.5 * radius, 0.0)])), palette.PEDESTRIAN, 2.0)
        corners = np.concatenate(outlines)
        x, y = ((corners.min(axis=0) + corners.max(axis=0)) / 2).tolist()
        text = f"{name} (removed at {trace.seconds(removed[name]):.1f} s)" if is_removed else name
        rim = float(np.ptp(corners, axis=0).min()) * canvas.scale / 2 + 2
        yield Label(4, x, y, printable(text), color, 12, min(rim, 40.0))


def _draw_object_path(canvas: Canvas, scene: Scene, samples: Samples, shape: Outlines) -> None:
    for segment in split_at_jumps(samples, scene.trace.tick_rate):
        if np.ptp(segment.values[:, :2], axis=0).max() > _MIN_MOTION_M:
            canvas.dashes(segment.values[:, :2], palette.PLACE, 1.0, 2.5)
    for k in _earlier_poses(samples):
        color = palette.time_color(int(samples.ticks[k]) / max(scene.trace.end, 1))
        for outline in shape:
            canvas.polygon(_pose(samples, k).apply(outline), (*color, 30), color, 0.8)


def _draw_door_positions(canvas: Canvas, door: MovableObject, shape: Outlines) -> None:
    for end in (door.closed, door.opened):
        for corners in () if end is None else map(end.apply, shape):
            canvas.dashes(np.vstack((corners, corners[:1])), palette.OBJECT, 0.8, 3.0)
    if door.closed is not None:
        canvas.disc(door.closed.x, door.closed.y, 2.6, palette.OBJECT)


def _earlier_poses(samples: Samples) -> list[int]:
    """Return the indices of samples at equal distances along the path of an object, without the end of the path.

    Return [] for an object that did not move.
    """
    steps = np.diff(samples.values[:, :3], axis=0)
    distances = np.hypot(steps[:, 0], steps[:, 1]) + 0.3 * np.abs(np.angle(np.exp(1j * steps[:, 2])))
    lengths = np.concatenate(([0.0], np.cumsum(distances)))
    if lengths[-1] < _MIN_MOTION_M:
        return []
    indices = np.searchsorted(lengths, np.linspace(0, lengths[-1], _EARLIER_POSE_COUNT)[:-1], side="right") - 1
    return sorted(set(indices.tolist()))


def _pose(samples: Samples, k: int) -> Pose2:
    return Pose2(*samples.values[k, :3].tolist())
