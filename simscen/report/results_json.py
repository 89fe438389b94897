"""Writer of results.json: numbers of outcomes, statistics of the session, and the result of each run.

The document contains no wall times, so that equal sessions give equal documents.
"""

import json
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from simscen.core.records.comparison import Comparison
from simscen.core.records.run_result import Outcome
from simscen.core.records.run_store import RunStore
from simscen.core.records.session_events import RunFinished
from simscen.core.records.study import Study
from simscen.judge.metrics.comparison import comparison_data
from simscen.judge.metrics.session_summary import SessionSummary, SessionSummaryBuilder, session_summary_data
from simscen.judge.result_json import result_data
from simscen.judge.study_json import study_data
from simscen.report.display_text import relative_path

FORMAT = 1
"""Version of the format, which the document contains as `format`."""


def json_parts(
    runs: Sequence[RunFinished], folder: str = "", comparison: Comparison | None = None, study: Study | None = None
) -> Iterator[str]:
    """Yield the document in consecutive parts, to save memory. Runs are sorted by file and key.

    Paths of artifacts are relative to the output `folder` of the session. `comparison` compares several stacks; None
    for one stack. `study` is the result of `simscen study`; None for other sessions.
    """
    ordered = in_order(runs)
    head, tail = _json_text(_document(ordered, comparison, study)).split(_NO_RUNS)
    yield head + _NO_RUNS[:-1]
    separator = "\n    "
    for run in ordered:
        yield separator + _json_text(_run_data(run, folder)).replace("\n", "\n    ")
        separator = ",\n    "
    yield f"{'' if not ordered else chr(10) + '  '}]{tail}\n"


_NO_RUNS = '\n  "runs": []'
"""Text of an empty list of runs in the document, into which `json_parts` inserts the runs."""


def _json_text(data: dict[str, Any]) -> str:
    return json.dumps(data, sort_keys=True, indent=2, ensure_ascii=False, allow_nan=False)


def results_document(runs: Sequence[RunFinished]) -> dict[str, Any]:
    """Return the document of `json_parts` as data instead of text, without a comparison or a study."""
    ordered = in_order(runs)
    return {**_document(ordered, None, None), "runs": [_run_data(run, "") for run in ordered]}


def _document(ordered: RunStore, comparison: Comparison | None, study: Study | None) -> dict[str, Any]:
    """Return the document without its runs. `suite` has the statistics of all runs, `suites` those of each stack."""
    summaries = {stack: session_summary_data(summary) for stack, summary in summaries_by_stack(ordered).items()}
    no_summary = session_summary_data(SessionSummaryBuilder().summary())
    suite = next(iter(summaries.values()), no_summary)
    counts = dict.fromkeys((outcome.value for outcome in Outcome), 0)
    simulated = 0.0
    for run in ordered:
        counts[run.outcome.value] += 1
        simulated += run.result.simulated
    return {
        "format": FORMAT,
        "total": len(ordered),
        **counts,
        "simulated_seconds": simulated,
        **({"suites": summaries} if len(summaries) > 1 else {"suite": suite}),
        **({} if comparison is None else {"comparison": comparison_data(comparison)}),
        **({} if study is None else {"study": study_data(study)}),
        "runs": [],
    }


def _run_data(run: RunFinished, folder: str) -> dict[str, Any]:
    files = {name: getattr(run.artifacts, name) for name in ("mcap", "picture", "replay", "result")}
    artifacts = {name: relative_path(path, folder) for name, path in files.items() if path}
    resumed = {"resumed": True} if run.resumed else {}
    return {**result_data(run.result), "artifacts": artifacts, **resumed}


def summaries_by_stack(runs: Iterable[RunFinished]) -> dict[str, SessionSummary]:
    """Return the statistics of the runs of each stack ("" for a single stack), in order of appearance.

    The second runs of --check-determinism do not count.
    """
    builders: dict[str, SessionSummaryBuilder] = {}
    for run in runs:
        if not run.key.is_repetition:
            builders.setdefault(run.key.stack_name, SessionSummaryBuilder()).add(run.result)
    return {stack: builder.summary() for stack, builder in builders.items()}


def in_order(runs: Sequence[RunFinished]) -> RunStore:
    """Return the runs sorted by file, scenario, variation, seed, and stack."""
    return (runs if isinstance(runs, RunStore) else RunStore(runs)).in_order()
