"""Colours of a picture of a run. Distinct in grey and for the colour-blind: the path by lightness, failure by shape."""

import numpy as np

from simscen.core.result import Outcome
from simscen.core.verdict import Status
from simscen.report.picture.canvas import Colour

PAGE: Colour = (255, 255, 255)
FREE: Colour = (250, 249, 246)
UNKNOWN: Colour = (226, 223, 216)
WALL: Colour = (58, 63, 71)
INK: Colour = (38, 42, 48)
FAINT_INK: Colour = (121, 126, 134)
RULE: Colour = (222, 224, 227)
BELIEF: Colour = (20, 20, 24)
PLAN: Colour = (176, 203, 232)
PLACE: Colour = (150, 154, 162)
GOAL: Colour = (26, 110, 62)
START: Colour = (96, 102, 110)
ROBOT: Colour = (30, 34, 40)
OBJECT: Colour = (20, 130, 150)
RED: Colour = (200, 30, 40)
AMBER: Colour = (190, 120, 0)
GREEN: Colour = (28, 128, 66)
GREY: Colour = (110, 115, 122)

OUTCOMES = {Outcome.PASSED: GREEN, Outcome.FAILED: RED, Outcome.ERROR: AMBER, Outcome.FAILED_AS_EXPECTED: AMBER}
STATUSES = {Status.PASS: GREEN, Status.FAIL: RED, Status.INCONCLUSIVE: AMBER, Status.ERROR: AMBER}

_STOPS = np.array([(40, 60, 160), (110, 40, 170), (185, 40, 130), (225, 85, 75), (240, 150, 30)], dtype=np.float64)


def ramp(share: float) -> Colour:
    """The colour of a share 0 … 1 of the run's time, from deep blue over purple to orange."""
    at = min(max(share, 0.0), 1.0) * (len(_STOPS) - 1)
    r, g, b = (np.interp(at, np.arange(len(_STOPS)), _STOPS[:, channel]) for channel in range(3))
    return round(float(r)), round(float(g)), round(float(b))
