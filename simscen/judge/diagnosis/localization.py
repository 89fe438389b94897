"""Why a robot is not where it believes to be."""

import math

import numpy as np

from simscen.core.records.events import EventKind
from simscen.core.records.trace import Trace

ODOMETRY_FAULTS = frozenset({"bias", "slip", "scale", "drift", "noise"})
"""Faults whose error stays in the odometry when they are over."""
WHEELS, BELIEF = frozenset({"Odometry", "Wheels"}), "Belief"
"""What such faults affect, and those that come between the localizer and the navigator."""
LOST_DISTANCE_M = 0.5
"""Meters between belief and truth from which a robot is lost: two radii of a small one."""


def diagnose_localization(trace: Trace, tick: int, known: bool = False) -> tuple[list[str], set[str]]:
    """How far off it was, if far and not `known`; how that came about; and which events and faults did it."""
    off = _off(trace, tick)
    if not off >= LOST_DISTANCE_M:  # nan, too: not known
        return [], set()
    lines = [] if known else [f"it believed itself {off:.2f} m from where it was"]
    named: set[str] = set()
    doing = ""
    for event in trace.events:
        if event.tick > tick:
            continue
        if event.kind == EventKind.EVENT_STARTED:
            doing = event.name
        elif event.kind == EventKind.EVENT_ENDED:
            doing = ""
        elif event.kind == EventKind.ROBOT_PLACED:
            ago = trace.seconds(tick - event.tick)
            lines.append(f"event `{doing}` had set it down elsewhere {ago:.2f} s before")
            named.add(doing)
        elif event.kind == EventKind.FAULT_TOOK_EFFECT and (what := _falsified(trace, event.name)):
            lines.append(f"{event.name} falsified {what} from t = {trace.seconds(event.tick):.2f} s on")
            named.add(event.name)
    return lines, named


def _off(trace: Trace, tick: int) -> float:
    if not len(trace.belief) or not len(trace.truth):
        return math.nan
    bx, by = trace.belief.at(np.array([tick]))[0, :2].tolist()
    x, y = trace.place(tick)
    return float(np.hypot(bx - x, by - y))


def _falsified(trace: Trace, label: str) -> str:
    """Which of its ideas of where it is a fault falsified; "" for none."""
    starts = [event.data for event in trace.of_kind(EventKind.FAULT_STARTED) if event.name == label]
    if not starts:
        return ""
    affects = starts[0].get("affects", "Odometry")  # logs from before lidars had a bias do not say
    if affects == BELIEF:
        return "its belief"
    return "its odometry" if affects in WHEELS and starts[0].get("fault") in ODOMETRY_FAULTS else ""
