"""Statistics of a session as in publications of navigation benchmarks, each with its number of runs."""

from dataclasses import dataclass
from typing import NamedTuple

from simscen.core.records.run_result import Outcome, RunResult
from simscen.core.statistics import wilson_interval


@dataclass(frozen=True)
class SessionSummary:
    """Statistics of a session.

    `success_rate` refers to all `runs`, including those with errors, with its 95 % Wilson interval. `spl` and
    `soft_spl` are means over the `spl_runs` with a shortest path. Collisions are counted over the `kilometers` driven
    and `hours` simulated in the `measured_runs`; a rate is None if nothing was driven. Each robot of a run counts like
    a run, except in `runs` and successes: a run succeeds if all robots succeed.
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
        """Collisions per km, or None if no robot drove."""
        return self.collisions / self.kilometers if self.kilometers > 0 else None

    @property
    def collisions_per_hour(self) -> float | None:
        """Collisions per hour, or None without simulated time."""
        return self.collisions / self.hours if self.hours > 0 else None


class SessionFigures:
    """Collects the numbers of each run that the statistics of a session need."""

    def __init__(self) -> None:
        self._runs: list[tuple[tuple[str, str, int, str], RunFigures | None]] = []

    def add(self, result: RunResult) -> None:
        """Add a run. Skipped runs do not count."""
        if result.outcome is not Outcome.SKIPPED:
            key = result.key
            order = key.scenario, key.variation, key.seed, key.stack_name
            self._runs.append((order, RunFigures.of(result) if result.metrics else None))

    def summary(self) -> SessionSummary:
        """Return the statistics. The order in which runs were added does not matter."""
        measured = [figures for _, figures in sorted(self._runs, key=lambda run: run[0]) if figures is not None]
        successes = sum(figures.success for figures in measured)
        spl = [value for figures in measured for value in figures.spl]
        soft_spl = [value for figures in measured for value in figures.soft_spl]
        runs = len(self._runs)
        return SessionSummary(
            runs=runs,
            success_rate=successes / runs if runs else None,
            success_interval=wilson_interval(successes, runs) if runs else None,
            spl=_mean(spl),
            soft_spl=_mean(soft_spl),
            spl_runs=len(spl),
            collisions=round(sum(value for figures in measured for value in figures.collisions)),
            kilometers=sum(value for figures in measured for value in figures.path_lengths) / 1000.0,
            hours=sum(figures.robot_seconds for figures in measured) / 3600.0,
            measured_runs=len(measured),
        )


class RunFigures(NamedTuple):
    """Numbers of a run for the statistics; tuples have one value for each robot."""

    success: bool
    spl: tuple[float, ...]
    soft_spl: tuple[float, ...]
    collisions: tuple[float, ...]
    path_lengths: tuple[float, ...]
    robot_seconds: float

    @classmethod
    def of(cls, run: RunResult) -> "RunFigures":
        """Return the figures of a run."""
        robots = max(1, sum(_is_metric(metric, "path_length") for metric in run.metrics))
        return cls(
            run.metrics.get("success") == 1.0,
            _known(run, "spl"),
            _known(run, "soft_spl"),
            _known(run, "collisions"),
            _known(run, "path_length"),
            run.simulated * robots,
        )


def session_summary_data(figures: SessionSummary) -> dict[str, float | list[float] | None]:
    """Return the statistics as in results.json."""
    interval = figures.success_interval
    return {
        "runs": figures.runs,
        "success_rate": figures.success_rate,
        "success_interval": None if interval is None else list(interval),
        "spl": figures.spl,
        "soft_spl": figures.soft_spl,
        "spl_runs": figures.spl_runs,
        "collisions": figures.collisions,
        "collisions_per_km": figures.collisions_per_km,
        "collisions_per_hour": figures.collisions_per_hour,
        "kilometres": figures.kilometers,
        "hours": figures.hours,
        "measured_runs": figures.measured_runs,
    }


def session_summary_line(figures: SessionSummary) -> str:
    """Return one line: "success 93% of 14 runs (69% … 99%) · SPL 0.81 of 12 runs · 0.8 collisions/km, 1.9/h in …"."""
    parts = []
    if figures.success_interval is not None:
        assert figures.success_rate is not None
        low, high = figures.success_interval
        parts.append(f"success {figures.success_rate:.0%} of {_runs(figures.runs)} ({low:.0%} … {high:.0%})")
    if figures.spl is not None:
        parts.append(f"SPL {figures.spl:.2f} of {_runs(figures.spl_runs)}")
    per_km, per_hour = figures.collisions_per_km, figures.collisions_per_hour
    if per_km is not None and per_hour is not None:
        total = f"{figures.kilometers:.2f} km, {figures.hours:.2f} h of {_runs(figures.measured_runs)}"
        parts.append(f"{per_km:.1f} collisions/km, {per_hour:.1f}/h in {total}")
    return " · ".join(parts)


def _runs(number: int) -> str:
    return f"{number} run" if number == 1 else f"{number} runs"


def _known(run: RunResult, name: str) -> tuple[float, ...]:
    """Return the values of a metric, including those of each of several robots (`a/collisions`)."""
    return tuple(value for metric, value in run.metrics.items() if _is_metric(metric, name) and value is not None)


def _is_metric(metric: str, name: str) -> bool:
    return metric.rpartition("/")[2] == name


def _mean(values: list[float]) -> float | None:
    return sum(values) / len(values) if values else None
