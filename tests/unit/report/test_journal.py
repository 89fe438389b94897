"""Tests of the journal, from which reports are created, also after an interruption."""

import errno
import json
import os
from dataclasses import replace

import pytest

from simscen.core.errors import InvalidInput, UsageError
from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunStarted, SessionFinished
from simscen.report.journal import Journal, require_unlocked
from simscen.report.journal_reader import JOURNAL_FILE, PlannedRun, read_journal
from simscen.report.junit import xml_parts
from simscen.report.results_json import json_parts


@pytest.fixture
def runs(passed, failed, crashed):
    return [passed, failed, crashed]


def planned_runs(runs):
    return [PlannedRun(run.key, run.result.path) for run in runs]


def write_journal(folder, runs, finished, is_finished=True):
    """Write the journal of a session that planned and started `runs`, of which `finished` have finished."""
    journal = Journal(folder)
    journal.plan(planned_runs(runs), "0.1.0", 2)
    for run in runs:
        journal(RunStarted(run.key, run.result.path))
    for run in finished:
        journal(run)
    if is_finished:
        journal(SessionFinished(1, 1, 1, 1.0, 1.0))
    journal.close()
    assert journal.error is None


def test_reports_from_the_journal_equal_those_of_the_session(tmp_path, runs):
    runs_without_files = [
        replace(run, artifacts=replace(run.artifacts, **dict.fromkeys(("folder", "mcap", "picture", "result"), "")))
        for run in runs
    ]
    write_journal(tmp_path, runs_without_files, runs_without_files)
    session = read_journal(tmp_path)
    assert list(session.runs) == runs_without_files
    assert not session.interrupted
    assert b"".join(xml_parts(session.runs)) == b"".join(xml_parts(runs_without_files))
    assert "".join(json_parts(session.runs)) == "".join(json_parts(runs_without_files))


def test_paths_in_the_journal_are_relative_to_its_folder(tmp_path, passed):
    (tmp_path / "old").mkdir()
    log = str(tmp_path / "old" / "a" / "run.mcap")
    write_journal(tmp_path / "old", [passed], [replace(passed, artifacts=replace(passed.artifacts, mcap=log))])
    (tmp_path / "old").rename(tmp_path / "new")
    assert read_journal(tmp_path / "new").runs[0].artifacts.mcap == str(tmp_path / "new" / "a" / "run.mcap")


def test_planned_run_without_result_is_an_error(tmp_path, runs):
    journal = Journal(tmp_path)
    journal.plan(planned_runs(runs), "0.1.0", 2)
    journal(runs[0])
    journal(RunStarted(runs[1].key, runs[1].result.path))
    journal.close()
    session = read_journal(tmp_path)
    assert session.interrupted
    assert [run.outcome for run in session.runs] == [Outcome.PASSED, Outcome.ERROR, Outcome.ERROR]
    assert [run.result.error.kind for run in session.runs[1:]] == ["interrupted", "not-run"]


@pytest.mark.parametrize("lost_bytes", [1, 10, 200])
def test_truncated_last_line_is_ignored(tmp_path, runs, lost_bytes):
    write_journal(tmp_path, runs, runs, is_finished=False)
    file = tmp_path / JOURNAL_FILE
    file.write_bytes(file.read_bytes()[:-lost_bytes])
    assert [run.result.error.kind if run.result.error else "" for run in read_journal(tmp_path).runs][
        -1
    ] == "interrupted"


def test_next_session_continues_after_the_last_complete_line(tmp_path, runs):
    write_journal(tmp_path, runs, runs, is_finished=False)
    with (tmp_path / JOURNAL_FILE).open("ab") as file:
        file.write(b'{"event": "fini')
    journal = Journal(tmp_path, resume=True)
    journal.plan(planned_runs(runs[:1]), "0.1.0", 1)
    journal(runs[0])
    journal.close()
    assert all(json.loads(line) for line in (tmp_path / JOURNAL_FILE).read_bytes().splitlines())
    assert [run.key for run in read_journal(tmp_path).runs] == [runs[0].key]


def test_folder_is_used_by_one_session_at_a_time(tmp_path, runs):
    journal = Journal(tmp_path)
    journal.plan(planned_runs(runs), "0.1.0", 2)
    with pytest.raises(UsageError, match=r"is in use by pid \d+"):
        require_unlocked(tmp_path)
    with pytest.raises(UsageError, match="is in use by pid"):
        Journal(tmp_path, resume=True)
    journal.close()
    require_unlocked(tmp_path)
    with pytest.raises(UsageError, match="already contains a session"):
        Journal(tmp_path)


def test_a_refused_session_leaves_the_folder_unlocked(tmp_path, runs):
    journal = Journal(tmp_path)
    journal.plan(planned_runs(runs), "0.1.0", 1)
    journal.close()
    with pytest.raises(UsageError, match="already contains a session"):
        Journal(tmp_path)
    Journal(tmp_path, resume=True).close()


def test_full_disk_loses_only_whole_lines(tmp_path, runs, monkeypatch):
    journal = Journal(tmp_path)
    journal.plan(planned_runs(runs), "0.1.0", 2)
    write = os.write

    def write_partially(file, data):
        if len(data) < 20:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, data[:-10])

    monkeypatch.setattr(os, "write", write_partially)
    journal(runs[0])
    monkeypatch.setattr(os, "write", write)
    assert journal.error is not None
    journal(runs[1])
    journal.close()
    assert [run.outcome for run in read_journal(tmp_path).runs] == [Outcome.ERROR, Outcome.FAILED, Outcome.ERROR]


def test_lines_that_are_written_in_several_parts_are_complete(tmp_path, runs, monkeypatch):
    journal, write = Journal(tmp_path), os.write
    monkeypatch.setattr(os, "write", lambda file, data: write(file, data[:100]))
    journal.plan(planned_runs(runs), "0.1.0", 2)
    journal(runs[1])
    journal.close()
    assert journal.error is None
    assert [run.outcome for run in read_journal(tmp_path).runs] == [Outcome.ERROR, Outcome.FAILED, Outcome.ERROR]


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (None, "the folder has no events.jsonl"),
        (b"", "ended before it listed its runs"),
        (b"junk\n", "the journal is damaged"),
        (b'{"event": "planned", "format": 99, "runs": []}\n', "the journal has format 99"),
        (b'{"event": "planned", "format": 2, "runs": [{}], "version": "", "workers": 1, "at": 0}\n', "damaged"),
        (b'{"event": "planned", "format": 2, "runs": ["a"], "version": "", "workers": 1, "at": 0}\n', "damaged"),
    ],
)
def test_other_files_are_refused_as_journals(tmp_path, content, text):
    if content is not None:
        (tmp_path / JOURNAL_FILE).write_bytes(content)
    with pytest.raises(InvalidInput, match=text):
        read_journal(tmp_path)


def test_results_missing_after_an_interrupt_are_added_once(tmp_path, runs):
    journal = Journal(tmp_path)
    journal.plan(planned_runs(runs), "0.1.0", 2)
    journal(runs[1])
    journal.complete(runs)
    journal.complete(runs)
    journal.close()
    finished = [line for line in (tmp_path / JOURNAL_FILE).read_text().splitlines() if '"finished"' in line]
    assert [json.loads(line)["run"] for line in finished] == [1, 0, 2]
