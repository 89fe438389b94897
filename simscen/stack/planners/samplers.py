"""Where OMPL's planners look for ways: one search after the other, each where the last one did not find any."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from simscen.core.geometry import Array
from simscen.stack.planners.ends import Ends
from simscen.stack.planners.informed_set import InformedSet
from simscen.stack.planners.medial_axis import medial_axis_samples
from simscen.stack.planners.rates import Rates
from simscen.stack.planners.search import Motion, Problem

DENSITIES = (1, 2, 4, 8)
"""Samples to the meter of one search after the other, as multiples."""
CORRIDORS = (0.05, 0.15, 1.0)
"""How much longer than the coarse grid's shortest way a way in the corridor may be (ratio), one after the other."""
DEARER = 0.15
"""How much more a way may cost than the cheapest over blocks (ratio) to be looked at: these err by a few per cent."""
MOST_SAMPLES = 3000
"""Where there are more, those on the cheapest ways: BIT* takes some ten iterations for each."""
REACH, FAR_REACH = 1.8, 2.3
"""Meters between samples up to which a straight way is tried: where a way over blocks is among them, and elsewhere."""
ROOMY = 0.15
"""Meters beyond the robot's radius where a straight way from one sample to the next has room."""
Legs = Iterator[Problem]


def uniform(rates: Rates, ends: Ends, _: int) -> Iterator[Legs]:
    """Anywhere on the ground that a way joins with the start: once."""
    yield iter((_whole(rates, ends),))


def medial_axis(rates: Rates, ends: Ends, seed: int) -> Iterator[Legs]:
    """At samples on the medial axis and, thinly, in the open, where a way that costs little more than the cheapest can
    pass, and along that one, as blocks tell; if these do not suffice, in a corridor where there are too many for one
    search, and then anywhere, more and more of them.
    """
    whole, samples = _whole(rates, ends), medial_axis_samples(rates.costmap, ends.reachable, seed)
    yield iter((replace(whole, samples=_where_cheap(rates, ends, samples), reach=REACH),))
    if len(samples) > MOST_SAMPLES:
        yield from corridor(rates, ends, seed)
    for density in DENSITIES:
        samples = medial_axis_samples(rates.costmap, ends.reachable, seed, density)
        yield iter((replace(whole, samples=samples, reach=FAR_REACH / density),))


def _where_cheap(rates: Rates, ends: Ends, samples: Array) -> Array:
    """Those where a way that costs little more than the cheapest over blocks can pass, and points of that way."""
    informed = InformedSet(rates, ends.start, ends.goal, priced=True)
    informed.narrow(DEARER)
    held = samples[informed.holds(samples)]
    if len(held) > MOST_SAMPLES:
        held = held[np.argsort(informed.through(held), kind="stable")[:MOST_SAMPLES]]
    way = informed.way(rates.costmap, rates.inscribed + ROOMY)
    return np.vstack((held, way[np.isfinite(rates.at(way))]))


def corridor(rates: Rates, ends: Ends, _: int) -> Iterator[Legs]:
    """In the corridor of near-shortest ways over a coarse grid, a wider one each time; long ways leg by leg."""
    informed = InformedSet(rates, ends.start, ends.goal)
    for slack in CORRIDORS:
        yield _legs(rates, ends, informed, slack)


def _legs(rates: Rates, ends: Ends, informed: InformedSet, slack: float) -> Legs:
    stops = informed.stops(rates.costmap) if slack < 1.0 else []
    here, before = ends.start, 0.0
    for stop, along in [*stops, (ends.goal, np.inf)]:
        informed.narrow(slack, (before, along))
        yield Problem(here, stop, informed.bounds(), _confined(rates.between, informed))
        here, before = stop, along


def _confined(motion: Motion, informed: InformedSet) -> Motion:
    has = informed.has

    def within(ax: float, ay: float, bx: float, by: float) -> float:
        inside = has(0.5 * (ax + bx), 0.5 * (ay + by)) and has(bx, by) and has(ax, ay)
        return motion(ax, ay, bx, by) if inside else np.inf

    return within


def _whole(rates: Rates, ends: Ends) -> Problem:
    """All ground around what can be reached."""
    rows, columns = np.flatnonzero(ends.reachable.any(axis=1)), np.flatnonzero(ends.reachable.any(axis=0))
    (x, y), size = rates.origin, rates.resolution
    bounds = (
        float(x + columns[0] * size),
        float(y + rows[0] * size),
        float(x + (columns[-1] + 1) * size),
        float(y + (rows[-1] + 1) * size),
    )
    return Problem(ends.start, ends.goal, bounds, rates.between)


SAMPLERS = {"uniform": uniform, "medial_axis": medial_axis, "corridor": corridor}
