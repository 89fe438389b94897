"""What `simscen bench localization` measures: parameters of AMCL on the same generated logs, building by building."""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context

import numpy as np

from simscen.advanced.localizers.spec import ScanMatchingAmcl
from simscen.bench.localization.generated_logs import CIRCUMSTANCES, log
from simscen.bench.localization.trial import MOMENTS, Trial, anees, bounds, bounds_over, trial, within_bounds
from simscen.core.random_streams import Streams
from simscen.core.statistics import bootstrap_mean_interval
from simscen.model.localizers import Amcl, AmclParameters

PARAMETERS: Mapping[str, AmclParameters] = {
    "Nav2's": Amcl(),
    "Nav2's, likelihood_field_prob": Amcl(laser_model_type="likelihood_field_prob"),
    "default": ScanMatchingAmcl(),
    "consistent": ScanMatchingAmcl(parameters="consistent"),
}
LOGS: Mapping[str, int] = {name: 5 if name == "tracked" else 1 for name in CIRCUMSTANCES}
"""Logs of each building under each circumstance."""
SURE = ("clean", "slipping", "tracked", "outdated", "half")
"""Circumstances under which the error is compared with the covariance."""
WITHIN = 60.0
"""Seconds in which a robot must be found that was told nothing, or was carried elsewhere."""

Interval = tuple[float, float] | None


@dataclass(frozen=True)
class Share:
    """`count` of `of` logs, and between what bounds the share lies with 95 %, by bootstrap over buildings."""

    count: int
    of: int
    interval: Interval


@dataclass(frozen=True)
class Sureness:
    """How the squared error compares with the covariance: ANEES over all logs and moments, 3 when they agree.

    `bounds` are those of a covariance that is right on average, by how much buildings differ; None for too few of them.
    `inside` is the share of the poses that lie within their 95 % ellipsoid. `moments` are the ANEES over logs at each
    of MOMENTS, and `moment_bounds` those of errors that are normal and of logs that are independent.
    """

    anees: float
    bounds: Interval
    inside: float
    moments: Sequence[float]
    moment_bounds: tuple[float, float]


@dataclass(frozen=True)
class Row:
    """One set of parameters. Errors in m: the median over the tracked logs of the median over a log.

    `unknown` and `kidnapped` count logs on which the robot was found within WITHIN, all others those on which it was
    never lost. `ms` is the processor's time a scan, odometry included, and `slowest_ms` that of the scan that took
    longest.
    """

    parameters: str
    shares: Mapping[str, Share]
    median: float
    median_interval: Interval
    sure: Mapping[str, Sureness]
    ms: float
    slowest_ms: float


def drive(buildings: Sequence[int], names: Sequence[str], workers: int) -> Iterator[Mapping[str, Sequence[Trial]]]:
    """The trials of each building in turn, by the name of the parameters. Deterministic but for processor times."""
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield from pool.map(of_building, buildings, [tuple(names)] * len(buildings))


def of_building(number: int, names: Sequence[str]) -> Mapping[str, Sequence[Trial]]:
    """All logs of a building through all these parameters."""
    trials: dict[str, list[Trial]] = {name: [] for name in names}
    for circumstance, count in LOGS.items():
        for which in range(count):
            made = log(number, number + which, circumstance)
            for name in names:
                trials[name].append(trial(made, PARAMETERS[name], seed=1 + which))
    return trials


def summed_up(name: str, trials: Sequence[Trial]) -> Row:
    """The row of some parameters."""
    under = {one: [trial for trial in trials if trial.circumstance == one] for one in CIRCUMSTANCES}
    medians = _by_building(under["tracked"], [trial.median for trial in under["tracked"]])
    return Row(
        parameters=name,
        shares={one: _share(some) for one, some in under.items()},
        median=float(np.median([trial.median for trial in under["tracked"]])),
        median_interval=_interval(medians),
        sure={one: _sureness(under[one]) for one in SURE if under[one]},
        ms=float(np.mean([trial.ms for trial in trials])),
        slowest_ms=max(trial.slowest_ms for trial in trials),
    )


def well(trial: Trial) -> bool:
    """Whether the robot was found in time, or, where it knew its place, was never lost."""
    if trial.circumstance in ("unknown", "kidnapped"):
        return trial.found is not None and trial.found <= WITHIN
    return trial.tracked


def _sureness(trials: Sequence[Trial]) -> Sureness:
    every = [value for trial in trials for value in trial.nees]
    return Sureness(
        anees=anees(every),
        bounds=bounds_over(_by_building(trials, [anees(trial.nees) for trial in trials])),
        inside=within_bounds(every),
        moments=[anees([trial.nees[k] for trial in trials]) for k in range(len(MOMENTS))],
        moment_bounds=bounds(len(trials)),
    )


def _share(trials: Sequence[Trial]) -> Share:
    good = [well(trial) for trial in trials]
    return Share(sum(good), len(good), _interval(_by_building(trials, [float(one) for one in good])))


def _by_building(trials: Sequence[Trial], values: Sequence[float]) -> list[float]:
    """The mean of each building's values."""
    numbers = sorted({trial.building for trial in trials})
    return [
        float(np.mean([value for trial, value in zip(trials, values, strict=True) if trial.building == number]))
        for number in numbers
    ]


def _interval(values: Sequence[float]) -> Interval:
    return bootstrap_mean_interval(values, Streams(1).generator("bootstrap"))
