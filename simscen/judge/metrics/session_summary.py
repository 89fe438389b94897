"""Statistics of a session that navigation benchmarks publish, each with its number of runs."""

from collections.abc import Iterable
from dataclasses import dataclass

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


def summarize_session(results: Iterable[RunResult]) -> SessionSummary:
    """Return the statistics of a session without skipped runs. The order of the runs does not matter."""
    runs = sorted((run for run in results if run.outcome is not Outcome.SKIPPED), key=lambda run: run.key)
    measured = [run for run in runs if run.metrics]
    successes = sum(run.metrics.get("success") == 1.0 for run in measured)
    spl, soft_spl = (_known(measured, name) for name in ("spl", "soft_spl"))
    return SessionSummary(
        runs=len(runs),
        success_rate=successes / len(runs) if runs else None,
        success_interval=wilson_interval(successes, len(runs)) if runs else None,
        spl=_mean(spl),
        soft_spl=_mean(soft_spl),
        spl_runs=len(spl),
        collisions=round(sum(_known(measured, "collisions"))),
        kilometers=sum(_known(measured, "path_length")) / 1000.0,
        hours=sum(run.simulated * _robots(run) for run in measured) / 3600.0,
        measured_runs=len(measured),
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
        way = f"{figures.kilometers:.2f} km, {figures.hours:.2f} h of {_runs(figures.measured_runs)}"
        parts.append(f"{per_km:.1f} collisions/km, {per_hour:.1f}/h in {way}")
    return " · ".join(parts)


def _runs(number: int) -> str:
    return f"{number} run" if number == 1 else f"{number} runs"


def _known(runs: list[RunResult], name: str) -> list[float]:
    """Return the values of a metric, including those of each of several robots (`a/collisions`)."""
    found = [value for run in runs for metric, value in run.metrics.items() if _is(metric, name)]
    return [value for value in found if value is not None]


def _robots(run: RunResult) -> int:
    return max(1, sum(_is(metric, "path_length") for metric in run.metrics))


def _is(metric: str, name: str) -> bool:
    return metric.rpartition("/")[2] == name


def _mean(values: list[float]) -> float | None:
    return sum(values) / len(values) if values else None
