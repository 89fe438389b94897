"""A recorded run for commands that show it: its log, and what it says of itself."""

from pathlib import Path

from simscen.core.errors import InvalidInput
from simscen.core.problems import Problem
from simscen.core.result import RunResult
from simscen.judge.result import result_of
from simscen.judge.resultdata import from_json
from simscen.judge.several import together
from simscen.loading.resolved import criteria_of_text
from simscen.record.replay import Log

LOGS = ("run.mcap", "run.partial.mcap")


def log_file(run: Path) -> Path:
    """The log itself. Raises InvalidInput when a folder holds none."""
    if not run.is_dir():
        return run
    found = [run / name for name in LOGS if (run / name).is_file()]
    if not found:
        hint = "name the folder of one run, e.g. simscen-out/latest/runs/SCENARIO/seed-1"
        raise InvalidInput([Problem(str(run), 0, 0, "SC800", f"there is no {LOGS[0]} in it", hint)])
    return found[0]


def said_of(log: Log, file: Path) -> RunResult:
    """What the run said of itself; for one that broke off, what its criteria say of what there is."""
    if log.result:
        return from_json(log.result)
    results = {name: _judged(one, file, name) for name, one in (log.robots or {"": log}).items()}
    traces = {name: one.trace for name, one in log.robots.items()}
    return together(results, traces) if traces else results[""]


def _judged(log: Log, file: Path, robot: str) -> RunResult:
    about = log.about
    spec = criteria_of_text(about.scenario, str(file), about.facts, robot)
    return result_of(about.key, about.name, spec.pass_, log.trace, about.case, metrics=spec.metrics)
