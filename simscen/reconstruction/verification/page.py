"""HTML page that shows a recorded drive and the run of the reconstructed scenario side by side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape

from simscen.reconstruction.objects.found_object import FoundObject
from simscen.reconstruction.static_world import StaticWorld
from simscen.reconstruction.verification.comparison import (
    Verification,
    common_times,
    distances_between,
    nearest_returns,
)
from simscen.reconstruction.verification.drawings import Series, box_around, chart, drive_map
from simscen.report.display_text import csp_hash

STYLE = """
:root { color-scheme: light dark; --ink: #1d2330; --quiet: #5b6475; --page: #fff; --map: #f4f5f7; --line: #ccd1da;
  --log: #1668c7; --run: #c2410c; --good: #15803d; --bad: #b91c1c; --object: #7c3aed; --new: #db2777; }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e4e6eb; --quiet: #a3abba; --page: #14171d; --map: #20242c; --line: #3a4250;
    --log: #6cb0ff; --run: #fb923c; --good: #4ade80; --bad: #f87171; --object: #b79bff; --new: #f472b6; }
}
body { font: 16px/1.5 system-ui, sans-serif; margin: 0 auto; padding: 1rem; max-width: 1400px; color: var(--ink);
  background: var(--page); }
h1 { font-size: 1.4rem; margin: 0 0 .5rem; } h2 { font-size: 1.15rem; margin: 1.5rem 0 .5rem; }
h3 { font-size: 1rem; margin: 0 0 .25rem; }
p { margin: .25rem 0; max-width: 60rem; }
.result { font-weight: 600; } .yes { color: var(--good); } .no { color: var(--bad); } .quiet { color: var(--quiet); }
.wide { overflow-x: auto; }
table { border-collapse: collapse; }
th, td { padding: .25rem .8rem .25rem 0; text-align: left; border-bottom: 1px solid var(--line); vertical-align: top; }
.pair { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 22rem), 1fr)); gap: 1rem; }
figure { margin: 0; min-width: 0; }
svg { width: 100%; max-height: 75vh; display: block; }
figure svg { background: var(--map); } image { image-rendering: pixelated; }
text { fill: var(--quiet); text-anchor: middle; font-family: system-ui, sans-serif; }
text.tick { text-anchor: end; }
text.goalname { fill: var(--good); } text.objectname { fill: var(--object); } text.incidentname { fill: var(--bad); }
.path, .other, .object, .goal, .incident, .axis { fill: none; vector-effect: non-scaling-stroke; }
.path { stroke-width: 2.5; } .other { stroke-width: 1.5; stroke-dasharray: 2 4; }
.gap { stroke: var(--ink); } .log { stroke: var(--log); } .run { stroke: var(--run); }
.mark { stroke: none; } .mark.log { fill: var(--log); } .mark.run { fill: var(--run); }
.object { stroke: var(--object); stroke-width: 1.5; } .object.start { fill: var(--object); }
.goal { stroke: var(--good); stroke-width: 2; } .incident { stroke: var(--bad); stroke-width: 3; }
.line.run { stroke-dasharray: 7 5; } .axis { stroke: var(--line); }
.legend { display: flex; flex-wrap: wrap; gap: .25rem 1.2rem; padding: 0; margin: .5rem 0; list-style: none; }
.legend svg { width: 1.8rem; height: .9rem; display: inline-block; vertical-align: -.1rem; margin-right: .3rem; }
.new { fill: var(--new); }
"""


def verification_page(name: str, world: StaticWorld, objects: Sequence[FoundObject], verification: Verification) -> str:
    """Return the HTML page, which loads nothing from the network.

    name:          name of the scenario
    world:         world with which the scans of the drive were compared
    objects:       objects and people in the scenario
    verification:  comparison of the recorded drive with the run
    """
    policy = f"default-src 'none'; img-src data:; style-src '{csp_hash(STYLE)}'; base-uri 'none'; form-action 'none'"
    parts = [
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">',
        f"<title>{escape(name)}: log and run</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<main>",
        f"<h1>{escape(name)}: the log and a run of its scenario</h1>",
        *_result(verification),
        *_maps(world, objects, verification),
        *_charts(verification),
        *_table(verification),
        "</main>\n</body>\n</html>\n",
    ]
    return "\n".join(parts)


def _result(verification: Verification) -> Iterator[str]:
    """Yield the statement whether the run reproduced the incidents, a list of incidents, and the failed criteria."""
    count = len(verification.incidents)
    repeated_count = sum(incident.is_reproduced for incident in verification.incidents)
    css_class = "yes" if repeated_count == count else "no"
    if not count:
        yield '<p class="result yes">The log has no incident that the run could repeat.</p>'
    elif count == 1:
        verb = "repeats" if repeated_count else "does not repeat"
        yield f'<p class="result {css_class}">The run {verb} the incident of the log.</p>'
    else:
        number = f"all {count}" if repeated_count == count else f"{repeated_count} of the {count}"
        yield f'<p class="result {css_class}">The run repeats {number} incidents of the log.</p>'
    if count or verification.new_incidents:
        yield "<ul>"
        for incident in verification.incidents:
            yield f'<li class="{"yes" if incident.is_reproduced else "no"}">{escape(incident.sentence)}</li>'
        for new in verification.new_incidents:
            yield f'<li class="no">only in the run: {escape(new.kind)} at {new.time:.2f} s ({escape(new.detail)})</li>'
        yield "</ul>"
    failed = ", ".join(verification.failed_criteria)
    yield f"<p>{escape(f'Criteria that fail in the run: {failed}.' if failed else 'All criteria hold in the run.')}</p>"


def _maps(world: StaticWorld, objects: Sequence[FoundObject], verification: Verification) -> Iterator[str]:
    """Yield the maps of the recorded drive and of the run, side by side."""
    recorded = [incident.recorded for incident in verification.incidents]
    repeated = [incident.repeated for incident in verification.incidents if incident.repeated is not None]
    drives = verification.recorded, verification.repeated
    box = box_around(drives, objects)
    yield "<h2>Path and what the lidar saw</h2>"
    yield f'<ul class="legend">{"".join(_legend(bool(objects), bool(recorded or verification.new_incidents)))}</ul>'
    yield '<div class="pair">'
    for title, css_class, drive, other_drive, incidents in (
        ("Log", "log", *drives, recorded),
        ("Run of the scenario", "run", *drives[::-1], [*repeated, *verification.new_incidents]),
    ):
        label = f"{title}: path of the robot, seen from above"
        svg = drive_map(label, css_class, drive, other_drive, objects, incidents, world, box)
        yield f"<figure><figcaption><h3>{title}</h3></figcaption>{svg}</figure>"
    yield "</div>"


def _legend(has_objects: bool, has_incidents: bool) -> Iterator[str]:
    line = '<line class="{}" x1="0" y1="6" x2="24" y2="6"/>'
    symbols = [
        (line.format("path log"), "path in the log"),
        (line.format("path run"), "path in the run"),
        ('<circle class="goal" cx="12" cy="6" r="5"/>', "goal"),
        ('<rect class="new" x="7" y="1" width="10" height="10"/>', "seen by the lidar, not on the map"),
    ]
    if has_objects:
        symbols.append((line.format("object"), "object or person in the scenario"))
    if has_incidents:
        symbols.append(('<circle class="incident" cx="12" cy="6" r="4"/>', "incident"))
    for symbol, meaning in symbols:
        yield f'<li><svg viewBox="0 0 24 12" aria-hidden="true">{symbol}</svg>{meaning}</li>'
    yield "<li>dots: position at that time; dotted: path of the other drive</li>"


def _charts(verification: Verification) -> Iterator[str]:
    """Yield a chart of the distance between the robots of log and run, and a chart of the smallest ranges of scans."""
    yield "<h2>Timing and clearance</h2>"
    yield '<div class="pair">'
    times = common_times(verification.recorded, verification.repeated)
    if len(times) > 1:
        distances = distances_between(verification.recorded, verification.repeated, times)
        maximum = f"{distances.max():.2f} m"
        label = f"Distance between the robot in the log and in the run at the same time, at most {maximum}"
        yield _figure(label, [Series("gap", times, distances)])
    drives = ("log", verification.recorded), ("run", verification.repeated)
    series = [
        Series(css_class, *returns) for css_class, drive in drives if (returns := nearest_returns(drive)) is not None
    ]
    if series:
        yield _figure("Smallest range of each scan, in the log and in the run (dashed)", series)
    yield "</div>"


def _figure(label: str, series: Sequence[Series]) -> str:
    return f"<figure><figcaption>{escape(label)}</figcaption>{chart(label, series, 'm')}</figure>"


def _table(verification: Verification) -> Iterator[str]:
    """Yield the table of compared quantities."""
    yield '<h2>Numbers</h2>\n<div class="wide" role="region" aria-label="Numbers" tabindex="0">'
    yield '<table>\n<tr><th scope="col">quantity</th><th scope="col">log</th><th scope="col">run</th>'
    yield '<th scope="col">difference</th></tr>'
    for row in verification.quantities:
        cells = "".join(f"<td>{escape(cell)}</td>" for cell in (row.log, row.run, row.difference))
        yield f'<tr><th scope="row">{escape(row.name)}</th>{cells}</tr>'
    yield "</table>\n</div>"
