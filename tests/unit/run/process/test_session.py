"""Tests of sessions: each run has one result, and a fault is never a pass."""

import contextlib
import os
import re
import signal
import threading
import time
from pathlib import Path

import pytest

from simscen.core.errors import Exit
from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished, RunProgress, RunStarted
from simscen.loading.scenario import load_scenario
from simscen.run.process import supervisor
from simscen.run.process.fork_server_process import ForkServerProcess
from simscen.run.process.jobs import Ended
from simscen.run.process.supervisor import Interrupted, Supervisor
from simscen.run.sessions.run_session import SessionOptions, plan_jobs, run_session
from simscen.spec.registry import RegisteredType

SCRIPT = str(Path(__file__).with_name("faulty_fork_server.py"))
ENTRY = (SCRIPT,)
CHILD_ENTRY = ("-c", f"import runpy; runpy.run_path({SCRIPT!r}, run_name='__main__')")
"""Entry of a fork server that is a child of this process (see tests/preloaded_fork_server.py)."""
SCENARIO = """
simscen: 1
tags: [{fault}]
world: {{simscen: 1, walls: [{{points: [[0, 0], [9, 0]]}}]}}
robot: {{pose: {{x: 1, y: 1}}}}
pass: [{{collisions: {{max: 0}}}}]
"""


@pytest.fixture
def session(tmp_path):
    def run(*faults, events=None, entry=ENTRY, **options):
        scenarios = []
        for number, fault in enumerate(faults):
            file = tmp_path / f"{number}-{fault}.scenario.yaml"
            file.write_text(SCENARIO.format(fault=fault))
            scenarios.append(load_scenario(file, tmp_path))
        chosen = SessionOptions(**{"wall_limit": 20.0, **options})
        heard = [] if events is None else events
        jobs = plan_jobs(scenarios, chosen, tmp_path / "out")
        with Supervisor(chosen.workers, entry) as backend:
            answers, stopped = run_session(jobs, chosen, backend, heard.append)
        return {answer.key.scenario.partition("-")[2]: answer for answer in answers}, stopped

    return run


def test_successful_run_returns_its_result(session):
    events = []
    answers, stopped = session("fine", events=events)
    assert answers["fine"].outcome is Outcome.PASSED
    assert stopped is None
    assert [type(event) for event in events[:2]] == [RunStarted, RunProgress]
    assert events[1].simulated == 1.5


@pytest.mark.sample(7)
@pytest.mark.parametrize(
    ("fault", "kind", "expected"),
    [
        ("segfault", "crashed", "crashed: SIGSEGV"),
        ("kill", "crashed", "killed (SIGKILL; possibly out of memory; peak memory"),
        ("exit-0", "crashed", "exited 0 without a result"),
        ("sys-exit", "crashed", "called sys.exit(0)"),
        ("exception", "crashed", "ZeroDivisionError: the controller divided by zero (faulty_fork_server.py:"),
        ("memory", "out-of-memory", "exceeded its memory limit"),
        ("garbled", "crashed", "its result cannot be read"),
        ("grandchild", "crashed", "left a process behind"),
        ("daemon", "crashed", "left a process behind"),
        ("daemon-crash", "crashed", "crashed: SIGSEGV"),
        ("prepare-segfault", "crashed", "was killed (SIGSEGV) while it prepared this one, in string_at (__init__.py:"),
        ("prepare-exit", "crashed", "called sys.exit(0)"),
        ("prepare-memory", "out-of-memory", "exceeded its memory limit"),
    ],
)
def test_a_faulty_run_is_an_error_with_its_cause_and_the_other_run_passes(session, fault, kind, expected):
    answers, _ = session(fault, "fine", workers=2)
    assert answers[fault].outcome is Outcome.ERROR
    assert answers[fault].result.error.kind == kind
    assert expected in answers[fault].result.error.message
    assert answers["fine"].outcome is Outcome.PASSED
    assert not daemons()


def daemons():
    """The processes that faulty_fork_server's daemon left, wherever they are."""
    found = []
    for entry in os.scandir("/proc"):
        with contextlib.suppress(OSError):
            if entry.name.isdigit() and b"61.25" in Path(entry.path, "cmdline").read_bytes().split(b"\0"):
                found.append(entry.name)
    return found


def test_the_log_of_a_crashed_worker_shows_where_it_crashed(session):
    answers, _ = session("segfault")
    assert "faulty_fork_server.py" in answers["segfault"].result.error.tail


@pytest.mark.parametrize("fault", ["hang", "deaf"])
def test_a_run_beyond_its_wall_limit_is_killed_and_reported(session, fault):
    answers, _ = session(fault, wall_limit=1.0)
    assert answers[fault].result.error.kind == "timeout"


def test_the_worker_log_keeps_start_and_end_of_a_long_output(session, tmp_path, capfd):
    answers, _ = session("flood")
    assert answers["flood"].outcome is Outcome.PASSED
    (log,) = tmp_path.rglob("worker.log")
    text = log.read_bytes()
    assert len(text) < 2 << 20
    assert text.startswith(b"the beginning\nxxx")
    assert text.endswith(b"xxx\nthe end\n")
    assert re.search(rb"simscen omitted \d+ bytes here", text)
    assert capfd.readouterr().out == ""


def test_remaining_runs_pass_after_a_run_kills_the_fork_server(session):
    answers, _ = session("kill-parent", "fine")
    assert answers["kill-parent"].result.error.kind == "crashed"
    assert answers["fine"].outcome is Outcome.PASSED


def test_concurrent_runs_are_repeated_after_a_run_kills_the_fork_server(session):
    answers, _ = session("kill-parent", "long", "fine", workers=2)
    assert [name for name, answer in answers.items() if answer.outcome is Outcome.PASSED] == ["long", "fine"]
    assert answers["kill-parent"].result.error.kind == "crashed"
    assert "that prepares runs was killed (SIGKILL) while" in answers["kill-parent"].result.error.message


def test_crash_while_preparing_a_world_affects_only_its_run(session):
    events = []
    answers, _ = session("long", "prepare-segfault", "fine", workers=2, events=events)
    assert [name for name, answer in answers.items() if answer.outcome is Outcome.PASSED] == ["fine", "long"]
    for kind in (RunStarted, RunFinished):
        expected = [event.key for event in events if isinstance(event, kind)]
        assert len(expected) == len(set(expected)) == 3


def test_a_preparation_that_hangs_in_c_is_a_timeout_with_its_stack(session, monkeypatch):
    monkeypatch.setattr(supervisor, "MAX_SILENCE_S", 2.0)
    answers, _ = session("prepare-hang", "fine", wall_limit=1.0)
    assert answers["prepare-hang"].result.error.kind == "timeout"
    assert ", in prepare (faulty_fork_server.py:" in answers["prepare-hang"].result.error.message
    assert answers["fine"].outcome is Outcome.PASSED


@pytest.mark.slow
def test_a_fork_server_that_is_stopped_is_replaced(session, monkeypatch):
    monkeypatch.setattr(supervisor, "MAX_SILENCE_S", 2.0)
    answers, _ = session("stop-parent", "fine")
    assert "did not respond and was killed" in answers["stop-parent"].result.error.message
    assert answers["fine"].outcome is Outcome.PASSED


def test_a_fork_server_that_cannot_start_is_an_error_of_every_run_with_its_reason(session, tmp_path):
    broken = tmp_path / "broken.py"
    broken.write_text("import no_such_module")
    answers, _ = session("fine", "hang", entry=(str(broken),))
    assert [answer.outcome for answer in answers.values()] == [Outcome.ERROR] * 2
    assert all("No module named 'no_such_module'" in answer.result.error.tail for answer in answers.values())


def test_jobs_are_not_taken_after_the_session_stops_because_the_fork_server_cannot_start(tmp_path):
    taken, ended = [], []

    def jobs():
        for job in planned_jobs(tmp_path, *["fine"] * 5):
            taken.append(job.number)
            yield job

    with Supervisor(2, ("-c", "import no_such_module")) as backend:
        ended += [update.number for update in backend.run(jobs(), should_continue=lambda: len(taken) < 3)]
    assert taken == ended == [0, 1, 2]


def test_a_job_that_was_to_be_repeated_when_a_session_stopped_is_not_run_in_the_next_session(tmp_path):
    stopped = []
    with Supervisor(2, ENTRY) as backend:
        for update in backend.run(planned_jobs(tmp_path, "hang", "prepare-segfault"), (), lambda: not stopped):
            if isinstance(update, Ended):
                stopped.append(update.number)
        assert stopped == [1]
        assert list(backend.run([])) == []


def planned_jobs(tmp_path, *faults):
    scenarios = []
    for number, fault in enumerate(faults):
        file = tmp_path / f"{number}-{fault}.scenario.yaml"
        file.write_text(SCENARIO.format(fault=fault))
        scenarios.append(load_scenario(file, tmp_path))
    return plan_jobs(scenarios, SessionOptions(wall_limit=5.0), tmp_path / "out")


def test_stray_bytes_on_the_pipes_are_ignored(session):
    answers, _ = session("stray-bytes", "fine", workers=2)
    assert answers["stray-bytes"].outcome is Outcome.PASSED
    assert answers["fine"].outcome is Outcome.PASSED


def test_output_during_preparation_is_in_the_worker_log(session, tmp_path):
    session("prepare-memory")
    (log,) = tmp_path.rglob("worker.log")
    assert log.read_text().startswith("growing\n")


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_an_output_folder_that_cannot_be_written_is_an_error_with_the_reason(session, tmp_path):
    (tmp_path / "out").mkdir(mode=0o500)
    answers, _ = session("fine")
    assert "Permission denied" in answers["fine"].result.error.message


def test_an_output_folder_that_cannot_be_created_is_an_error_with_the_reason(session, tmp_path):
    (tmp_path / "out").write_text("")
    answers, _ = session("fine")
    assert (answers["fine"].result.error.kind, "Not a directory writing" in answers["fine"].result.error.message) == (
        "output",
        True,
    )


def test_a_file_that_a_component_cannot_read_is_not_an_error_of_the_output(session):
    answers, _ = session("missing-file")
    error = answers["missing-file"].result.error
    assert error.kind == "crashed"
    assert "No such file or directory: '/nowhere/parameters.txt' (" in error.message
    assert "writing" not in error.message


def test_each_crashed_run_is_an_error(session):
    answers, _ = session("segfault", "kill", "exit-0", "exception", "sys-exit", workers=2)
    assert [answer.outcome for answer in answers.values()] == [Outcome.ERROR] * 5


def test_fail_fast_reports_the_remaining_runs_as_not_run(session):
    answers, _ = session("exception", "fine", fail_fast=True)
    assert answers["fine"].result.error.kind == "not-run"


def test_an_interrupted_session_has_a_result_for_every_run(session):
    def interrupt(number, _):
        raise Interrupted(number)

    before = signal.signal(signal.SIGINT, interrupt)
    events = []

    def when_started():
        while not any(isinstance(event, RunProgress) for event in events):
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    watcher = threading.Thread(target=when_started, daemon=True)
    try:
        watcher.start()
        answers, stopped = session("hang", "fine", events=events)
    finally:
        signal.signal(signal.SIGINT, before)
    assert stopped is Exit.INTERRUPTED
    assert answers["hang"].result.error.kind == "interrupted"
    assert answers["fine"].result.error.kind == "not-run"


def test_a_supervisor_keeps_its_processes_between_two_sessions_until_it_is_closed(tmp_path):
    file = tmp_path / "fine.scenario.yaml"
    file.write_text(SCENARIO.format(fault="fine"))
    options = SessionOptions(wall_limit=20.0)
    servers = []
    with Supervisor(1, CHILD_ENTRY) as backend:
        for number in range(2):
            jobs = plan_jobs([load_scenario(file, tmp_path)], options, tmp_path / str(number))
            answers, _ = run_session(jobs, options, backend, lambda event: None)
            assert [answer.outcome for answer in answers] == [Outcome.PASSED]
            servers += _children()
    assert len(servers) == 2
    assert servers[0] == servers[1]
    assert servers[0] not in _children()


def test_a_supervisor_uses_a_fork_server_that_was_started_before(tmp_path):
    file = tmp_path / "fine.scenario.yaml"
    file.write_text(SCENARIO.format(fault="fine"))
    options = SessionOptions(wall_limit=20.0)
    jobs = plan_jobs([load_scenario(file, tmp_path)], options, tmp_path / "out")
    started = ForkServerProcess(CHILD_ENTRY)
    (server,) = _children()
    plugin = RegisteredType("criterion", "dwell", "yardwork.dwell:Dwell", "yardwork", "1.2", folder=str(tmp_path))
    with Supervisor(1, CHILD_ENTRY, started) as backend:
        ends = [update.end for update in backend.run(jobs, [plugin]) if isinstance(update, Ended)]
        assert [end.code for end in ends] == [0]
        assert _children() == [server]
    assert not _children()
    started.close()  # has no effect a second time


def test_a_fork_server_that_dies_between_two_sessions_is_started_again(tmp_path):
    file = tmp_path / "fine.scenario.yaml"
    file.write_text(SCENARIO.format(fault="fine"))
    options = SessionOptions(wall_limit=20.0)
    with Supervisor(1, CHILD_ENTRY) as backend:
        for number in range(2):
            jobs = plan_jobs([load_scenario(file, tmp_path)], options, tmp_path / str(number))
            answers, _ = run_session(jobs, options, backend, lambda event: None)
            assert [answer.outcome for answer in answers] == [Outcome.PASSED]
            if number == 0:
                (server,) = _children()
                os.kill(server, signal.SIGKILL)


def _children():
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, parent = stat.read_text().rsplit(")", 1)[1].split()[:2]
            if int(parent) == os.getpid() and state != "Z":
                found.append(int(stat.parent.name))
    return found
