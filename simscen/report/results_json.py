"""Writer of results.json, without wall-clock times so that two sessions can be compared."""

import json
from collections.abc import Sequence
from pathlib import PurePath
from types import TracebackType
from typing import Any, TextIO

from simscen.core.records.run_result import Outcome, RunResult
from simscen.core.records.session_events import Comparison, RunFinished, SessionEvent, SessionFinished
from simscen.core.records.study import Study
from simscen.judge.metrics.comparison import comparison_data
from simscen.judge.metrics.session_summary import session_summary_data, summarize_session
from simscen.judge.result_json import result_data
from simscen.judge.study_json import study_data
from simscen.report.display_text import escape_ci_markers_in_json
from simscen.report.text_reporters import Reporter

FORMAT = 1


def to_json(
    runs: Sequence[RunFinished], folder: str = "", comparison: Comparison | None = None, study: Study | None = None
) -> str:
    """Return the document with sorted runs. Paths of artifacts are relative to the `folder` of the session."""
    document = as_document(runs, folder, comparison, study)
    return json.dumps(document, sort_keys=True, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def as_document(
    runs: Sequence[RunFinished], folder: str = "", comparison: Comparison | None = None, study: Study | None = None
) -> dict[str, Any]:
    """Return the document as data: counts, and one entry per run in the format of its result.json."""
    ordered = in_order(runs)
    counts = {outcome.value: sum(run.outcome is outcome for run in runs) for outcome in Outcome}
    return {
        "format": FORMAT,
        "total": len(runs),
        **counts,
        "simulated_seconds": sum(run.result.simulated for run in ordered),
        **_summaries(ordered),
        **({} if comparison is None else {"comparison": comparison_data(comparison)}),
        **({} if study is None else {"study": study_data(study)}),
        "runs": [{**result_data(run.result), "artifacts": _artifacts(run, folder), **_resumed(run)} for run in ordered],
    }


def _summaries(runs: Sequence[RunFinished]) -> dict[str, Any]:
    """Return `suite`, or `suites` by name for several stacks, which are never pooled."""
    found = {
        stack: session_summary_data(summarize_session(results)) for stack, results in results_by_stack(runs).items()
    }
    if len(found) > 1:
        return {"suites": found}
    return {"suite": next(iter(found.values()), session_summary_data(summarize_session([])))}


def results_by_stack(runs: Sequence[RunFinished]) -> dict[str, list[RunResult]]:
    """Return the results by stack in order of appearance, without the second runs of --check-determinism."""
    found: dict[str, list[RunResult]] = {}
    for run in runs:
        if not run.key.repeats:
            found.setdefault(run.key.stack_name, []).append(run.result)
    return found


def in_order(runs: Sequence[RunFinished]) -> list[RunFinished]:
    """Return the runs sorted by file, scenario and seed."""
    return sorted(runs, key=lambda run: (run.result.path, run.key))


def _resumed(run: RunFinished) -> dict[str, bool]:
    return {"resumed": True} if run.resumed else {}


def _artifacts(run: RunFinished, folder: str) -> dict[str, str]:
    artifacts = run.artifacts
    names = "mcap", "picture", "replay", "result"
    files = {name: getattr(artifacts, name) for name in names}
    return {name: relative(path, folder) for name, path in files.items() if path}


def relative(path: str, folder: str) -> str:
    """Return the path of a file relative to `folder` if the file is in there, otherwise the path itself."""
    inside = folder and PurePath(path).is_relative_to(folder)
    return PurePath(path).relative_to(folder).as_posix() if inside else PurePath(path).as_posix()


def json_reporter(out: TextIO) -> Reporter:
    """Return a reporter that writes the document at the end of the session."""
    return _JsonReporter(out)


class _JsonReporter:
    def __init__(self, out: TextIO) -> None:
        self._out = out
        self._runs: list[RunFinished] = []

    def __enter__(self) -> "_JsonReporter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._out.flush()

    def __call__(self, event: SessionEvent) -> None:
        """Collect a finished run, or write the document."""
        if isinstance(event, RunFinished):
            self._runs.append(event)
        if isinstance(event, SessionFinished):
            self._out.write(escape_ci_markers_in_json(to_json(self._runs, event.folder, event.comparison, event.study)))
            self._out.flush()
