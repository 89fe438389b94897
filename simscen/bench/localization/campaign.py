"""Benchmark of `simscen bench localization`: runs AMCL with several parameter sets on the same generated logs."""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np

from simscen.advanced.spec import ScanMatchingAmcl
from simscen.bench.localization.consistency import (
    Consistency,
    Interval,
    anees_bounds,
    correlated_anees_bounds,
    fraction_in_ellipsoid,
)
from simscen.bench.localization.generated_logs import CIRCUMSTANCES, KIDNAPPING_TIME_S, Log, generate_log
from simscen.bench.localization.log_evaluation import (
    LocalizationResult,
    PoseErrors,
    compare_with_reference,
    localize,
)
from simscen.core.geometry import Array, wrap_array
from simscen.core.random_streams import Streams
from simscen.core.statistics import bootstrap_mean_interval
from simscen.criteria.trace_signals.estimation_errors import nees
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
"""Parameters of AMCL to compare, by name of the parameter set."""
LOGS_PER_BUILDING: Mapping[str, int] = {name: 5 if name == "tracked" else 1 for name in CIRCUMSTANCES}
"""Number of logs of each building, by circumstance (a key of CIRCUMSTANCES)."""
CONSISTENCY_CIRCUMSTANCES = ("clean", "slipping", "tracked", "outdated", "half")
"""Circumstances for which `Consistency` is computed: all except an unknown start and kidnapping."""
RELOCALIZATION_LIMIT_S = 60.0
"""Time limit for localizing the robot after an unknown start or a kidnapping."""
LOST_ERROR_M, FOUND_ERROR_M = 1.0, 0.5
"""Position error above which the robot counts as lost, and below which it counts as found again."""
CHECK_TIMES_S = (15.0, 30.0, 45.0, 60.0, 75.0)
"""Times in a log at which the NEES is computed."""
ROBOT = RobotModel(
    footprint=((0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2)),
    radius=None,
    max_linear=0.6,
    max_reverse=0.3,
    max_lateral=0.0,
    max_angular=1.0,
    linear_acceleration=1.0,
    linear_deceleration=1.0,
    angular_acceleration=2.0,
)
"""Robot model that AMCL requires. The generated logs do not depend on it."""


@dataclass(frozen=True)
class Trial:
    """Result of one parameter set on one log. The names of the fields are keys of the JSON output.

    building:     number of the building
    number:       number of the drive in the building
    circumstance: a key of CIRCUMSTANCES
    tracked:      whether the position error never exceeded LOST_ERROR_M
    median:       median position error in m
    largest:      largest position error in m
    found:        time in s from the start, or from the kidnapping, until the position error fell below FOUND_ERROR_M
                  and the robot was not lost again; None if this never happened
    nees:         NEES of the first belief at or after each of CHECK_TIMES_S
    ms:           CPU time per scan in ms
    slowest_ms:   CPU time of the slowest message in ms
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
        """Whether the robot was never lost; after an unknown start or kidnapping, whether it was found in time."""
        if self.circumstance in ("unknown", "kidnapped"):
            return self.found is not None and self.found <= RELOCALIZATION_LIMIT_S
        return self.tracked


@dataclass(frozen=True)
class SuccessRate:
    """Success on `count` out of `of` logs. `interval` is the interval of the rate, by bootstrap over buildings."""

    count: int
    of: int
    interval: Interval


@dataclass(frozen=True)
class ParameterSetResults:
    """Results of one parameter set on all logs. The names of the fields are keys of the JSON output.

    parameters:   name of the parameter set
    shares:       success rate by circumstance
    median:       median of `Trial.median` over the logs with circumstance "tracked"
    consistency:  consistency by circumstance
    ms:           mean CPU time per scan in ms, including odometry
    slowest_ms:   CPU time of the slowest message in ms
    """

    parameters: str
    shares: Mapping[str, SuccessRate]
    median: float
    consistency: Mapping[str, Consistency]
    ms: float
    slowest_ms: float


def run_buildings(
    buildings: Sequence[int], names: Sequence[str], workers: int
) -> Iterator[Mapping[str, Sequence[Trial]]]:
    """Call `run_building` for each building in parallel processes, and yield the results in the order of `buildings`.

    `names` are keys of PARAMETER_SETS. Everything except CPU times is deterministic.
    """
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield from pool.map(run_building, buildings, [tuple(names)] * len(buildings))


def run_building(building: int, names: Sequence[str]) -> Mapping[str, Sequence[Trial]]:
    """Generate all logs of a building, run each parameter set on each log, and return the trials by parameter set."""
    trials: dict[str, list[Trial]] = {name: [] for name in names}
    for circumstance, count in LOGS_PER_BUILDING.items():
        for number in range(count):
            log = generate_log(building, building + number, circumstance)
            for name in names:
                trials[name].append(run_trial(log, PARAMETER_SETS[name], seed=1 + number))
    return trials


def run_trial(log: Log, localizer: Localizer, seed: int) -> Trial:
    """Run a localizer on a log. Everything except CPU times is deterministic."""
    localized, errors = localize_in_log(log, localizer, seed)
    truth = log.recording.truth
    rows = np.searchsorted(localized.times, CHECK_TIMES_S)
    pose_errors = localized.poses[rows] - truth[rows]
    pose_errors[:, 2] = wrap_array(pose_errors[:, 2])
    i, k = np.triu_indices(3)
    search_start = KIDNAPPING_TIME_S if log.circumstance == "kidnapped" else 0.0
    return Trial(
        building=log.building,
        number=log.number,
        circumstance=log.circumstance,
        tracked=not errors.lost,
        median=float(np.median(errors.distance)),
        largest=float(errors.distance.max()),
        found=_time_found(errors.times - search_start, errors.distance),
        nees=tuple(nees(pose_errors, localized.covariances[rows][:, i, k]).tolist()),
        ms=localized.cpu_s * 1e3 / localized.scan_count,
        slowest_ms=localized.slowest_reading_s * 1e3,
    )


def localize_in_log(log: Log, localizer: Localizer, seed: int) -> tuple[LocalizationResult, PoseErrors]:
    """Run a localizer on a log, and return its beliefs and their errors."""
    surroundings = Surroundings(ROBOT, log.map, TICK_RATE_HZ)
    localized = localize(log.recording, StackSpec(localizer=localizer), surroundings, log.estimate, seed)
    errors = compare_with_reference(localized, log.recording, LOST_ERROR_M)
    assert errors is not None  # a generated log has a reference from its first reading to its last
    return localized, errors


def _time_found(times: Array, distance: Array) -> float | None:
    """Return the first of `times` at which the robot was found and not lost again; None if there is none.

    `times` (n,) are in s, relative to the start or the kidnapping; negative times are ignored. `distance` (n,) are the
    position errors in m.
    """
    lost = np.flatnonzero((distance > LOST_ERROR_M) & (times >= 0))
    begin = int(lost[-1]) + 1 if len(lost) else int(np.searchsorted(times, 0.0))
    near = np.flatnonzero(distance[begin:] < FOUND_ERROR_M)
    return max(0.0, float(times[begin + near[0]])) if len(near) else None


def summarize(name: str, trials: Sequence[Trial]) -> ParameterSetResults:
    """Return the results of the parameter set `name`. `trials` are the results of this set on all logs."""
    groups = {group: [trial for trial in trials if trial.circumstance == group] for group in CIRCUMSTANCES}
    tracked = groups["tracked"]
    return ParameterSetResults(
        parameters=name,
        shares={group: _success_rate(members) for group, members in groups.items()},
        median=float(np.median([trial.median for trial in tracked])),
        consistency={group: _consistency(groups[group]) for group in CONSISTENCY_CIRCUMSTANCES if groups[group]},
        ms=float(np.mean([trial.ms for trial in trials])),
        slowest_ms=max(trial.slowest_ms for trial in trials),
    )


def _consistency(trials: Sequence[Trial]) -> Consistency:
    values = [value for trial in trials for value in trial.nees]
    return Consistency(
        anees=float(np.mean(values)),
        bounds=correlated_anees_bounds(_means_by_building(trials, [float(np.mean(trial.nees)) for trial in trials])),
        inside=fraction_in_ellipsoid(values),
        anees_by_time=np.mean([trial.nees for trial in trials], axis=0).tolist(),
        bounds_by_time=anees_bounds(len(trials)),
    )


def _success_rate(trials: Sequence[Trial]) -> SuccessRate:
    successes = [trial.succeeded for trial in trials]
    means = _means_by_building(trials, [float(success) for success in successes])
    interval = bootstrap_mean_interval(means, Streams(1).generator("bootstrap"))
    return SuccessRate(sum(successes), len(trials), interval)


def _means_by_building(trials: Sequence[Trial], values: Sequence[float]) -> list[float]:
    """Return the mean value of each building; `values` has one value for each trial."""
    numbers = sorted({trial.building for trial in trials})
    return [
        float(np.mean([value for trial, value in zip(trials, values, strict=True) if trial.building == number]))
        for number in numbers
    ]
