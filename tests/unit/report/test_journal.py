"""Tests of the journal: reports can be created again, also after an interruption."""

import json
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


def planned(runs):
    return [PlannedRun(run.key, run.result.path) for run in runs]


def written(folder, runs, finished, ended=True):
    journal = Journal(folder)
    journal.plan(planned(runs), "0.1.0", 2)
    for run in runs:
        journal(RunStarted(run.key, run.result.path))
    for run in finished:
        journal(run)
    if ended:
        journal(SessionFinished(1, 1, 1, 1.0, 1.0))
    journal.close()
    assert journal.error is None


def test_reports_from_the_journal_equal_those_of_the_session(tmp_path, runs):
    inside = [
        replace(run, artifacts=replace(run.artifacts, **dict.fromkeys(("folder", "mcap", "picture", "result"), "")))
        for run in runs
    ]
    written(tmp_path, inside, inside)
    past = read_journal(tmp_path)
    assert list(past.runs) == inside
    assert not past.interrupted
    assert b"".join(xml_parts(past.runs)) == b"".join(xml_parts(inside))
    assert "".join(json_parts(past.runs)) == "".join(json_parts(inside))


def test_paths_in_the_journal_are_relative_to_its_folder(tmp_path, passed):
    (tmp_path / "old").mkdir()
    log = str(tmp_path / "old" / "a" / "run.mcap")
    written(tmp_path / "old", [passed], [replace(passed, artifacts=replace(passed.artifacts, mcap=log))])
    (tmp_path / "old").rename(tmp_path / "new")
    assert read_journal(tmp_path / "new").runs[0].artifacts.mcap == str(tmp_path / "new" / "a" / "run.mcap")


def test_planned_run_without_result_is_an_error(tmp_path, runs):
    journal = Journal(tmp_path)
    journal.plan(planned(runs), "0.1.0", 2)
    journal(runs[0])
    journal(RunStarted(runs[1].key, runs[1].result.path))
    journal.close()
    past = read_journal(tmp_path)
    assert past.interrupted
    assert [run.outcome for run in past.runs] == [Outcome.PASSED, Outcome.ERROR, Outcome.ERROR]
    assert [run.result.error.kind for run in past.runs[1:]] == ["interrupted", "not-run"]


@pytest.mark.parametrize("lost", [1, 10, 200])
def test_truncated_last_line_is_ignored(tmp_path, runs, lost):
    written(tmp_path, runs, runs, ended=False)
    file = tmp_path / JOURNAL_FILE
    file.write_bytes(file.read_bytes()[:-lost])
    assert [run.result.error.kind if run.result.error else "" for run in read_journal(tmp_path).runs][
        -1
    ] == "interrupted"


def test_next_session_continues_after_the_last_complete_line(tmp_path, runs):
    written(tmp_path, runs, runs, ended=False)
    with (tmp_path / JOURNAL_FILE).open("ab") as file:
        file.write(b'{"event": "fini')
    journal = Journal(tmp_path, resume=True)
    journal.plan(planned(runs[:1]), "0.1.0", 1)
    journal(runs[0])
    journal.close()
    assert all(json.loads(line) for line in (tmp_path / JOURNAL_FILE).read_bytes().splitlines())
    assert [run.key for run in read_journal(tmp_path).runs] == [runs[0].key]


def test_a_folder_belongs_to_one_session_at_a_time(tmp_path, runs):
    journal = Journal(tmp_path)
    journal.plan(planned(runs), "0.1.0", 2)
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
    journal.plan(planned(runs), "0.1.0", 1)
    journal.close()
    with pytest.raises(UsageError, match="already contains a session"):
        Journal(tmp_path)
    Journal(tmp_path, resume=True).close()


def test_full_disk_loses_only_whole_lines(tmp_path, runs, monkeypatch):
    import errno
    import os

    journal = Journal(tmp_path)
    journal.plan(planned(runs), "0.1.0", 2)
    write = os.write

    def full(file, data):
        if len(data) < 20:
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(file, data[:-10])

    monkeypatch.setattr(os, "write", full)
    journal(runs[0])
    monkeypatch.setattr(os, "write", write)
    assert journal.error is not None
    journal(runs[1])
    journal.close()
    assert [run.outcome for run in read_journal(tmp_path).runs] == [Outcome.ERROR, Outcome.FAILED, Outcome.ERROR]


def test_lines_that_are_written_in_several_parts_are_complete(tmp_path, runs, monkeypatch):
    import os

    journal, write = Journal(tmp_path), os.write
    monkeypatch.setattr(os, "write", lambda file, data: write(file, data[:100]))
    journal.plan(planned(runs), "0.1.0", 2)
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
    journal.plan(planned(runs), "0.1.0", 2)
    journal(runs[1])
    journal.complete(runs)
    journal.complete(runs)
    journal.close()
    finished = [line for line in (tmp_path / JOURNAL_FILE).read_text().splitlines() if '"finished"' in line]
    assert [json.loads(line)["run"] for line in finished] == [1, 0, 2]
