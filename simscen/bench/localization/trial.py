"""One log through one localizer: was the robot tracked, was it found, and how sure was it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simscen.bench.localization.generated_logs import KIDNAPPED_AT, Log
from simscen.bench.localization.recorded_drive import errors_of, localize
from simscen.core.geometry import Array
from simscen.core.records.trace import Trace
from simscen.core.statistics import chi2_quantile, nees_mean_bounds
from simscen.criteria.trace_signals.ground_truth import DIMENSIONS, nees_samples
from simscen.criteria.trace_signals.ground_truth import nees as squared_errors
from simscen.model.localizers import Localizer
from simscen.model.stack import StackSpec
from simscen.record.localization_logs.rows import TICK_RATE_HZ
from simscen.stack.protocols import RobotModel, Surroundings

LOST, FOUND = 1.0, 0.5
"""m off from which on a robot is lost, and within which it is found."""
MOMENTS = (15.0, 30.0, 45.0, 60.0, 75.0)
"""Seconds of a log at which the squared error is compared with the covariance."""
ROBOT = RobotModel(((0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2)), None, 0.6, 0.3, 0.0, 1.0, 1.0, 1.0, 2.0)


@dataclass(frozen=True)
class Trial:
    """How a log went: errors in m, times in s; `found` is None for a robot that was not found for good.

    `tracked`: never LOST. `nees` are the normalized squared errors at MOMENTS. `ms` is the processor's time a scan,
    `slowest_ms` that of the scan that took longest.
    """

    building: int
    number: int
    circumstance: str
    tracked: bool
    median: float
    largest: float
    found: float | None
    nees: tuple[float, ...]
    ms: float
    slowest_ms: float


def trial(log: Log, localizer: Localizer, seed: int) -> Trial:
    """Run a log through a localizer; the same arguments give the same figures, but for the processor's time."""
    spec = StackSpec(localizer=localizer)
    localized = localize(log.sensed, spec, Surroundings(ROBOT, log.map, TICK_RATE_HZ), log.estimate, seed)
    errors = errors_of(localized, log.sensed, LOST)
    assert errors is not None  # a made log has a reference from its first reading to its last
    truth = log.sensed.truth
    rows = np.searchsorted(localized.times, MOMENTS)
    off = localized.poses[rows] - truth[rows]
    off[:, 2] = (off[:, 2] + np.pi) % (2 * np.pi) - np.pi
    since = KIDNAPPED_AT if log.circumstance == "kidnapped" else 0.0
    return Trial(
        building=log.building, number=log.number, circumstance=log.circumstance,
        tracked=not errors.lost,
        median=float(np.median(errors.distance)), largest=float(errors.distance.max()),
        found=_found(errors.times - since, errors.distance),
        nees=tuple(nees(error, covariance) for error, covariance in zip(off, localized.covariances[rows], strict=True)),
        ms=localized.cpu * 1e3 / localized.scans, slowest_ms=localized.slowest * 1e3,
    )  # fmt: skip


def _found(times: np.ndarray, distance: np.ndarray) -> float | None:
    """When the robot was within FOUND after it had been LOST for the last time."""
    last = np.flatnonzero((distance > LOST) & (times >= 0))
    begin = int(last[-1]) + 1 if len(last) else int(np.searchsorted(times, 0.0))
    near = np.flatnonzero(distance[begin:] < FOUND)
    return max(0.0, float(times[begin + near[0]])) if len(near) else None


FEWEST = 3
"""Buildings from which on they say how much they differ."""


def nees(error: Array, covariance: Array) -> float:
    """e' P^-1 e of an error (3,) in m, m, rad with covariance P (3, 3); inf where P is singular."""
    return float(squared_errors(error[np.newaxis], covariance[np.triu_indices(3)][np.newaxis])[0])


def nees_at(trace: Trace, seconds: float) -> float | None:
    """The belief's NEES at a time of a run; None before the first belief and after the end."""
    samples, tick = nees_samples(trace), round(seconds * trace.tick_rate)
    if not len(samples) or tick < samples.ticks[0] or tick > trace.end:
        return None
    return float(samples.at(np.array([tick]))[0, 0])


def anees(values: Sequence[float]) -> float:
    """The average of one NEES from each run, 3 for a consistent localizer in the plane."""
    return float(np.mean(values))


def within_bounds(values: Sequence[float], dimensions: int = DIMENSIONS, probability: float = 0.95) -> float:
    """The share of NEES of errors that lie in the ellipsoid in which normal ones do with this probability."""
    return float(np.mean(np.asarray(values) <= chi2_quantile(probability, dimensions)))


def bounds(runs: int, dimensions: int = DIMENSIONS, probability: float = 0.95) -> tuple[float, float]:
    """Between which ANEES lies with this probability when the localizer is consistent: chi2(d N) / N."""
    return nees_mean_bounds(runs, dimensions, probability)


def bounds_over(
    groups: Sequence[float], dimensions: int = DIMENSIONS, probability: float = 0.95
) -> tuple[float, float] | None:
    """Between which the mean of `groups` lies with this probability when the covariance is right on average.

    `groups` are the ANEES of buildings, as many values in each: within one they may depend on each other in any way,
    along a log and from log to log, and have any distribution. Nothing but how much buildings differ tells how far off
    the mean may be; of its logarithm, for it is a scale: t times the relative standard error (delta method), with one
    degree of freedom less than there are buildings. None for fewer than three, or where a value is infinite.
    """
    count, mean = len(groups), float(np.mean(groups))
    if count < FEWEST or not 0.0 < mean < math.inf:
        return None
    from scipy.special import stdtrit

    error = float(np.std(groups, ddof=1)) / mean / math.sqrt(count)
    factor = math.exp(float(stdtrit(count - 1, (1.0 + probability) / 2.0)) * error)
    return dimensions / factor, dimensions * factor
