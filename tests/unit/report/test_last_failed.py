"""Tests of the runs that failed last, according to the sessions in an output folder."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from simscen.core.records.run_result import Outcome, RunFailure, RunKey
from simscen.report.journal import Journal
from simscen.report.journal_reader import PlannedRun
from simscen.report.session_history import last_failed, sessions_in


@pytest.fixture
def session(tmp_path, passed, failed, crashed, skipped):
    """Return a function that writes the n-th session: `session(n, a="failed")`; other outcomes are kinds of errors."""
    runs_by_outcome = {"passed": passed, "failed": failed, "skipped": skipped}

    def write(number, **outcomes):
        folder = tmp_path / f"s{number}"
        folder.mkdir()
        journal = Journal(folder)
        journal.plan([PlannedRun(run_key(name), "x") for name in outcomes], "0.1.0", 1)
        for name, outcome in outcomes.items():
            aborted = replace(crashed, result=replace(crashed.result, error=RunFailure(outcome, "")))
            run = runs_by_outcome.get(outcome, aborted)
            journal(replace(run, result=replace(run.result, key=run_key(name))))
        journal.close()
        (folder / "run.json").write_text(json.dumps({"written": f"2026-01-0{number}T00:00:00+00:00"}))
        return folder

    return write


def run_key(name):
    """Return the key of the run of a scenario, or of its repetition if the name ends with `_again`."""
    return RunKey(name.removesuffix("_again"), 1).repetition if name.endswith("_again") else RunKey(name, 1)


def failed_in(folder):
    """Return the scenarios that failed last."""
    return {key.scenario for key in last_failed(folder)}


def test_no_failed_runs_without_a_session(tmp_path):
    assert last_failed(tmp_path) is None
    assert last_failed(tmp_path / "nowhere") is None


def test_failures_and_errors_count_as_failed(session, tmp_path):
    session(1, a="failed", b="passed", c="crashed")
    assert failed_in(tmp_path) == {"a", "c"}


def test_newest_outcome_of_each_run_counts(session, tmp_path):
    session(2, a="passed", b="failed")
    newest = session(3, b="passed")
    session(1, a="failed", b="failed", c="failed")
    assert sessions_in(tmp_path)[0] == newest
    assert failed_in(tmp_path) == {"c"}


def test_interrupted_run_keeps_its_earlier_outcome(session, tmp_path):
    session(1, a="failed", b="passed")
    session(2, a="interrupted", b="not-run", c="interrupted")
    assert failed_in(tmp_path) == {"a"}


def test_skipped_run_keeps_its_earlier_outcome(session, tmp_path):
    session(1, a="failed", b="passed")
    session(2, a="skipped", b="skipped")
    assert failed_in(tmp_path) == {"a"}


def test_run_has_failed_if_its_repetition_differs(session, tmp_path):
    session(1, a="passed", a_again="nondeterministic")
    assert failed_in(tmp_path) == {"a"}


def test_unreadable_journals_and_the_latest_link_are_ignored(session, tmp_path):
    (session(2, a="failed") / "events.jsonl").write_text("{")
    folder = session(1, a="failed")
    (tmp_path / "latest").symlink_to(folder.name)
    assert len(sessions_in(tmp_path)) == 2
    assert failed_in(tmp_path) == {"a"}


def test_folder_of_another_user_beside_the_sessions_is_ignored(session, tmp_path, monkeypatch):
    folder, foreign, original_stat = session(1, a="failed"), session(2, a="failed"), Path.stat

    def stat(path, **options):
        if foreign in path.parents:
            raise PermissionError(13, "Permission denied", str(path))
        return original_stat(path, **options)

    monkeypatch.setattr(Path, "stat", stat)
    assert sessions_in(tmp_path) == [folder]


def test_expected_failure_is_not_a_failure(session, tmp_path, failed):
    journal = Journal(session(1, a="failed"), resume=True)
    journal.plan([PlannedRun(run_key("a"), "x")], "0.1.0", 1)
    journal(replace(failed, result=replace(failed.result, key=run_key("a"), outcome=Outcome.FAILED_AS_EXPECTED)))
    journal.close()
    assert failed_in(tmp_path) == set()
