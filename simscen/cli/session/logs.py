"""Search for logs in files and folders, and the result of a log: the recorded one, or a new evaluation."""

import os
from collections.abc import Iterator, Sequence
from pathlib import Path

from simscen.core.errors import InvalidInput, NothingSelected, Problem
from simscen.core.records.run_result import RunResult
from simscen.core.records.verdict import ExpectedFailure
from simscen.judge.result_json import from_json
from simscen.judge.run_result import judge_run
from simscen.judge.several_robots import combine_robots
from simscen.loading.files.paths import is_folder
from simscen.loading.scenario_text import criteria_of_text
from simscen.loading.schema.messages import quoted
from simscen.loading.yaml.textfile import os_error_reason
from simscen.model.scenario import CriteriaSpec, expected_failure
from simscen.record.log_reader import Log, invalid_log
from simscen.report.journal_reader import JOURNAL_FILE

COMPLETE_LOG, PARTIAL_LOG = "run.mcap", "run.partial.mcap"
"""Names of the log in the folder of a run: of a completed run, and of an aborted run."""
BAG_METADATA = "metadata.yaml"
"""Name of a file in every rosbag2 folder."""
LOG_SUFFIXES = (".mcap", ".db3", ".bag")
"""Suffixes of log files of ROS 2 and ROS 1."""


def find_logs(paths: Sequence[Path]) -> list[Path]:
    """Return the logs at and below the paths, without duplicates, sorted within each path.

    A path is a file or a folder; a rosbag2 folder is one log. Raises InvalidInput for an unusable path, and
    NothingSelected if there are no logs.
    """
    found: dict[Path, None] = {}
    for path in paths:
        try:
            path.lstat()
        except (OSError, ValueError) as error:
            reason = os_error_reason(error) if isinstance(error, OSError) else "no such file or directory"
            raise InvalidInput([Problem(str(path), 0, 0, "SC800", reason)]) from error
        inside = sorted(_logs(path), key=lambda log: log.parts) if is_folder(path) else [path]
        found.update(dict.fromkeys(inside))
    if not found:
        where = ", ".join(quoted(str(path)) for path in paths)
        raise NothingSelected(
            f"no logs found in {where}; a folder is searched for *.mcap, *.db3, *.bag, and rosbag2 folders"
        )
    return list(found)


def _logs(path: Path) -> Iterator[Path]:
    """Yield the logs in a folder and its visible subfolders, without a PARTIAL_LOG beside a COMPLETE_LOG."""
    for folder, subfolders, names in _walk(path):
        if is_bag(names):
            subfolders.clear()
            yield folder
            continue
        logs = sorted(name for name in names if name.endswith(LOG_SUFFIXES))
        yield from (folder / name for name in logs if not (name == PARTIAL_LOG and COMPLETE_LOG in logs))


def find_sessions(paths: Sequence[Path]) -> list[Path]:
    """Return the output folders of sessions at and below the paths, without sessions that planned no runs."""
    found: dict[Path, None] = {}
    for path in paths:
        for folder, subfolders, names in _walk(path):
            if JOURNAL_FILE in names:
                subfolders.clear()
                if (folder / JOURNAL_FILE).stat().st_size:
                    found[folder] = None
    return list(found)


def _walk(path: Path) -> Iterator[tuple[Path, list[str], list[str]]]:
    """Yield each folder at and below `path`, the names of its visible subfolders, and the names of its files.

    Subfolders that the caller removes from the list are not searched. Raises InvalidInput for an unreadable folder.
    """

    def fail(error: OSError) -> None:
        raise InvalidInput([Problem(str(error.filename), 0, 0, "SC800", os_error_reason(error))]) from error

    if not is_folder(path):
        return
    for folder, subfolders, names in os.walk(path, onerror=fail):
        subfolders[:] = sorted(name for name in subfolders if not name.startswith("."))
        yield Path(folder), subfolders, names


def is_bag(names: Sequence[str]) -> bool:
    """Return whether a folder with these file names is a rosbag2 folder."""
    return BAG_METADATA in names and any(name.endswith((".db3", ".mcap", ".db3.zstd", ".mcap.zstd")) for name in names)


def log_name(log: Path) -> str:
    """Return the name of a log without its suffix; for a rosbag2 folder, its whole name."""
    return log.name if log.is_dir() else log.stem


def log_file(run: Path) -> Path:
    """Return the log in the folder `run`, or `run` itself if it is not a folder. Raises InvalidInput without a log."""
    if not run.is_dir():
        return run
    found = [run / name for name in (COMPLETE_LOG, PARTIAL_LOG) if (run / name).is_file()]
    if not found:
        hint = "name the folder of one run, e.g. simscen-out/latest/runs/SCENARIO/seed-1"
        raise InvalidInput([Problem(str(run), 0, 0, "SC800", f"there is no {COMPLETE_LOG} in it", hint)])
    return found[0]


def recorded_result(log: Log, file: Path) -> RunResult:
    """Return the result that is recorded in a log. For an incomplete log, which has none, evaluate the criteria.

    Raises InvalidInput for an invalid result.
    """
    if not log.result:
        return evaluate_recorded_criteria(log, file, log.header.name)
    try:
        return from_json(log.result)
    except ValueError as error:
        raise invalid_log(file, "SC802", f"its result cannot be read: {error}") from error


def evaluate_recorded_criteria(log: Log, file: Path, path: str) -> RunResult:
    """Return the result of a log according to the criteria of the scenario in the log.

    `file` is the path of the log in messages. `path` is the attribute `path` of the result: the ID of the scenario, or
    the path of the log.
    """
    header = log.header

    def criteria(robot: str) -> CriteriaSpec:
        return criteria_of_text(header.scenario, str(file), header.facts, robot)

    def judge(part: Log, spec: CriteriaSpec, expected: ExpectedFailure | None) -> RunResult:
        case, coverage = part.header.case, part.coverage
        return judge_run(header.key, path, spec.pass_, part.trace, case, (), coverage, spec.metrics, expected)

    spec = criteria("")
    expected = expected_failure(spec)
    if not log.robots:
        return judge(log, spec, expected)
    results = {name: judge(part, criteria(name), None) for name, part in log.robots.items()}
    return combine_robots(results, {name: part.trace for name, part in log.robots.items()}, expected)
