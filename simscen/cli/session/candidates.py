"""Runs of changed versions of one scenario, each in a process, with a cache of their results."""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from simscen.cli.interrupts import signals_interrupt
from simscen.cli.session.selection import Checks
from simscen.core.errors import Exit
from simscen.core.records.run_result import RunResult
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import ChangedScenario
from simscen.loading.yaml.tree import MappingNode
from simscen.run.process.backend import Backend
from simscen.run.process.jobs import Job
from simscen.run.sessions.run_session import SessionOptions, run_session

BATCH = 8
"""Candidates that run at the same time. Fixed, so that the result does not depend on the number of workers."""


class Stopped(Exception):
    """A signal ended the runs; `exit` is the exit code."""

    def __init__(self, code: Exit) -> None:
        super().__init__(str(code))
        self.exit = code


class BudgetSpent(Exception):
    """The maximum number of runs is reached."""


@dataclass
class CandidateRuns:
    """Runs candidates with one seed. Results are cached by content, so that no candidate runs twice.

    `max_runs` limits the number of runs, and `runs` counts them. `report` is called after each batch.
    """

    scenario: ChangedScenario
    checks: Checks
    options: SessionOptions
    backend: Backend
    seed: int
    max_runs: int
    report: Callable[[], None] = lambda: None
    runs: int = 0
    _results: dict[str, RunResult | None] = field(default_factory=dict)

    def first_accepted(self, trees: Sequence[MappingNode], accepts: Callable[[RunResult], bool]) -> int | None:
        """Return the index of the first candidate whose result `accepts` accepts, or None.

        Invalid candidates are never accepted. Raises BudgetSpent and Stopped.
        """
        for start in range(0, len(trees), BATCH):
            results = self.results(trees[start : start + BATCH])
            accepted = [result is not None and accepts(result) for result in results]
            if True in accepted:
                return start + accepted.index(True)
        return None

    def results(self, trees: Sequence[MappingNode]) -> list[RunResult | None]:
        """Return the results of some candidates; None for invalid ones. Raises BudgetSpent and Stopped."""
        keys = [_content_key(tree) for tree in trees]
        new = {key: tree for key, tree in zip(keys, trees, strict=True) if key not in self._results}
        loaded = {key: self.load(tree) for key, tree in new.items()}
        valid = {key: scenario for key, scenario in loaded.items() if scenario is not None}
        if self.runs + len(valid) > self.max_runs:
            raise BudgetSpent
        self._results |= {key: None for key in loaded if key not in valid}
        if valid:
            self._results |= dict(zip(valid, self._run(list(valid.values())), strict=True))
            self.runs += len(valid)
            self.report()
        return [self._results[key] for key in keys]

    def load(self, tree: MappingNode) -> LoadedScenario | None:
        """Load and check a candidate; None if it is invalid."""
        found = self.scenario.load(tree)
        return None if isinstance(found, list) else self.checks.variation(found)[0]

    def _run(self, scenarios: Sequence[LoadedScenario]) -> list[RunResult]:
        named = [scenario.with_changes(variation=f"candidate-{number}") for number, scenario in enumerate(scenarios)]
        with TemporaryDirectory(prefix="simscen-") as folder:
            jobs = [
                Job(number, scenario, scenario.key(self.seed), Path(folder, str(number)), self.options.wall_limit)
                for number, scenario in enumerate(named)
            ]
            with signals_interrupt():
                finished_runs, stopped = run_session(jobs, self.options, self.backend, lambda _: None)
        if stopped is not None:
            raise Stopped(stopped)
        results = {finished.key: finished.result for finished in finished_runs}
        return [results[job.key] for job in jobs]


def _content_key(tree: MappingNode) -> str:
    return hashlib.sha256(json.dumps(tree.plain, sort_keys=True).encode()).hexdigest()
