"""Statistics over all runs of a session, as in navigation benchmarks: success rate, SPL, and collisions."""

from dataclasses import dataclass
from typing import NamedTuple

from simscen.core.records.run_result import Outcome, RunKey, RunResult
from simscen.core.statistics import wilson_interval


@dataclass(frozen=True)
class SessionSummary:
    """Statistics of a session. A value is None if no run has the required metric.

    Attributes:
        runs: Number of runs that were neither skipped nor left unfinished because the session ended.
        judged_runs: Number of these runs with a known success. A run with an error did not succeed.
        success_rate: Share of the `judged_runs` in which all robots succeeded.
        success_interval: 95 % Wilson interval of the success rate.
        spl: Mean of the metric `spl` over all robots.
        soft_spl: Mean of the metric `soft_spl` over all robots.
        spl_runs: Number of values of `spl`, one for each robot of each run.
        collisions: Number of collisions of all robots whose collisions are known.
        kilometers: Distance driven by these robots, in km.
        hours: Simulated time of these robots, in h.
        measured_runs: Number of runs with at least one robot whose collisions are known.
    """

    runs: int
    judged_runs: int
    success_rate: float | None
    success_interval: tuple[float, float] | None
    spl: float | None
    soft_spl: float | None
    spl_runs: int
    collisions: int | None
    kilometers: float
    hours: float
    measured_runs: int

    @property
    def collisions_per_km(self) -> float | None:
        """Collisions per kilometer; None if they are unknown or no robot drove."""
        return None if self.collisions is None or not self.kilometers else self.collisions / self.kilometers

    @property
    def collisions_per_hour(self) -> float | None:
        """Collisions per hour; None if they are unknown or no time was simulated."""
        return None if self.collisions is None or not self.hours else self.collisions / self.hours


class SessionSummaryBuilder:
    """Computes a SessionSummary from runs that are added one by one."""

    def __init__(self) -> None:
        self._runs = 0
        self._measured: list[tuple[RunKey, _RunNumbers]] = []

    def add(self, result: RunResult) -> None:
        """Add a run. Skipped runs, and runs that the end of the session interrupted or prevented, are ignored."""
        if result.outcome is Outcome.SKIPPED or result.is_unfinished:
            return
        self._runs += 1
        if result.metrics:
            collisions = _by_robot(result, "collisions")
            path_lengths = _by_robot(result, "path_length")
            numbers = _RunNumbers(
                result.metrics.get("success"),
                tuple(_by_robot(result, "spl").values()),
                tuple(_by_robot(result, "soft_spl").values()),
                tuple(collisions.values()),
                tuple(path_lengths.get(robot, 0.0) for robot in collisions),
                result.simulated * len(collisions),
            )
            self._measured.append((result.key, numbers))

    def summary(self) -> SessionSummary:
        """Return the statistics of the added runs."""
        measured = [numbers for _, numbers in sorted(self._measured, key=lambda run: run[0])]
        known = [run.success == 1.0 for run in measured if run.success is not None]
        successes, judged_runs = sum(known), len(known) + self._runs - len(measured)
        spl = [value for run in measured for value in run.spl]
        soft_spl = [value for run in measured for value in run.soft_spl]
        with_collisions = [run for run in measured if run.collisions]
        return SessionSummary(
            runs=self._runs,
            judged_runs=judged_runs,
            success_rate=successes / judged_runs if judged_runs else None,
            success_interval=wilson_interval(successes, judged_runs) if judged_runs else None,
            spl=_mean(spl),
            soft_spl=_mean(soft_spl),
            spl_runs=len(spl),
            collisions=round(sum(sum(run.collisions) for run in with_collisions)) if with_collisions else None,
            kilometers=sum(value for run in with_collisions for value in run.path_lengths) / 1000.0,
            hours=sum(run.robot_seconds for run in with_collisions) / 3600.0,
            measured_runs=len(with_collisions),
        )


class _RunNumbers(NamedTuple):
    """Numbers of one run that the statistics of a session need.

    success:        1 if all robots with goals succeeded, otherwise 0; None if unknown
    spl, soft_spl:  value of each robot that has the metric
    collisions:     number of collisions of each robot, if it is known
    path_lengths:   driven distance in m of the robots with known collisions
    robot_seconds:  simulated time in s of these robots, summed over the robots
    """

    success: float | None
    spl: tuple[float, ...]
    soft_spl: tuple[float, ...]
    collisions: tuple[float, ...]
    path_lengths: tuple[float, ...]
    robot_seconds: float


def session_summary_data(summary: SessionSummary) -> dict[str, float | list[float] | None]:
    """Return the statistics as JSON data for results.json."""
    interval = summary.success_interval
    return {
        "runs": summary.runs,
        "judged_runs": summary.judged_runs,
        "success_rate": summary.success_rate,
        "success_interval": None if interval is None else list(interval),
        "spl": summary.spl,
        "soft_spl": summary.soft_spl,
        "spl_runs": summary.spl_runs,
        "collisions": summary.collisions,
        "collisions_per_km": summary.collisions_per_km,
        "collisions_per_hour": summary.collisions_per_hour,
        "kilometres": summary.kilometers,
        "hours": summary.hours,
        "measured_runs": summary.measured_runs,
    }


def session_summary_line(summary: SessionSummary) -> str:
    """Return one line, e.g. "success 93% of 9 runs (69% … 99%) · SPL 0.81 of 12 values · 0.8 collisions/km, 1.9/h"."""
    parts = []
    if summary.success_interval is not None:
        assert summary.success_rate is not None
        low, high = summary.success_interval
        parts.append(f"success {summary.success_rate:.0%} of {_runs(summary.judged_runs)} ({low:.0%} … {high:.0%})")
    if summary.spl is not None:
        parts.append(f"SPL {summary.spl:.2f} of {summary.spl_runs} value{'s' * (summary.spl_runs != 1)}")
    per_km, per_hour = summary.collisions_per_km, summary.collisions_per_hour
    if per_km is not None and per_hour is not None:
        total = f"{summary.kilometers:.2f} km, {summary.hours:.2f} h of {_runs(summary.measured_runs)}"
        parts.append(f"{per_km:.1f} collisions/km, {per_hour:.1f}/h in {total}")
    return " · ".join(parts)


def _runs(number: int) -> str:
    return f"{number} run" if number == 1 else f"{number} runs"


def _by_robot(run: RunResult, name: str) -> dict[str, float]:
    """Return the known values of a metric by robot: "" with one robot; otherwise the metric is called `robot/name`."""
    parts = {metric: metric.rpartition("/") for metric in run.metrics}
    values = {parts[metric][0]: value for metric, value in run.metrics.items() if parts[metric][2] == name}
    return {robot: value for robot, value in values.items() if value is not None}


def _mean(values: list[float]) -> float | None:
    return sum(values) / len(values) if values else None
