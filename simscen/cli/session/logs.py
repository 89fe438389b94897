"""Which logs the arguments of a command mean: a file, the folder of a run, a rosbag2, or a folder full of them."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from simscen.core.errors import InvalidInput, NothingSelected, Problem
from simscen.core.records.run_result import RunResult
from simscen.judge.result_json import from_json
from simscen.judge.run_result import combine_robots, judge_run
from simscen.loading.files.paths import is_folder
from simscen.loading.resolved import criteria_of_text
from simscen.loading.schema.messages import quoted
from simscen.loading.yaml.textfile import os_error_reason
from simscen.record.log_reader.read import Log

COMPLETE_LOG, PARTIAL_LOG = "run.mcap", "run.partial.mcap"
BAG = "metadata.yaml"
SUFFIXES = (".mcap", ".db3", ".bag")


def logs_of(paths: Sequence[Path]) -> list[Path]:
    """All of them, each once, sorted within a folder. Raises InvalidInput, and NothingSelected where there are none."""
    found: dict[Path, None] = {}
    for path in paths:
        try:
            path.lstat()
        except (OSError, ValueError) as error:
            told = os_error_reason(error) if isinstance(error, OSError) else "no such file or directory"
            raise InvalidInput([Problem(str(path), 0, 0, "SC800", told)]) from error
        inside = sorted(_logs(path), key=lambda log: log.parts) if is_folder(path) else [path]
        found.update(dict.fromkeys(inside))
    if not found:
        where = ", ".join(quoted(str(path)) for path in paths)
        raise NothingSelected(f"no logs found in {where}; a folder is searched for *.mcap and rosbag2 folders")
    return list(found)


def _logs(path: Path) -> Iterator[Path]:
    for folder, below, names in os.walk(path):
        here = Path(folder)
        if is_bag(names):
            below.clear()
            yield here
            continue
        below[:] = sorted(name for name in below if not name.startswith("."))
        logs = sorted(name for name in names if name.endswith(SUFFIXES))
        yield from (here / name for name in logs if not (name == PARTIAL_LOG and COMPLETE_LOG in logs))


def is_bag(names: Sequence[str]) -> bool:
    """Whether the files of a folder are those of a rosbag2."""
    return BAG in names and any(name.endswith((".db3", ".mcap", ".db3.zstd", ".mcap.zstd")) for name in names)


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


def recorded_result(log: Log, file: Path) -> RunResult:
    """What the run said of itself; for one that broke off, what its criteria say of what there is."""
    if log.result:
        return from_json(log.result)
    results = {name: _judged(one, file, name) for name, one in (log.robots or {"": log}).items()}
    traces = {name: one.trace for name, one in log.robots.items()}
    return combine_robots(results, traces) if traces else results[""]


def _judged(log: Log, file: Path, robot: str) -> RunResult:
    about = log.about
    spec = criteria_of_text(about.scenario, str(file), about.facts, robot)
    return judge_run(about.key, about.name, spec.pass_, log.trace, about.case, (), log.coverage, spec.metrics)
