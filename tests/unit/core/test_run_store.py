"""Tests of the run store, which keeps many results in little memory."""

import json
from dataclasses import replace

import pytest

from simscen.core.records import run_store
from simscen.core.records.run_result import Outcome, RunKey, RunResult
from simscen.core.records.run_store import FinishedRuns, RunStore
from simscen.core.records.session_events import RunFinished, SessionFinished
from simscen.report import github
from simscen.report.junit import xml_parts
from simscen.report.results_json import json_parts, results_document
from simscen.report.suite import SessionReport, page, to_html


def run(seed: int, path: str = "a.scenario.yaml", outcome: Outcome = Outcome.PASSED) -> RunFinished:
    key = RunKey(path.partition(".")[0], seed)
    result = RunResult(key, path, outcome, simulated=seed / 4, metrics={"spl": 1 / seed, "collisions": None})
    return RunFinished(result, wall=0.5, tags=(f"tag {seed}",))


RUNS = [run(seed, path) for path in ("b.scenario.yaml", "a.scenario.yaml") for seed in (7, 3, 100, 5)]


@pytest.fixture(params=[0, 3, 100])
def store(request, monkeypatch) -> RunStore:
    """Return a store of RUNS; the parameter is the number of results that are not compressed."""
    monkeypatch.setattr(run_store, "MAX_UNCOMPRESSED", request.param)
    return RunStore(RUNS)


def test_store_is_a_sequence_of_its_results(store: RunStore) -> None:
    assert len(store) == len(RUNS)
    assert list(store) == RUNS
    assert list(store) == RUNS  # it can be read again
    assert [store[index] for index in (0, 5, -1)] == [RUNS[0], RUNS[5], RUNS[-1]]
    assert list(store[2:6:2]) == RUNS[2:6:2]
    with pytest.raises(IndexError):
        store[len(RUNS)]


def test_results_are_ordered_by_file_and_key(store: RunStore) -> None:
    assert list(store.in_order()) == sorted(RUNS, key=lambda run: (run.result.path, run.key))
    assert list(store.select([4, 1])) == [RUNS[4], RUNS[1]]


def test_results_added_to_a_slice_are_kept(store: RunStore) -> None:
    part = store.select([7])
    part.append(run(9))
    assert list(part) == [RUNS[7], run(9)]


def test_reports_do_not_depend_on_compression(store: RunStore) -> None:
    assert "".join(json_parts(store)) == "".join(json_parts(RUNS))
    assert b"".join(xml_parts(store)) == b"".join(xml_parts(RUNS))


def test_last_result_of_a_run_replaces_earlier_ones(store: RunStore) -> None:
    finished = FinishedRuns()
    for finished_run in store:
        finished.add(finished_run.key, finished_run)
    newer = replace(RUNS[0], wall=9.0)
    finished.add(newer.key, newer)
    assert finished[newer.key] == newer
    assert len(finished) == len({finished_run.key for finished_run in RUNS})
    assert set(finished) == {finished_run.key for finished_run in RUNS}
    assert finished.get(RunKey("unknown", 1)) is None


@pytest.mark.parametrize("number", [0, 1, 8])
def test_results_json_is_one_sorted_and_indented_document(number: int) -> None:
    runs = RUNS[:number]
    expected = json.dumps(results_document(runs), sort_keys=True, indent=2, ensure_ascii=False) + "\n"
    assert "".join(json_parts(runs)) == expected


def test_the_page_of_many_runs_lists_failures_first_and_counts_all(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page, "MAX_LISTED_RUNS", 4)
    runs = [run(seed) for seed in range(1, 10)]
    runs[6] = run(7, outcome=Outcome.FAILED)
    html = to_html(SessionReport(RunStore(runs)))
    assert "8 passed" in html
    assert "1 failed" in html
    assert "9 runs" in html
    assert "8 of 9 as expected" in html
    assert "this page lists 4 of them, those that did not end as expected first" in html
    assert [number for number in range(1, 10) if f"seed {number}<" in html] == [1, 2, 3, 7]


def test_the_summary_on_github_is_limited_to_the_first_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(github, "MAX_ROWS", 2)
    runs = [run(1), run(2), run(3, outcome=Outcome.FAILED)]
    text = github.summary_markdown(RunStore(runs), SessionFinished(2, 1, 0, simulated=1.0, wall=1.0))
    rows = [line for line in text.splitlines() if "seed" in line or "more" in line]
    assert [("❌" in row, "✅" in row) for row in rows] == [(True, False), (False, True), (False, False)]
    assert "and 1 more" in rows[-1]


@pytest.mark.parametrize(("number", "marks"), [(200, 200), (201, 0)])
def test_the_heading_of_a_scenario_has_a_mark_for_each_run_unless_there_are_too_many(number: int, marks: int) -> None:
    html = to_html(SessionReport([run(seed) for seed in range(1, number + 1)]))
    heading = html.partition('<details class="group many"')[2].partition("</summary>")[0]
    assert heading.count("✓") == marks
