"""The Kalman filters of filterpy, imported without scipy.stats, whose import takes half a second.

filterpy needs scipy.stats only for the likelihood of a measurement, which simscen does not use.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import Any

STATISTICS_MODULE = "filterpy.stats"
"""Module of filterpy that imports scipy.stats."""


def _logpdf(*arguments: Any, **keywords: Any) -> Any:
    """Return the result of `filterpy.stats.logpdf`. The first call imports this function."""
    return import_module(STATISTICS_MODULE).logpdf(*arguments, **keywords)


def _import_filters() -> ModuleType:
    """Import filterpy.kalman with a substitute for `filterpy.stats`, which imports the real module when it is used."""
    if "filterpy" in sys.modules:
        return import_module("filterpy.kalman")
    substitute = ModuleType(STATISTICS_MODULE)
    vars(substitute)["logpdf"] = _logpdf
    sys.modules[STATISTICS_MODULE] = substitute
    try:
        return import_module("filterpy.kalman")
    finally:
        # Later imports of `filterpy.stats` get the real module. filterpy.kalman keeps the substitute.
        del sys.modules[STATISTICS_MODULE]
        vars(substitute)["__getattr__"] = lambda name: getattr(import_module(STATISTICS_MODULE), name)


_filters = _import_filters()
KalmanFilter: Any = _filters.KalmanFilter
ExtendedKalmanFilter: Any = _filters.ExtendedKalmanFilter
