"""The Kalman filters of filterpy, imported without scipy.stats, whose import takes half a second.

filterpy needs scipy.stats only for the likelihood of a measurement, which simscen does not use.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import Any

STATISTICS = "filterpy.stats"
"""Module of filterpy that imports scipy.stats."""


def _logpdf(*arguments: Any, **keywords: Any) -> Any:
    """Return the result of `filterpy.stats.logpdf`, which the first call imports."""
    return import_module(STATISTICS).logpdf(*arguments, **keywords)


def _import_filters() -> ModuleType:
    """Import filterpy.kalman with a substitute for `filterpy.stats` that imports the module when it is used."""
    if "filterpy" in sys.modules:
        return import_module("filterpy.kalman")
    substitute = ModuleType(STATISTICS)
    vars(substitute)["logpdf"] = _logpdf
    sys.modules[STATISTICS] = substitute
    try:
        return import_module("filterpy.kalman")
    finally:
        del sys.modules[STATISTICS]  # the next import of it imports the module itself
        vars(substitute)["__getattr__"] = lambda name: getattr(import_module(STATISTICS), name)


_filters = _import_filters()
KalmanFilter: Any = _filters.KalmanFilter
ExtendedKalmanFilter: Any = _filters.ExtendedKalmanFilter
