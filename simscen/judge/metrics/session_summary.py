"""Statistics over all runs of a session, as in navigation benchmarks: success rate, SPL, and collisions."""

from dataclasses import dataclass
from typing import NamedTuple

from simscen.core.records.run_result import Outcome, RunKey, RunResult
from simscen.core.statistics import wilson_interval


@dataclass(frozen=True)
class SessionSummary:
    """Statistics of a session. A value is None if no run has it.

    Attributes:
        runs: Number of runs that were neither skipped nor left unfinished because the session ended.
        success_rate: Share of the `runs` in which all robots succeeded.
        success_interval: 95 % Wilson interval of the success rate.
        spl: Mean of the metric `spl` over all robots.
        soft_spl: Mean of the metric `soft_spl` over all robots.
        spl_runs: Number of values of `spl`.
        collisions: Number of collisions of all robots.
        kilometers: Distance driven by all robots.
        hours: Simulated time of all robots.
        measured_runs: Number of runs that have metrics.
    """

    runs: int
    success_rate: float | None
    success_interval: tuple[float, float] | None
    spl: float | None
    soft_spl: float | None
    spl_runs: int
    collisions: int
    kilometers: float
    hours: float
    measured_runs: int

    @property
    def collisions_per_km(self) -> float | None:
        """Collisions per kilometer; None if no robot drove."""
        return self.collisions / self.kilometers if self.kilometers > 0 else None

    @property
    def collisions_per_hour(self) -> float | None:
        """Collisions per hour; None without simulated time."""
        return self.collisions / self.hours if self.hours > 0 else None


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
            robots = max(1, sum(_is_metric(metric, "path_length") for metric in result.metrics))
            numbers = _RunNumbers(
                result.metrics.get("success") == 1.0,
                _known(result, "spl"),
                _known(result, "soft_spl"),
                _known(result, "collisions"),
                _known(result, "path_length"),
                result.simulated * robots,
            )
            self._measured.append((result.key, numbers))

    def summary(self) -> SessionSummary:
        """Return the statistics of the added runs."""
        measured = [numbers for _, numbers in sorted(self._measured, key=lambda run: run[0])]
        successes = sum(run.success for run in measured)
        spl = [value for run in measured for value in run.spl]
        soft_spl = [value for run in measured for value in run.soft_spl]
        runs = self._runs
        return SessionSummary(
            runs=runs,
            success_rate=successes / runs if runs else None,
            success_interval=wilson_interval(successes, runs) if runs else None,
            spl=_mean(spl),
            soft_spl=_mean(soft_spl),
            spl_runs=len(spl),
            collisions=round(sum(value for run in measured for value in run.collisions)),
            kilometers=sum(value for run in measured for value in run.path_lengths) / 1000.0,
            hours=sum(run.robot_seconds for run in measured) / 3600.0,
            measured_runs=len(measured),
        )


class _RunNumbers(NamedTuple):
    """Numbers of one run that the statistics of a session need.

    Tuples have one value for each robot that has the metric. `robot_seconds` is the simulated time of all robots
    together.
    """

    success: bool
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
    """Return one line, e.g. "success 93% of 14 runs (69% … 99%) · SPL 0.81 of 12 runs · 0.8 collisions/km, 1.9/h"."""
    parts = []
    if summary.success_interval is not None:
        assert summary.success_rate is not None
        low, high = summary.success_interval
        parts.append(f"success {summary.success_rate:.0%} of {_runs(summary.runs)} ({low:.0%} … {high:.0%})")
    if summary.spl is not None:
        parts.append(f"SPL {summary.spl:.2f} of {_runs(summary.spl_runs)}")
    per_km, per_hour = summary.collisions_per_km, summary.collisions_per_hour
    if per_km is not None and per_hour is not None:
        total = f"{summary.kilometers:.2f} km, {summary.hours:.2f} h of {_runs(summary.measured_runs)}"
        parts.append(f"{per_km:.1f} collisions/km, {per_hour:.1f}/h in {total}")
    return " · ".join(parts)


def _runs(number: int) -> str:
    return f"{number} run" if number == 1 else f"{number} runs"


def _known(run: RunResult, name: str) -> tuple[float, ...]:
    """Return the defined values of a metric for all robots."""
    return tuple(value for metric, value in run.metrics.items() if _is_metric(metric, name) and value is not None)


def _is_metric(metric: str, name: str) -> bool:
    """Return whether `metric` is `name` or, with several robots, `robot/name`."""
    return metric.rpartition("/")[2] == name


def _mean(values: list[float]) -> float | None:
    return sum(values) / len(values) if values else None
