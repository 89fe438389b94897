"""Benchmark of `simscen bench localization`: AMCL with several parameter sets on the same generated logs."""

import math
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np

from simscen.advanced.spec import ScanMatchingAmcl
from simscen.bench.localization.generated_logs import CIRCUMSTANCES, KIDNAPPED_AT_S, Log, generate_log
from simscen.bench.localization.recorded_drive import compare_with_reference, localize
from simscen.core.geometry import Array
from simscen.core.random_streams import Streams
from simscen.core.records.trace import Trace
from simscen.core.statistics import bootstrap_mean_interval, chi2_quantile, nees_mean_bounds
from simscen.criteria.trace_signals.estimation_errors import DIMENSIONS, nees_samples
from simscen.criteria.trace_signals.estimation_errors import nees as nees_of_errors
from simscen.model.localizers import Amcl, AmclParameters, Localizer
from simscen.model.stack import StackSpec
from simscen.record.localization_logs.rows import TICK_RATE_HZ
from simscen.stack.protocols import RobotModel, Surroundings

PARAMETER_SETS: Mapping[str, AmclParameters] = {
    "amcl, likelihood_field": Amcl(laser_model_type="likelihood_field"),
    "amcl": Amcl(),
    "scan_matching_amcl": ScanMatchingAmcl(),
    "scan_matching_amcl, consistent": ScanMatchingAmcl(parameters="consistent"),
}
LOGS_PER_BUILDING: Mapping[str, int] = {name: 5 if name == "tracked" else 1 for name in CIRCUMSTANCES}
"""Number of logs of each building for each circumstance."""
CONSISTENCY_CIRCUMSTANCES = ("clean", "slipping", "tracked", "outdated", "half")
"""Circumstances in which the error is compared with the covariance."""
RELOCALIZATION_LIMIT_S = 60.0
"""Time in which a robot with an unknown start, or after a kidnapping, must be localized."""
LOST_M, FOUND_M = 1.0, 0.5
"""Error from which a robot counts as lost, and below which it counts as localized again."""
MOMENTS_S = (15.0, 30.0, 45.0, 60.0, 75.0)
"""Times in a log at which the error is compared with the covariance."""
ROBOT = RobotModel(((0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2)), None, 0.6, 0.3, 0.0, 1.0, 1.0, 1.0, 2.0)

Interval = tuple[float, float] | None


@dataclass(frozen=True)
class Trial:
    """Result of one log: errors in m, times in s. The names of the fields are keys of the JSON output.

    `tracked`: the error never exceeded LOST_M. `found` is the time until the robot was localized for good, or None.
    `nees` are the normalized estimation errors squared at MOMENTS_S. `ms` is the mean CPU time per scan, and
    `slowest_ms` the largest.
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

    @property
    def succeeded(self) -> bool:
        """Whether the robot was found in time, or with a known start, whether it was never lost."""
        if self.circumstance in ("unknown", "kidnapped"):
            return self.found is not None and self.found <= RELOCALIZATION_LIMIT_S
        return self.tracked


@dataclass(frozen=True)
class Share:
    """Share of successful logs: `count` of `of` logs, with the 95 % interval by bootstrap over buildings."""

    count: int
    of: int
    interval: Interval


@dataclass(frozen=True)
class Consistency:
    """Comparison of squared error and covariance: ANEES over all logs and moments; 3 for a consistent localizer.

    `bounds` contain the ANEES of a covariance that is right on average, from the variation between buildings; None for
    too few buildings. `inside` is the share of poses within their 95 % ellipsoid. `moments` are the ANEES over logs at
    each of MOMENTS_S, and `moment_bounds` their bounds for normal errors and independent logs.
    """

    anees: float
    bounds: Interval
    inside: float
    moments: Sequence[float]
    moment_bounds: tuple[float, float]


@dataclass(frozen=True)
class Row:
    """Results of one parameter set. The names of the fields are keys of the JSON output.

    `shares` are the successful logs by circumstance. `median` is the median over tracked logs of the median error in a
    log, in m. `sure` is the consistency by circumstance. `ms` is the mean CPU time per scan with odometry, and
    `slowest_ms` that of the slowest scan.
    """

    parameters: str
    shares: Mapping[str, Share]
    median: float
    median_interval: Interval
    sure: Mapping[str, Consistency]
    ms: float
    slowest_ms: float


def run_buildings(
    buildings: Sequence[int], names: Sequence[str], workers: int
) -> Iterator[Mapping[str, Sequence[Trial]]]:
    """Yield the trials of each building, by the name of the parameter set. Deterministic except for CPU times."""
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield from pool.map(run_building, buildings, [tuple(names)] * len(buildings))


def run_building(building: int, names: Sequence[str]) -> Mapping[str, Sequence[Trial]]:
    """Run all logs of a building through each of these parameter sets."""
    trials: dict[str, list[Trial]] = {name: [] for name in names}
    for circumstance, count in LOGS_PER_BUILDING.items():
        for number in range(count):
            log = generate_log(building, building + number, circumstance)
            for name in names:
                trials[name].append(run_trial(log, PARAMETER_SETS[name], seed=1 + number))
    return trials


def run_trial(log: Log, localizer: Localizer, seed: int) -> Trial:
    """Run a log through a localizer. The same arguments give the same result except for CPU times."""
    spec = StackSpec(localizer=localizer)
    localized = localize(log.sensed, spec, Surroundings(ROBOT, log.map, TICK_RATE_HZ), log.estimate, seed)
    errors = compare_with_reference(localized, log.sensed, LOST_M)
    assert errors is not None  # a generated log has a reference from its first reading to its last
    truth = log.sensed.truth
    rows = np.searchsorted(localized.times, MOMENTS_S)
    pose_errors = localized.poses[rows] - truth[rows]
    pose_errors[:, 2] = (pose_errors[:, 2] + np.pi) % (2 * np.pi) - np.pi
    lost_at = KIDNAPPED_AT_S if log.circumstance == "kidnapped" else 0.0
    return Trial(
        building=log.building,
        number=log.number,
        circumstance=log.circumstance,
        tracked=not errors.lost,
        median=float(np.median(errors.distance)),
        largest=float(errors.distance.max()),
        found=_time_found(errors.times - lost_at, errors.distance),
        nees=tuple(nees(*each) for each in zip(pose_errors, localized.covariances[rows], strict=True)),
        ms=localized.cpu * 1e3 / localized.scans,
        slowest_ms=localized.slowest * 1e3,
    )


def _time_found(times: Array, distance: Array) -> float | None:
    """Return the first time with an error below FOUND_M after the last one above LOST_M, or None."""
    lost = np.flatnonzero((distance > LOST_M) & (times >= 0))
    begin = int(lost[-1]) + 1 if len(lost) else int(np.searchsorted(times, 0.0))
    near = np.flatnonzero(distance[begin:] < FOUND_M)
    return max(0.0, float(times[begin + near[0]])) if len(near) else None


def summarize(name: str, trials: Sequence[Trial]) -> Row:
    """Return the results of a parameter set."""
    groups = {group: [trial for trial in trials if trial.circumstance == group] for group in CIRCUMSTANCES}
    tracked = groups["tracked"]
    return Row(
        parameters=name,
        shares={group: _share(members) for group, members in groups.items()},
        median=float(np.median([trial.median for trial in tracked])),
        median_interval=_interval(_means_by_building(tracked, [trial.median for trial in tracked])),
        sure={group: _consistency(groups[group]) for group in CONSISTENCY_CIRCUMSTANCES if groups[group]},
        ms=float(np.mean([trial.ms for trial in trials])),
        slowest_ms=max(trial.slowest_ms for trial in trials),
    )


def _consistency(trials: Sequence[Trial]) -> Consistency:
    values = [value for trial in trials for value in trial.nees]
    return Consistency(
        anees=anees(values),
        bounds=grouped_anees_bounds(_means_by_building(trials, [anees(trial.nees) for trial in trials])),
        inside=share_in_ellipsoid(values),
        moments=[anees([trial.nees[k] for trial in trials]) for k in range(len(MOMENTS_S))],
        moment_bounds=anees_bounds(len(trials)),
    )


def _share(trials: Sequence[Trial]) -> Share:
    successes = [trial.succeeded for trial in trials]
    means = _means_by_building(trials, [float(success) for success in successes])
    return Share(sum(successes), len(trials), _interval(means))


def _means_by_building(trials: Sequence[Trial], values: Sequence[float]) -> list[float]:
    """Return the mean of the values of each building."""
    numbers = sorted({trial.building for trial in trials})
    return [
        float(np.mean([value for trial, value in zip(trials, values, strict=True) if trial.building == number]))
        for number in numbers
    ]


def _interval(values: Sequence[float]) -> Interval:
    return bootstrap_mean_interval(values, Streams(1).generator("bootstrap"))


MIN_GROUPS = 3
"""Minimum number of buildings for bounds from the variation between buildings."""


def nees(error: Array, covariance: Array) -> float:
    """Return e' P^-1 e of an error (3,) in m, m, rad with covariance P (3, 3); inf for a singular P."""
    return float(nees_of_errors(error[np.newaxis], covariance[np.triu_indices(3)][np.newaxis])[0])


def nees_at(trace: Trace, seconds: float) -> float | None:
    """Return the NEES of the belief at a time of a run; None before the first belief and after the end."""
    samples, tick = nees_samples(trace), round(seconds * trace.tick_rate)
    if not len(samples) or tick < samples.ticks[0] or tick > trace.end:
        return None
    return float(samples.at(np.array([tick]))[0, 0])


def anees(values: Sequence[float]) -> float:
    """Return the average NEES, which is 3 for a consistent localizer in the plane."""
    return float(np.mean(values))


def share_in_ellipsoid(values: Sequence[float], dimensions: int = DIMENSIONS, probability: float = 0.95) -> float:
    """Return the share of NEES within the ellipsoid that contains normal errors with this probability."""
    return float(np.mean(np.asarray(values) <= chi2_quantile(probability, dimensions)))


def anees_bounds(runs: int, dimensions: int = DIMENSIONS, probability: float = 0.95) -> tuple[float, float]:
    """Return the bounds of the ANEES of a consistent localizer with this probability: chi2(d N) / N."""
    return nees_mean_bounds(runs, dimensions, probability)


def grouped_anees_bounds(
    groups: Sequence[float], dimensions: int = DIMENSIONS, probability: float = 0.95
) -> tuple[float, float] | None:
    """Return the bounds of the mean of `groups` with this probability if the covariance is right on average.

    `groups` are the ANEES of buildings with the same number of values. Values within a building may depend on each
    other and have any distribution, so only the variation between buildings shows the uncertainty of the mean. The
    interval is that of its logarithm, because ANEES is a scale: Student's t times the relative standard error (delta
    method), with one degree of freedom less than there are buildings. None for fewer than MIN_GROUPS buildings or an
    infinite value.
    """
    count, mean = len(groups), float(np.mean(groups))
    if count < MIN_GROUPS or not 0.0 < mean < math.inf:
        return None
    from scipy.special import stdtrit

    error = float(np.std(groups, ddof=1)) / mean / math.sqrt(count)
    factor = math.exp(float(stdtrit(count - 1, (1.0 + probability) / 2.0)) * error)
    return dimensions / factor, dimensions * factor
