"""Command `simscen compare`, which compares the runs of two output folders."""

import json
import sys
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli.diagnostics import print_json, print_text
from simscen.core.errors import Exit, InvalidInput, Problem
from simscen.judge.metrics.comparison import compare_sessions, comparison_data, comparison_key
from simscen.judge.significance import Significance
from simscen.report.comparison import Links, session_comparison_lines
from simscen.report.comparison_markup import session_comparison_markdown
from simscen.report.console_reporter import print_lines
from simscen.report.journal import require_unlocked
from simscen.report.journal_reader import JournaledSession, read_journal

BASELINE, CANDIDATE = "baseline", "candidate"
"""Names of the two sessions in the comparison."""


class Gate(str, Enum):
    """Value of --fail-on: the difference for which `simscen compare` exits with 1."""

    WORSE = "worse"
    FLIP = "flip"
    NEVER = "never"


class ComparisonFormat(str, Enum):
    """Output format of `simscen compare`."""

    TEXT = "text"
    JSON = "json"
    MARKDOWN = "markdown"


def command(
    baseline: Annotated[Path, typer.Argument(help="Output folder of the baseline, e.g. of the main branch.")],
    candidate: Annotated[Path, typer.Argument(help="Output folder to compare with the baseline.")],
    fail_on: Annotated[
        Gate,
        typer.Option(
            help="When to exit with 1. worse: a pass rate or a metric is significantly worse; flip: a run that passed "
            "in the baseline fails in the candidate; never: not at all."
        ),
    ] = Gate.WORSE,
    alpha: Annotated[
        float, typer.Option(min=1e-6, max=0.5, help="Highest probability of reporting equal versions as worse.")
    ] = Significance.alpha,
    min_effect: Annotated[
        float, typer.Option(min=0.0, help="Smallest relative change of a mean that matters: 0.05 is 5 %.")
    ] = Significance.min_effect,
    changed_scenarios: Annotated[
        bool, typer.Option("--changed-scenarios", help="Compare scenarios that differ between the folders as well.")
    ] = False,
    format_: Annotated[
        ComparisonFormat, typer.Option("--format", help="Output format; markdown is for a pull request.")
    ] = ComparisonFormat.TEXT,
) -> None:
    """Compare the runs of two output folders, such as of two commits.

    Runs are paired by scenario, variation, seed, and stack. Runs whose outcome changed are listed first, with the
    replay of the failure. Nothing is simulated again.

    Exit code 0: not worse; 1: worse, see --fail-on; 2: a folder cannot be read, or scenarios differ; 3: the
    candidate has runs that could not be completed, or every pair has such a run, so that nothing was compared.
    """
    folders = {BASELINE: baseline, CANDIDATE: candidate}
    sessions = {name: read_journal(folder) for name, folder in folders.items()}
    for folder in folders.values():
        require_unlocked(folder)
    _check_scenarios(sessions, candidate, changed_scenarios)
    comparison = compare_sessions(
        {name: [run.result for run in session.runs] for name, session in sessions.items()},
        {name: str(folder) for name, folder in folders.items()},
        Significance(alpha, min_effect),
    )
    (baseline_comparison,) = comparison.baseline_comparisons
    if not baseline_comparison.pairs + baseline_comparison.error_pairs:
        hint = "run the same scenarios with the same seeds in both"
        raise InvalidInput([Problem(str(candidate), 0, 0, "SC811", f"no run has a counterpart in {baseline}", hint)])
    is_worse = any(change.is_worse for change in baseline_comparison.changes)
    links = _links(sessions)
    if format_ is ComparisonFormat.JSON:
        print_json(json.dumps({"worse": is_worse, **comparison_data(comparison)}, indent=2, ensure_ascii=False))
    elif format_ is ComparisonFormat.MARKDOWN:
        print_text("\n".join(session_comparison_markdown(comparison, links, is_worse)))
    else:
        print_lines(session_comparison_lines(comparison, links, is_worse), sys.stdout)
    is_incomplete = not baseline_comparison.pairs or any(row[CANDIDATE].errors for row in comparison.outcomes.values())
    has_flipped = any(flip.failed == CANDIDATE for flip in baseline_comparison.flips)
    has_failed = {Gate.WORSE: is_worse, Gate.FLIP: has_flipped, Gate.NEVER: False}[fail_on]
    sys.exit(Exit.FAILED if has_failed else Exit.INCOMPLETE if is_incomplete else Exit.PASSED)


def _check_scenarios(sessions: dict[str, JournaledSession], candidate: Path, changed_scenarios: bool) -> None:
    """Raise InvalidInput if a scenario in both sessions has changed, unless `changed_scenarios` is true."""
    baseline, current = (
        {run.key.test: run for run in session.planned if run.definition} for session in sessions.values()
    )
    changed = [run for test, run in current.items() if test in baseline and run.definition != baseline[test].definition]
    if changed and not changed_scenarios:
        hint = "compare runs of the same scenario files, or accept it with --changed-scenarios"
        raise InvalidInput([
            Problem(str(candidate), 0, 0, "SC811", f"{run.key.test} differs from the scenario in the baseline", hint)
            for run in changed
        ])  # fmt: skip


def _links(sessions: dict[str, JournaledSession]) -> Links:
    """Return the replay or log of each run that did not pass; without these files, the command that repeats the run.

    A key consists of BASELINE or CANDIDATE, the name of the run without its seed, and the seed.
    """
    return {
        (name, comparison_key(run.key, name).test, run.key.seed): next(
            (file for file in (run.artifacts.replay, run.artifacts.mcap) if file and Path(file).is_file()), run.again
        )
        for name, session in sessions.items()
        for run in session.runs
        if not run.outcome.is_good
    }
