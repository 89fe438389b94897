"""Page that shows a recorded drive and the run of its reconstructed scenario side by side, as one HTML file."""

from __future__ import annotations

import base64
import hashlib
import html
import io
from collections.abc import Iterator, Sequence

import numpy as np
from PIL import Image

from simscen.core.environment.occupancy_grid import OCCUPIED, UNKNOWN, OccupancyGrid
from simscen.core.geometry import Array
from simscen.reconstruction.drive.recorded_drive import RecordedDrive
from simscen.reconstruction.objects.found_object import FoundObject
from simscen.reconstruction.scenario.incidents import Incident
from simscen.reconstruction.verifying.comparison import Verification, common_times, distances_between

WALL, FLOOR, HIDDEN = (70, 74, 84), (250, 250, 250), (205, 208, 214)
"""Colors of occupied, free, and unknown cells."""
MAX_PATH_POINTS = 600
CHART_WIDTH, CHART_HEIGHT = 640.0, 140.0
STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; margin: 1.5rem; color: #1d2330; background: #fff; }
h1 { font-size: 1.4rem; } h2 { font-size: 1.1rem; }
table { border-collapse: collapse; } th, td { padding: .25rem .8rem; text-align: left; border-bottom: 1px solid #ccd; }
.pair { display: flex; flex-wrap: wrap; gap: 1rem; } .pair figure { flex: 1 1 320px; margin: 0; }
svg { width: 100%; max-height: 70vh; background: #f4f5f7; }
.path, .other, .object, .goal, .incident, .axis { fill: none; vector-effect: non-scaling-stroke; }
.path { stroke: #1668c7; stroke-width: 2; }
.other { stroke: #98a; stroke-width: 1; stroke-dasharray: 4 3; }
.object { stroke: #c2410c; stroke-width: 1.5; }
.goal { stroke: #15803d; stroke-width: 2; }
.incident { stroke: #b91c1c; stroke-width: 3; }
.axis { stroke: #889; }
.yes { color: #15803d; }
.no { color: #b91c1c; }
@media (prefers-color-scheme: dark) {
  body { color: #e4e6eb; background: #14171d; }
  svg { background: #20242c; }
  th, td { border-color: #345; }
}
"""


def verification_page(name: str, grid: OccupancyGrid, objects: Sequence[FoundObject], verified: Verification) -> str:
    """Return the page as HTML. It loads nothing from the network."""
    digest = base64.b64encode(hashlib.sha256(STYLE.encode()).digest()).decode()
    policy = f"default-src 'none'; img-src data:; style-src 'sha256-{digest}'; base-uri 'none'; form-action 'none'"
    parts = [
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
        f"<title>{_text(name)}: log and run</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>",
        f"<h1>{_text(name)}: the log and a run of its scenario</h1>",
        *_verdict(verified),
        *_table(verified),
        *_pair(grid, objects, verified),
        *_chart(verified),
        "</main>\n</body>\n</html>\n",
    ]
    return "\n".join(parts)


def _text(text: str) -> str:
    return html.escape(text)


def _verdict(verified: Verification) -> Iterator[str]:
    if not verified.incidents:
        yield "<p>The log has no incident.</p>"
    for incident in verified.incidents:
        yield f'<p class="{"yes" if incident.is_reproduced else "no"}">{_text(incident.sentence)}</p>'
    for new in verified.new_incidents:
        yield f'<p class="no">only in the run: {_text(new.kind)} at {new.time:.2f} s ({_text(new.detail)})</p>'
    failed = ", ".join(verified.failed)
    yield f"<p>{_text(f'Criteria that fail in the run: {failed}.' if failed else 'All criteria hold in the run.')}</p>"


def _table(verified: Verification) -> Iterator[str]:
    yield '<table>\n<tr><th scope="col">quantity</th><th scope="col">log</th><th scope="col">run</th>'
    yield '<th scope="col">difference</th></tr>'
    for row in verified.quantities:
        cells = "".join(f"<td>{_text(cell)}</td>" for cell in (row.log, row.run, row.difference))
        yield f'<tr><th scope="row">{_text(row.name)}</th>{cells}</tr>'
    yield "</table>"


def _pair(grid: OccupancyGrid, objects: Sequence[FoundObject], verified: Verification) -> Iterator[str]:
    yield '<div class="pair">'
    recorded = [incident.recorded for incident in verified.incidents]
    repeated = [incident.repeated for incident in verified.incidents if incident.repeated is not None]
    drives = verified.drive, verified.repeated
    image = _picture(grid)
    for title, drive, other, incidents in (
        ("log", *drives, recorded),
        ("run", *drives[::-1], [*repeated, *verified.new_incidents]),
    ):
        label = f"Path of the robot in the {title}, seen from above"
        drawn = _map(grid, image, drive, other, objects, incidents, label)
        yield f"<figure><figcaption><h2>{title}</h2></figcaption>{drawn}</figure>"
    yield "</div>"


def _map(
    grid: OccupancyGrid,
    image: str,
    drive: RecordedDrive,
    other: RecordedDrive,
    objects: Sequence[FoundObject],
    incidents: Sequence[Incident],
    label: str,
) -> str:
    """Return an SVG in map coordinates, with y upward."""
    height, width = (cells * grid.resolution for cells in grid.shape)
    x, y, _ = grid.origin
    shapes = [f'<image href="{image}" x="{x:.3f}" y="{-y - height:.3f}" width="{width:.3f}" height="{height:.3f}"/>']
    shapes.append(f'<polyline class="other" points="{_points(other.poses.values)}"/>')
    for thing in objects:
        shapes.append(_object(thing))
    shapes.append(f'<polyline class="path" points="{_points(drive.poses.values)}"/>')
    for goal in drive.goals:
        shapes.append(f'<circle class="goal" cx="{goal.pose.x:.3f}" cy="{-goal.pose.y:.3f}" r="0.15"/>')
    for incident in incidents:
        at_x, at_y = incident.place
        title = f"<title>{_text(f'{incident.kind} at {incident.time:.2f} s')}</title>"
        shapes.append(f'<circle class="incident" cx="{at_x:.3f}" cy="{-at_y:.3f}" r="0.25">{title}</circle>')
    box = f"{x:.3f} {-y - height:.3f} {width:.3f} {height:.3f}"
    return f'<svg role="img" aria-label="{_text(label)}" viewBox="{box}">{"".join(shapes)}</svg>'


def _object(thing: FoundObject) -> str:
    title = f"<title>{_text(thing.name)}</title>"
    if thing.is_moving:
        points = _points(np.array(thing.keyframes)[:, 1:3])
        return f'<polyline class="object" points="{points}">{title}</polyline>'
    _, x, y, yaw = thing.keyframes[0]
    if thing.is_cylinder:
        return f'<circle class="object" cx="{x:.3f}" cy="{-y:.3f}" r="{thing.size[0]:.3f}">{title}</circle>'
    length, width = thing.size
    turn = f"translate({x:.3f} {-y:.3f}) rotate({-np.degrees(yaw):.1f})"
    corner = f'x="{-length / 2:.3f}" y="{-width / 2:.3f}" width="{length:.3f}" height="{width:.3f}"'
    return f'<rect class="object" {corner} transform="{turn}">{title}</rect>'


def _points(poses: Array) -> str:
    step = max(1, len(poses) // MAX_PATH_POINTS)
    return " ".join(f"{x:.2f},{-y:.2f}" for x, y in poses[::step, :2].tolist())


def _picture(grid: OccupancyGrid) -> str:
    """Return the map as a data URL of a PNG."""
    colors = np.empty((*grid.shape, 3), dtype=np.uint8)
    colors[:] = FLOOR
    colors[grid.cells == OCCUPIED] = WALL
    colors[grid.cells == UNKNOWN] = HIDDEN
    out = io.BytesIO()
    Image.fromarray(colors[::-1]).save(out, "PNG")
    return f"data:image/png;base64,{base64.b64encode(out.getvalue()).decode()}"


def _chart(verified: Verification) -> Iterator[str]:
    """Yield a chart of the distance between both robots over time."""
    times = common_times(verified.drive, verified.repeated)
    if len(times) < 2:
        return
    apart = distances_between(verified.drive, verified.repeated, times)
    top = max(0.1, float(apart.max()))
    step = max(1, len(times) // MAX_PATH_POINTS)
    points = " ".join(
        f"{CHART_WIDTH * time / times[-1]:.1f},{CHART_HEIGHT * (1 - value / top):.1f}"
        for time, value in zip(times[::step].tolist(), apart[::step].tolist(), strict=True)
    )
    label = f"Distance between the robots over {times[-1]:.0f} s, at most {top:.2f} m"
    yield f"<h2>Distance between the robots at the same time</h2>\n<p>{_text(label)}</p>"
    yield f'<svg role="img" aria-label="{_text(label)}" viewBox="-4 -4 {CHART_WIDTH + 8:g} {CHART_HEIGHT + 8:g}">'
    yield f'<line class="axis" x1="0" y1="{CHART_HEIGHT:g}" x2="{CHART_WIDTH:g}" y2="{CHART_HEIGHT:g}"/>'
    yield f'<polyline class="path" points="{points}"/></svg>'
