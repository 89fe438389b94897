"""How near people the robot was, for how long."""

import numpy as np

from simscen.core.case import Case
from simscen.core.trace import Trace
from simscen.criteria.persons import INTIMATE, PERSONAL, SOCIAL, person_gap
from simscen.criteria.signal_values import Unavailable
from simscen.judge.measure.way import Values

ZONES = {"intimate": (0.0, INTIMATE), "personal": (INTIMATE, PERSONAL), "social": (PERSONAL, SOCIAL)}
"""Metres from and to."""


def person_metrics(trace: Trace, case: Case) -> Values:
    """The least gap, and the shares of the run in Hall's zones; each sample lasts until the next."""
    names = ("min_person_distance", *(f"intrusion_{zone}" for zone in ZONES))
    try:
        gaps = person_gap(trace, case)
    except Unavailable as why:
        return dict.fromkeys(names, str(why))
    lasts = np.diff(np.append(trace.truth.ticks, trace.end))
    whole = max(int(lasts.sum()), 1)
    shares = [float(lasts[(low <= gaps) & (gaps < high)].sum()) / whole for low, high in ZONES.values()]
    nearest = float(gaps.min())
    least: float | str = nearest if np.isfinite(nearest) else "nobody was there at a sample of the truth"
    return dict(zip(names, (least, *shares), strict=True))
