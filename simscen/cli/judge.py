"""`simscen judge`."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli.diagnostics import print_text
from simscen.core.errors import Exit, InvalidInput
from simscen.core.problems import Problem
from simscen.core.result import Outcome, RunKey
from simscen.core.sessionevents import RunFinished
from simscen.judge.result import result_of
from simscen.judge.resultdata import to_json
from simscen.loading.resolved import spec_of_text
from simscen.loading.source import read_text
from simscen.record.replay import read_run
from simscen.report.lines import Naming, finished, text_of


def command(
    log: Annotated[Path, typer.Argument(help="The run.mcap of a run.")],
    scenario: Annotated[
        Path | None, typer.Option(help="Judge by the criteria of this file instead of those in the log.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print result.json instead of lines.")] = False,
) -> None:
    """Judge a recorded run again, without simulating it.

    The log holds the truth, the goals and the scenario, so nothing else is needed; with --scenario other criteria and
    bounds can be tried on it. Exit code 0: all hold; 1: one fails; 2: not a usable log; 3: one could not be judged.
    """
    read = read_run(log)
    name = str(scenario or log)
    spec = spec_of_text(_text(scenario) if scenario else read.about.scenario, name)
    key = RunKey(read.about.name, read.about.seed)
    result = result_of(key, name, spec.pass_, read.trace, read.about.case)
    if json:
        print(to_json(result), end="")
    else:
        for line in finished(RunFinished(result), Naming()):
            print_text(text_of(line))
    sys.exit({Outcome.PASSED: Exit.PASSED, Outcome.FAILED: Exit.FAILED, Outcome.ERROR: Exit.INCOMPLETE}[result.outcome])


def _text(file: Path) -> str:
    text = read_text(file, str(file))
    if isinstance(text, Problem):
        raise InvalidInput([text])
    return text
