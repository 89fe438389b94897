"""All that a page shows of one robot: where it was and thought it was, what it saw, what it was after."""

from typing import Any

import numpy as np

from simscen.core.records.case import Case
from simscen.core.records.trace import Samples, Trace
from simscen.core.records.verdict import Verdict
from simscen.model.scenario import ScenarioSpec
from simscen.record.replay import Log
from simscen.report.replay.columns import Columns
from simscen.report.replay.lines import Lines
from simscen.report.replay.sensed import costmaps_of, grid_of, local_plans_of, particles_of, plans_of, scans_of
from simscen.report.replay.strips import limits_of, strips_of
from simscen.report.replay.thin import evenly, paced
from simscen.report.text import one_line

POSES = 12_000
"""Poses of a robot: five minutes at 40 Hz."""
MILLIMETER, MILLIRADIAN = 1e-3, 1e-3


def robot_of(
    name: str, log: Log, lines: Lines, spec: ScenarioSpec | None, verdicts: tuple[Verdict, ...], columns: Columns
) -> dict[str, Any]:
    """One robot; `name` is "" for the only one."""
    trace, case = log.trace, log.about.case
    return {
        "name": one_line(name),
        "footprint": [[round(x, 4), round(y, 4)] for x, y in case.footprint],
        "start": [round(part, 4) for part in case.start],
        "goals": _goals(case, lines),
        "truth": _poses(trace.truth, columns),
        "belief": _belief(trace.belief, columns),
        "map": None if log.about.map is None else grid_of(log.about.map, columns),
        "scans": scans_of(log.seen, columns),
        "particles": particles_of(log.seen, columns),
        "plans": plans_of(trace.plans, columns),
        "local": local_plans_of(log.seen, columns),
        "costmaps": costmaps_of(log.seen, trace, columns),
        "clock": columns.add(trace.truth.ticks),
        "strips": strips_of(trace, case, spec, columns),
        "limits": limits_of(verdicts, name),
    }


def _goals(case: Case, lines: Lines) -> list[dict[str, Any]]:
    """Each goal once: a further loop comes to the same place."""
    found: dict[tuple[str, float, float], dict[str, Any]] = {}
    for goal in case.every_goal:
        base = goal.name.partition("#")[0] if goal.name.partition("#")[0] in lines.goals else goal.name
        found.setdefault(
            (base, goal.pose.x, goal.pose.y),
            {
                "name": one_line(base),
                "pose": [round(part, 4) for part in goal.pose],
                "xy": round(goal.xy_tolerance, 4),
                "yaw": round(min(goal.yaw_tolerance, np.pi), 4),
                "via": goal.via,
                "line": lines.goals.get(base, 0),
            },
        )
    return list(found.values())


def _poses(samples: Samples, columns: Columns) -> dict[str, Any]:
    kept = evenly(len(samples), POSES)
    columns.thinned("poses", len(kept), len(samples))
    x, y, yaw = samples.values[kept, :3].T
    return {
        "ticks": columns.add(samples.ticks[kept]),
        "x": columns.add(x, MILLIMETER),
        "y": columns.add(y, MILLIMETER),
        "yaw": columns.add(np.unwrap(yaw) if np.isfinite(yaw).all() else yaw, MILLIRADIAN),
    }


def _belief(samples: Samples, columns: Columns) -> dict[str, Any] | None:
    if not len(samples):
        return None
    kept = evenly(len(samples), POSES)
    xx, xy, _, yy, _, aa = samples.values[kept, 3:9].T
    more = {"xx": (xx, 1e-5), "xy": (xy, 1e-5), "yy": (yy, 1e-5), "aa": (aa, 1e-5)}
    return {**_poses(samples, columns), **{key: columns.add(part, step) for key, (part, step) in more.items()}}


def things_of(trace: Trace, columns: Columns, besides: frozenset[str]) -> list[dict[str, Any]]:
    """Things that move, by name; their poses at most twenty times a second."""
    found = []
    for name, samples in sorted(trace.objects.items()):
        if name in besides or not len(samples):
            continue
        kept = paced(samples.ticks, max(1, trace.tick_rate // 20))
        found.append({"name": one_line(name), **_poses(Samples(samples.ticks[kept], samples.values[kept]), columns)})
    return found
