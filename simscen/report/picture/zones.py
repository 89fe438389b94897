"""What is about the floor: zones of costmap filters, slippery patches, ramps and sills."""

import math
from collections.abc import Iterator

import numpy as np

from simscen.core.environment.costmap_filters import MaskBlocks
from simscen.core.environment.scenery import DrivableSurface, FilterZone
from simscen.core.geometry import Array
from simscen.core.records.events import Event, EventKind
from simscen.report.picture import palette
from simscen.report.picture.canvas import Canvas, shown
from simscen.report.picture.labels import Label
from simscen.report.picture.scene import Scene

RANK = 6


def draw_ground(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Ramps, with chevrons that point uphill, sills and platforms, with how high they are."""
    for ground in scene.scenery.ground:
        outline = np.array(ground.outline)
        if len(outline) < 3:
            continue
        canvas.polygon(outline, (*palette.GROUND, 120), palette.GROUND)
        canvas.tell(f"ground {ground.name}", outline)
        _chevrons(canvas, ground, outline)
        x, y = outline.mean(axis=0).tolist()
        told = f"{ground.height:.2g} m" if ground.height >= 1 else f"{100 * ground.height:.2g} cm"
        named = shown(f"{ground.name}, {told} high" if ground.name else f"{told} high")
        yield Label(RANK, x, y, named, palette.FAINT_INK, 11, _reach(canvas, outline), spare=True)


def _chevrons(canvas: Canvas, ground: DrivableSurface, outline: Array) -> None:
    steep = math.hypot(*ground.uphill)
    if steep < 0.01:
        return
    up = np.array(ground.uphill) / steep
    across, middle = np.array((-up[1], up[0])), outline.mean(axis=0)
    length, width = np.ptp(outline @ up), np.ptp(outline @ across)
    size = min(width, length / 2) / 6
    for part in (-0.25, 0.05, 0.35):
        tip = middle + part * length * up
        canvas.line(np.array([tip - size * (up - across), tip, tip - size * (up + across)]), palette.FAINT_INK, 1.6)


def draw_floors(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Floor that holds wheels less, or more, than dry concrete; what was spilled says when."""
    for floor in scene.scenery.floors:
        yield from _floor(canvas, floor.region, np.array(floor.outline), f"friction {floor.friction:g}")
    for event in scene.each[0].trace.of_kind(EventKind.FLOOR_CHANGED):
        outline, friction = event.data.get("outline"), event.data.get("friction")
        assert isinstance(outline, list) and isinstance(friction, int | float)
        begun = f"friction {friction:g} from {scene.trace.seconds(event.tick):.1f} s"
        until = event.data.get("until")
        told = f"{begun} to {until:.1f} s" if isinstance(until, int | float) else begun
        yield from _floor(canvas, event.name, np.array(outline, dtype=np.float64), told)


def _floor(canvas: Canvas, name: str, outline: Array, told: str) -> Iterator[Label]:
    canvas.polygon(outline, (*palette.SLIPPERY, 40), palette.SLIPPERY, 1.0)
    canvas.tell(f"floor {name}: {told}", outline)
    x, y = outline.mean(axis=0).tolist()
    yield Label(RANK, x, y, shown(f"{name}: {told}"), palette.OBJECT, 11, _reach(canvas, outline), spare=True)


def draw_zones(canvas: Canvas, scene: Scene) -> Iterator[Label]:
    """Zones of the stack's filters: where not to go falls to the right in red, where to go slowly rises in amber."""
    for zone, told in _in_force(scene):
        outlines = [np.array(zone.outline)] if zone.outline else _blocks(zone)
        color = palette.RED if zone.filter == "keepout" else palette.AMBER
        canvas.hatch(outlines, (*color, 110), rising=zone.filter == "speed")
        if zone.outline:
            canvas.polygon(outlines[0], None, color, 1.2)
        for outline in outlines:
            canvas.tell(f"{zone.filter} zone {scene.called(told)}", outline)
        if outlines:
            x, y = outlines[0].mean(axis=0).tolist()
            yield Label(2, x, y, shown(scene.called(told)), color, 12, min(18.0, _reach(canvas, outlines[0])))


def _in_force(scene: Scene) -> Iterator[tuple[FilterZone, str]]:
    """Zones that were on at any time, each with what it says and when it does."""
    own = {(str(zone.filter), zone.region): zone for zone in scene.scenery.zones if zone.robot == scene.name}
    switched: dict[tuple[str, str], list[Event]] = {}
    for event in scene.trace.of_kind(EventKind.ZONE_SWITCHED):
        switched.setdefault((str(event.data["filter"]), event.name), []).append(event)
    for key in dict.fromkeys((*own, *switched)):
        zone = own.get(key) or _fresh(scene, key)
        if zone is not None:
            yield zone, _told(scene, zone, switched.get(key, []))


def _fresh(scene: Scene, key: tuple[str, str]) -> FilterZone | None:
    """A zone that the stack was told of on the way."""
    outline = scene.case.regions.get(key[1])
    return FilterZone("speed" if key[0] == "speed" else "keepout", key[1], outline) if outline else None


def _told(scene: Scene, zone: FilterZone, events: list[Event]) -> str:
    """What a zone is and when: "gate: keep out, on at 2.0 s", "ward: at most 0.25 m/s"."""
    limits = [zone.speed_limit, *(event.data.get("speed_limit") for event in events)]
    limit = next((value for value in reversed(limits) if isinstance(value, int | float) and value), 0.0)
    slow = f"at most {limit:g} m/s" if limit else "slow zone"
    what = "keep out" if zone.filter == "keepout" else slow
    changes = [f"{'on' if e.data['enabled'] else 'off'} at {scene.trace.seconds(e.tick):.1f} s" for e in events]
    return f"{zone.region}: {', '.join([what, *changes])}" if zone.region else ", ".join([f"{what} (mask)", *changes])


def _blocks(zone: FilterZone) -> list[Array]:
    """The cells of a mask that say something, as rectangles."""
    cells = zone.cells or MaskBlocks(1.0)
    wanted = [block for block in cells.blocks if block[4] == 100 or zone.filter == "speed"]
    boxes = [[(c, r), (c + w, r), (c + w, r + h), (c, r + h)] for c, r, w, h, _ in wanted]
    return [cells.origin.apply(np.array(box, dtype=np.float64) * cells.resolution) for box in boxes]


def _reach(canvas: Canvas, outline: Array) -> float:
    """Pixels from the middle of an outline to its nearer sides."""
    return float(np.ptp(outline, axis=0).min()) * canvas.scale / 2
