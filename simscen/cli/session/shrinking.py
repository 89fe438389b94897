"""Search for the smallest scenario with the same failure, for `simscen shrink`."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar

from simscen.cli.session.backends import interrupt_on_signals
from simscen.cli.session.file_checks import FileChecker
from simscen.core.errors import Exit, RunError, UsageError
from simscen.core.records.run_result import Outcome, RunResult
from simscen.core.records.verdict import Status, Verdict
from simscen.loading.loaded import LoadedScenario
from simscen.loading.reduction import (
    MAX_DIGITS,
    find_roundings,
    max_depth,
    removable_parts,
    with_roundings,
    with_values,
    without_parts,
)
from simscen.loading.scenario import ChangedScenario
from simscen.loading.yaml.tree import Keys, MappingNode, Node
from simscen.run.kept_files import OutcomeFilter
from simscen.run.process.jobs import Backend, Job
from simscen.run.sessions.run_session import SessionOptions, run_session

Part = TypeVar("Part")
"""Part of a scenario that can be removed or simplified independently, such as the path of a YAML key."""
FirstFailing = Callable[[Sequence[Sequence[Part]]], int | None]
"""Function that takes several lists of parts, and returns the index of the first list that fails; None if none does."""


def minimize(parts: Sequence[Part], first_failing: FirstFailing[Part]) -> list[Part]:
    """Return a minimal list of parts that fails, by delta debugging (Zeller and Hildebrandt 2002).

    The list of all parts must fail. The result is minimal: without any single part, it passes. All tested lists keep
    the order of the parts.
    """
    remaining = list(parts)
    if not remaining or first_failing([[]]) is not None:
        return []
    chunks = 2
    while len(remaining) > 1:
        size = -(-len(remaining) // chunks)
        starts = range(0, len(remaining), size)
        complements = [[*remaining[:start], *remaining[start + size :]] for start in starts]
        index = first_failing(complements)
        if index is not None:
            remaining, chunks = complements[index], max(2, chunks - 1)
        elif size == 1:
            break
        else:
            chunks = min(len(remaining), 2 * chunks)
    return remaining


BATCH_SIZE = 8
"""Number of candidates that run together. A fixed number, so that the result does not depend on the workers."""


class Stopped(Exception):
    """A signal interrupted the runs. `exit` is the exit code for the signal."""

    def __init__(self, code: Exit) -> None:
        super().__init__(str(code))
        self.exit = code


class BudgetSpent(Exception):
    """The maximum number of runs is reached."""


@dataclass
class CandidateRuns:
    """Runs of candidates, which are changed versions of a scenario in the form of YAML trees.

    All candidates run with the same seed, and equal candidates run only once. `report_progress` is called after each
    batch. `run_count` is the number of runs so far, and `max_runs` the maximum number.
    """

    scenario: ChangedScenario
    checker: FileChecker
    options: SessionOptions
    backend: Backend
    seed: int
    max_runs: int
    report_progress: Callable[[], None] = lambda: None
    run_count: int = 0
    _results: dict[str, RunResult | None] = field(default_factory=dict)

    def first_accepted(self, trees: Sequence[MappingNode], accepts: Callable[[RunResult], bool]) -> int | None:
        """Return the index of the first candidate for whose result `accepts` returns true; None if there is none.

        Invalid candidates are not accepted. Raises BudgetSpent and Stopped.
        """
        for start in range(0, len(trees), BATCH_SIZE):
            results = self.results(trees[start : start + BATCH_SIZE])
            accepted = [result is not None and accepts(result) for result in results]
            if True in accepted:
                return start + accepted.index(True)
        return None

    def results(self, trees: Sequence[MappingNode]) -> list[RunResult | None]:
        """Run candidates, and return their results; None for an invalid candidate. Raises BudgetSpent and Stopped."""
        keys = [hashlib.sha256(json.dumps(tree.plain, sort_keys=True).encode()).hexdigest() for tree in trees]
        new = {key: tree for key, tree in zip(keys, trees, strict=True) if key not in self._results}
        loaded = {key: self.load(tree) for key, tree in new.items()}
        valid = {key: scenario for key, scenario in loaded.items() if scenario is not None}
        if self.run_count + len(valid) > self.max_runs:
            raise BudgetSpent
        self._results |= {key: None for key in loaded if key not in valid}
        if valid:
            self._results |= dict(zip(valid, self._run(list(valid.values())), strict=True))
            self.run_count += len(valid)
            self.report_progress()
        return [self._results[key] for key in keys]

    def load(self, tree: MappingNode) -> LoadedScenario | None:
        """Load and check a candidate. Return None for an invalid candidate."""
        found = self.scenario.load(tree)
        return None if isinstance(found, list) else self.checker.check_variation(found)[0]

    def _run(self, scenarios: Sequence[LoadedScenario]) -> list[RunResult]:
        """Run valid candidates in parallel, and return their results. Raises Stopped."""
        named = [scenario.with_changes(variation=f"candidate-{number}") for number, scenario in enumerate(scenarios)]
        limit = self.options.wall_limit
        with TemporaryDirectory(prefix="simscen-") as folder:
            jobs = [
                Job(number, each, each.key(self.seed), Path(folder, str(number)), limit, picture=OutcomeFilter.NONE)
                for number, each in enumerate(named)
            ]
            with interrupt_on_signals():
                finished_runs, stopped = run_session(jobs, self.options, self.backend, lambda _: None)
        if stopped is not None:
            raise Stopped(stopped)
        results = {finished.key: finished.result for finished in finished_runs}
        return [results[job.key] for job in jobs]


MAX_ROUNDS = 3
"""Maximum number of rounds. Each round removes parts, and then rounds numbers."""


@dataclass(frozen=True)
class Failure:
    """Failure of a run that a smaller scenario must reproduce.

    criterion:   kind of the failed criterion, such as "collisions"; "" for an error of the stack
    verdict_id:  id of the criterion's verdict
    max_margin:  maximum margin (distance to the limit; negative for a violation); None for any margin
    """

    criterion: str
    verdict_id: str
    max_margin: float | None = None

    def occurs_in(self, result: RunResult) -> bool:
        """Return whether a run with this result reproduces the failure."""
        if not self.criterion:
            return result.error is not None and result.error.by_stack
        if result.outcome is not Outcome.FAILED:
            return False
        verdicts = [verdict for verdict in result.verdicts if verdict.criterion == self.criterion]
        failed = [verdict for verdict in verdicts if verdict.status is Status.FAIL]
        if self.max_margin is None:
            return bool(failed)
        margins = map(_smallest_margin, failed)
        return any(margin is not None and margin <= self.max_margin for margin in margins)


@dataclass
class Shrinker:
    """Makes a scenario smaller as long as its runs reproduce a failure.

    `tree` is the smallest scenario so far. `is_complete` is false if the maximum number of runs ended the search.
    """

    candidates: CandidateRuns
    failure: Failure
    tree: MappingNode
    is_complete: bool = True

    def shrink(self, nominal: Mapping[Keys, Node | None]) -> None:
        """Make the scenario as small as possible within the maximum number of runs.

        `nominal` are the values of the varied keys in the scenario without variation; None for a missing key.
        """
        try:
            self._restore_nominal(nominal)
            for _ in range(MAX_ROUNDS):
                before, depth = self.tree, 1
                while depth <= max_depth(self.tree):
                    self._remove_parts(depth)
                    depth += 1
                for digits in range(1, MAX_DIGITS + 1):
                    self._round(digits)
                if self.tree.plain == before.plain:
                    break
        except BudgetSpent:
            self.is_complete = False

    def _restore_nominal(self, nominal: Mapping[Keys, Node | None]) -> None:
        """Set the varied keys that the failure does not need to their values without variation."""
        tree = self.tree
        self._simplify(
            list(nominal),
            lambda varied: with_values(tree, {keys: node for keys, node in nominal.items() if keys not in varied}),
        )

    def _remove_parts(self, depth: int) -> None:
        """Remove the parts at this depth of the YAML tree that the failure does not need."""
        tree, parts = self.tree, removable_parts(self.tree, depth)
        self._simplify(parts, lambda needed: without_parts(tree, [keys for keys in parts if keys not in needed]))

    def _round(self, digits: int) -> None:
        """Round the numbers that the failure does not need exactly."""
        tree, roundings = self.tree, find_roundings(self.tree, digits)
        self._simplify(
            [rounding.keys for rounding in roundings],
            lambda exact: with_roundings(tree, [rounding for rounding in roundings if rounding.keys not in exact]),
        )

    def _simplify(self, parts: Sequence[Keys], build: Callable[[Sequence[Keys]], MappingNode]) -> None:
        """Simplify all parts that the failure does not need.

        `build` takes the parts to keep, and returns the scenario in which all other parts are simplified.
        """
        if parts:
            accepts = self.failure.occurs_in
            needed_parts = minimize(
                parts, lambda lists: self.candidates.first_accepted([build(kept) for kept in lists], accepts)
            )
            self.tree = build(needed_parts)


def failure_of(result: RunResult, criterion: str, share: float) -> Failure:
    """Return the failure of a run in a criterion, named by ID or kind; "" for the first failed criterion.

    `share` (0 to 1) is the fraction of the violation that a smaller scenario must still have. Raises UsageError if the
    run did not fail in this criterion, and RunError if the run could not be completed.
    """
    if result.error is not None:
        if result.error.by_stack and not criterion:
            return Failure("", "")
        raise RunError(result.error.kind, f"the run could not be completed: {result.error.message}")
    failed = [verdict for verdict in result.verdicts if verdict.status is Status.FAIL]
    chosen = next((verdict for verdict in failed if criterion in ("", verdict.id, verdict.criterion)), None)
    if result.outcome is Outcome.FAILED_AS_EXPECTED:
        raise UsageError("the run failed as expected; remove `expected` from the scenario to shrink it")
    if result.outcome is not Outcome.FAILED:
        raise UsageError(f"the run did not fail: {result.outcome.value}")
    if not failed:
        raise UsageError("the run failed without violating a criterion, such as by an inconclusive verdict")
    if chosen is None:
        raise UsageError(f"the run did not fail in {criterion}, but in {', '.join(verdict.id for verdict in failed)}")
    margin = _smallest_margin(chosen)
    return Failure(chosen.criterion, chosen.id, None if margin is None or margin >= 0.0 else share * margin)


def _smallest_margin(verdict: Verdict) -> float | None:
    """Return the smallest margin of a verdict's failed findings (checked bounds); None without margins."""
    failed = [finding for finding in verdict.findings if finding.status is Status.FAIL]
    return min((finding.margin for finding in failed if finding.margin is not None), default=None)
