"""Tests of sessions with faulty runs: each run has one result, and a faulty run never passes."""

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
    """Return a function that runs one scenario for each fault.

    It returns the finished runs by fault, and the exit code if the session stopped early.
    """

    def run(*faults, events=None, entry=ENTRY, **options):
        scenarios = []
        for number, fault in enumerate(faults):
            file = tmp_path / f"{number}-{fault}.scenario.yaml"
            file.write_text(SCENARIO.format(fault=fault))
            scenarios.append(load_scenario(file, tmp_path))
        session_options = SessionOptions(**{"wall_limit": 20.0, **options})
        received_events = [] if events is None else events
        jobs = plan_jobs(scenarios, session_options, tmp_path / "out")
        with Supervisor(session_options.workers, entry) as backend:
            runs, stopped = run_session(jobs, session_options, backend, received_events.append)
        return {finished.key.scenario.partition("-")[2]: finished for finished in runs}, stopped

    return run


def test_successful_run_returns_its_result(session):
    events = []
    runs, stopped = session("fine", events=events)
    assert runs["fine"].outcome is Outcome.PASSED
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
    runs, _ = session(fault, "fine", workers=2)
    assert runs[fault].outcome is Outcome.ERROR
    assert runs[fault].result.error.kind == kind
    assert expected in runs[fault].result.error.message
    assert runs["fine"].outcome is Outcome.PASSED
    assert not daemons()


def daemons():
    """Return the ids of all daemons that `faulty_fork_server` started."""
    pids = []
    for entry in os.scandir("/proc"):
        with contextlib.suppress(OSError):
            if entry.name.isdigit() and b"61.25" in Path(entry.path, "cmdline").read_bytes().split(b"\0"):
                pids.append(entry.name)
    return pids


def test_the_log_of_a_crashed_worker_shows_where_it_crashed(session):
    runs, _ = session("segfault")
    assert "faulty_fork_server.py" in runs["segfault"].result.error.tail


@pytest.mark.parametrize("fault", ["hang", "deaf"])
def test_a_run_beyond_its_wall_limit_is_killed_and_reported(session, fault):
    runs, _ = session(fault, wall_limit=1.0)
    assert runs[fault].result.error.kind == "timeout"


def test_the_worker_log_keeps_start_and_end_of_a_long_output(session, tmp_path, capfd):
    runs, _ = session("flood")
    assert runs["flood"].outcome is Outcome.PASSED
    (log,) = tmp_path.rglob("worker.log")
    text = log.read_bytes()
    assert len(text) < 2 << 20
    assert text.startswith(b"the beginning\nxxx")
    assert text.endswith(b"xxx\nthe end\n")
    assert re.search(rb"simscen omitted \d+ bytes here", text)
    assert capfd.readouterr().out == ""


def test_remaining_runs_pass_after_a_run_kills_the_fork_server(session):
    runs, _ = session("kill-parent", "fine")
    assert runs["kill-parent"].result.error.kind == "crashed"
    assert runs["fine"].outcome is Outcome.PASSED


def test_concurrent_runs_are_repeated_after_a_run_kills_the_fork_server(session):
    runs, _ = session("kill-parent", "long", "fine", workers=2)
    assert [name for name, finished in runs.items() if finished.outcome is Outcome.PASSED] == ["long", "fine"]
    assert runs["kill-parent"].result.error.kind == "crashed"
    assert "that prepares runs was killed (SIGKILL) while" in runs["kill-parent"].result.error.message


def test_crash_while_preparing_a_world_affects_only_its_run(session):
    events = []
    runs, _ = session("long", "prepare-segfault", "fine", workers=2, events=events)
    assert [name for name, finished in runs.items() if finished.outcome is Outcome.PASSED] == ["fine", "long"]
    for kind in (RunStarted, RunFinished):
        keys = [event.key for event in events if isinstance(event, kind)]
        assert len(keys) == len(set(keys)) == 3


def test_a_preparation_that_hangs_in_c_is_a_timeout_with_its_stack(session, monkeypatch):
    monkeypatch.setattr(supervisor, "MAX_SILENCE_S", 2.0)
    runs, _ = session("prepare-hang", "fine", wall_limit=1.0)
    assert runs["prepare-hang"].result.error.kind == "timeout"
    assert ", in prepare (faulty_fork_server.py:" in runs["prepare-hang"].result.error.message
    assert runs["fine"].outcome is Outcome.PASSED


@pytest.mark.slow
def test_a_fork_server_that_is_stopped_is_replaced(session, monkeypatch):
    monkeypatch.setattr(supervisor, "MAX_SILENCE_S", 2.0)
    runs, _ = session("stop-parent", "fine")
    assert "did not respond and was killed" in runs["stop-parent"].result.error.message
    assert runs["fine"].outcome is Outcome.PASSED


def test_a_fork_server_that_cannot_start_is_an_error_of_every_run_with_its_reason(session, tmp_path):
    broken = tmp_path / "broken.py"
    broken.write_text("import no_such_module")
    runs, _ = session("fine", "hang", entry=(str(broken),))
    assert [finished.outcome for finished in runs.values()] == [Outcome.ERROR] * 2
    assert all("No module named 'no_such_module'" in finished.result.error.tail for finished in runs.values())


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
    runs, _ = session("stray-bytes", "fine", workers=2)
    assert runs["stray-bytes"].outcome is Outcome.PASSED
    assert runs["fine"].outcome is Outcome.PASSED


def test_output_during_preparation_is_in_the_worker_log(session, tmp_path):
    session("prepare-memory")
    (log,) = tmp_path.rglob("worker.log")
    assert log.read_text().startswith("growing\n")


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_an_output_folder_that_cannot_be_written_is_an_error_with_the_reason(session, tmp_path):
    (tmp_path / "out").mkdir(mode=0o500)
    runs, _ = session("fine")
    assert "Permission denied" in runs["fine"].result.error.message


def test_an_output_folder_that_cannot_be_created_is_an_error_with_the_reason(session, tmp_path):
    (tmp_path / "out").write_text("")
    runs, _ = session("fine")
    assert (runs["fine"].result.error.kind, "Not a directory writing" in runs["fine"].result.error.message) == (
        "output",
        True,
    )


def test_a_file_that_a_component_cannot_read_is_not_an_error_of_the_output(session):
    runs, _ = session("missing-file")
    error = runs["missing-file"].result.error
    assert error.kind == "crashed"
    assert "No such file or directory: '/nowhere/parameters.txt' (" in error.message
    assert "writing" not in error.message


def test_each_crashed_run_is_an_error(session):
    runs, _ = session("segfault", "kill", "exit-0", "exception", "sys-exit", workers=2)
    assert [finished.outcome for finished in runs.values()] == [Outcome.ERROR] * 5


def test_fail_fast_reports_the_remaining_runs_as_not_run(session):
    runs, _ = session("exception", "fine", fail_fast=True)
    assert runs["fine"].result.error.kind == "not-run"


def test_an_interrupted_session_has_a_result_for_every_run(session):
    def interrupt(number, _):
        raise Interrupted(number)

    previous_handler = signal.signal(signal.SIGINT, interrupt)
    events = []

    def interrupt_after_start():
        while not any(isinstance(event, RunProgress) for event in events):
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    watcher = threading.Thread(target=interrupt_after_start, daemon=True)
    try:
        watcher.start()
        runs, stopped = session("hang", "fine", events=events)
    finally:
        signal.signal(signal.SIGINT, previous_handler)
    assert stopped is Exit.INTERRUPTED
    assert runs["hang"].result.error.kind == "interrupted"
    assert runs["fine"].result.error.kind == "not-run"


def test_a_supervisor_keeps_its_processes_between_two_sessions_until_it_is_closed(tmp_path):
    file = tmp_path / "fine.scenario.yaml"
    file.write_text(SCENARIO.format(fault="fine"))
    options = SessionOptions(wall_limit=20.0)
    servers = []
    with Supervisor(1, CHILD_ENTRY) as backend:
        for number in range(2):
            jobs = plan_jobs([load_scenario(file, tmp_path)], options, tmp_path / str(number))
            runs, _ = run_session(jobs, options, backend, lambda event: None)
            assert [finished.outcome for finished in runs] == [Outcome.PASSED]
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
            runs, _ = run_session(jobs, options, backend, lambda event: None)
            assert [finished.outcome for finished in runs] == [Outcome.PASSED]
            if number == 0:
                (server,) = _children()
                os.kill(server, signal.SIGKILL)


def _children():
    pids = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, parent = stat.read_text().rsplit(")", 1)[1].split()[:2]
            if int(parent) == os.getpid() and state != "Z":
                pids.append(int(stat.parent.name))
    return pids
