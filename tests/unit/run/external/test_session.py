"""Tests of sessions with external stacks: a faulty stack does not affect other runs, and all stacks are ended."""

import json
import os
import resource
import signal
import time
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from stack_programs import DRIVE

from simscen.cli.session.backends import backend_of
from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunStarted
from simscen.report.junit import xml_parts
from simscen.run.sessions.run_session import SessionOptions, plan_jobs, run_session

HELLO = 'peer = Peer("mine", topics=["/odom", "/scan"])\n'
GOOD = HELLO + DRIVE
PROGRAMS = {
    "killed": HELLO + "next(iter(peer)); os.kill(os.getpid(), signal.SIGKILL)",
    "stopped": HELLO + "next(iter(peer)); os.kill(os.getpid(), signal.SIGSTOP)",
    "garbage": HELLO + "next(iter(peer)); peer._connection.send(b'garbage' * 1000); time.sleep(60)",
    "flood": HELLO + "next(iter(peer))\nwhile True: print('x' * 60000)",
    "fails": HELLO + "peer.give_up('no map')",
    "fine": GOOD,
}
ERROR_KINDS = {
    "killed": "stack-crashed",
    "stopped": "stack-timeout",
    "garbage": "stack-protocol",
    "flood": "stack-timeout",
    "fails": "stack-failed",
}


@pytest.fixture
def session(load, tmp_path: Path):
    """Return a function that runs one scenario for each program, and returns the finished runs by name."""

    def run(out: str, programs: dict[str, str], listen=lambda event: None):
        limits = {name: 1.0 if ERROR_KINDS.get(name) == "stack-timeout" else 30.0 for name in programs}
        scenarios = [load(text, name, answer_limit=limits[name]) for name, text in programs.items()]
        options = SessionOptions(workers=2, wall_limit=60.0)
        with backend_of(options) as backend:
            runs, _ = run_session(plan_jobs(scenarios, options, tmp_path / out), options, backend, listen)
        return {finished.key.scenario: finished for finished in runs}

    return run


def log_of(finished) -> bytes:
    return Path(finished.artifacts.mcap).read_bytes()


@pytest.mark.slow
def test_a_faulty_stack_does_not_change_the_log_of_another_run(session) -> None:
    runs = session("out", PROGRAMS)
    single = session("alone", {"fine": GOOD})["fine"]
    assert {name: run.result.error.kind for name, run in runs.items() if run.result.error} == ERROR_KINDS
    assert (runs["fine"].outcome, single.outcome) == (Outcome.PASSED, Outcome.PASSED)
    assert log_of(runs["fine"]) == log_of(single)
    description = json.loads(Path(single.artifacts.folder, "stack.json").read_text())
    assert description == {"external": "mine", "name": "mine", "version": "", "protocol": "1", "about": {}}
    cases = {
        case.get("classname"): case for case in ET.fromstring(b"".join(xml_parts(list(runs.values())))).iter("testcase")
    }
    error_types = {name: [error.get("type") for error in cases[name].findall("error")] for name in PROGRAMS}
    assert error_types == {**{name: [kind] for name, kind in ERROR_KINDS.items()}, "fine": []}
    output = Path(runs["flood"].artifacts.folder, "stack.log")
    assert 100_000 < output.stat().st_size < 2_000_000


def test_a_stack_has_the_resource_limits_of_the_caller_not_of_the_worker(session) -> None:
    print_limits = (
        "import resource\nfor name in (resource.RLIMIT_AS, resource.RLIMIT_FSIZE): print(*resource.getrlimit(name))\n"
    )
    print_files_and_handler = (
        "print(resource.getrlimit(resource.RLIMIT_NOFILE)[0])\nprint(signal.getsignal(signal.SIGINT).__name__)\n"
    )
    (finished,) = session("out", {"fine": print_limits + print_files_and_handler + GOOD}).values()
    printed = Path(finished.artifacts.folder, "stack.log").read_text().splitlines()
    hard_limits = [resource.getrlimit(name)[1] for name in (resource.RLIMIT_AS, resource.RLIMIT_FSIZE)]
    files = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    assert printed[:2] == [f"{bound} {bound}" for bound in hard_limits]
    assert printed[2:] == [str(1024 if files < 0 else min(1024, files)), "default_int_handler"]


@pytest.fixture
def processes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Return a function that returns the ids of all processes of the stacks of this test, but not of other tests."""
    monkeypatch.setenv("SIMSCEN_TEST", str(tmp_path))
    marker = f"SIMSCEN_TEST={tmp_path}\0".encode()

    def process_ids() -> set[int]:
        found = set()
        for entry in Path("/proc").iterdir():
            try:
                environ = (entry / "environ").read_bytes() if entry.name.isdigit() else b""
            except OSError:
                continue
            if marker in environ and b"SIMSCEN_STACK_FD=" in environ:
                found.add(int(entry.name))
        return found

    return process_ids


START_DAEMON = "if os.fork() == 0:\n    os.setsid()\n    while True: time.sleep(60)\n"


def test_killing_a_worker_ends_its_stack_and_the_processes_that_it_started(session, processes) -> None:
    kill = "os.kill(int(open(f'/proc/{os.getppid()}/stat').read().rsplit(')', 1)[1].split()[1]), signal.SIGKILL)\n"
    # The keeper is the parent of a stack, the worker the parent of the keeper.
    runs = session(
        "out", {"worker": START_DAEMON + HELLO + "next(iter(peer))\n" + kill + "time.sleep(60)", "fine": GOOD}
    )
    assert runs["worker"].result.error.kind == "crashed"
    assert runs["fine"].outcome is Outcome.PASSED
    assert not processes()


def test_killing_the_supervisor_ends_every_stack(load, processes, tmp_path: Path) -> None:
    loaded = load(START_DAEMON + HELLO + "for step in peer: time.sleep(60)", answer_limit=60.0)
    pid = os.fork()
    if pid == 0:
        options = SessionOptions()
        run_session(plan_jobs([loaded], options, tmp_path / "out"), options, backend_of(options), lambda event: None)
        os._exit(0)
    _wait_until(lambda: len(processes()) >= 2)
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    _wait_until(lambda: not processes())


def _wait_until(condition) -> None:
    deadline = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_interrupting_a_session_ends_every_stack(load, processes, tmp_path: Path) -> None:
    from simscen.run.process.supervisor import Interrupted

    loaded = load(START_DAEMON + HELLO + "for step in peer: time.sleep(60)", answer_limit=60.0)

    def interrupt(event) -> None:
        if isinstance(event, RunStarted):
            _wait_until(lambda: len(processes()) >= 2)
            raise Interrupted(signal.SIGINT)

    options = SessionOptions()
    with backend_of(options) as backend:
        runs, stopped = run_session(plan_jobs([loaded], options, tmp_path / "out"), options, backend, interrupt)
    assert stopped is not None
    assert [run.result.error.kind for run in runs] == ["interrupted"]
    assert not processes()
