"""Tests that a failing external stack does not affect other runs."""

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
BROKEN = {
    "killed": HELLO + "next(iter(peer)); os.kill(os.getpid(), signal.SIGKILL)",
    "stopped": HELLO + "next(iter(peer)); os.kill(os.getpid(), signal.SIGSTOP)",
    "garbage": HELLO + "next(iter(peer)); peer._connection.send(b'garbage' * 1000); time.sleep(60)",
    "flood": HELLO + "next(iter(peer))\nwhile True: print('x' * 60000)",
    "fails": HELLO + "peer.give_up('no map')",
    "fine": GOOD,
}
KINDS = {
    "killed": "stack-crashed",
    "stopped": "stack-timeout",
    "garbage": "stack-protocol",
    "flood": "stack-timeout",
    "fails": "stack-failed",
}


@pytest.fixture
def session(load, tmp_path: Path):
    def run(out: str, programs: dict[str, str], listen=lambda event: None):
        limits = {name: 1.0 if KINDS.get(name) == "stack-timeout" else 30.0 for name in programs}
        scenarios = [load(text, name, answer_limit=limits[name]) for name, text in programs.items()]
        options = SessionOptions(workers=2, wall_limit=60.0)
        with backend_of(options) as backend:
            answers, _ = run_session(plan_jobs(scenarios, options, tmp_path / out), options, backend, listen)
        return {answer.key.scenario: answer for answer in answers}

    return run


def log_of(answer) -> bytes:
    return Path(answer.artifacts.mcap).read_bytes()


@pytest.mark.slow
def test_a_faulty_stack_does_not_change_the_log_of_another_run(session) -> None:
    answers = session("out", BROKEN)
    alone = session("alone", {"fine": GOOD})["fine"]
    assert {name: answer.result.error.kind for name, answer in answers.items() if answer.result.error} == KINDS
    assert (answers["fine"].outcome, alone.outcome) == (Outcome.PASSED, Outcome.PASSED)
    assert log_of(answers["fine"]) == log_of(alone)
    given = json.loads(Path(alone.artifacts.folder, "stack.json").read_text())
    assert given == {"external": "mine", "name": "mine", "version": "", "protocol": "1", "about": {}}
    cases = {
        case.get("classname"): case
        for case in ET.fromstring(b"".join(xml_parts(list(answers.values())))).iter("testcase")
    }
    expected = {name: [error.get("type") for error in cases[name].findall("error")] for name in BROKEN}
    assert expected == {**{name: [kind] for name, kind in KINDS.items()}, "fine": []}
    printed = Path(answers["flood"].artifacts.folder, "stack.log")
    assert 100_000 < printed.stat().st_size < 2_000_000


def test_a_stack_has_the_resource_limits_of_the_caller_not_of_the_worker(session) -> None:
    show = (
        "import resource\nfor what in (resource.RLIMIT_AS, resource.RLIMIT_FSIZE): print(*resource.getrlimit(what))\n"
    )
    also = "print(resource.getrlimit(resource.RLIMIT_NOFILE)[0])\nprint(signal.getsignal(signal.SIGINT).__name__)\n"
    (answer,) = session("out", {"fine": show + also + GOOD}).values()
    printed = Path(answer.artifacts.folder, "stack.log").read_text().splitlines()
    hard = [resource.getrlimit(what)[1] for what in (resource.RLIMIT_AS, resource.RLIMIT_FSIZE)]
    files = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
    assert printed[:2] == [f"{bound} {bound}" for bound in hard]
    assert printed[2:] == [str(1024 if files < 0 else min(1024, files)), "default_int_handler"]


@pytest.fixture
def processes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    """Gives the processes that have the environment of this test's stacks, and of no neighbor's."""
    monkeypatch.setenv("SIMSCEN_TEST", str(tmp_path))
    own = f"SIMSCEN_TEST={tmp_path}\0".encode()

    def look() -> set[int]:
        found = set()
        for entry in Path("/proc").iterdir():
            try:
                environ = (entry / "environ").read_bytes() if entry.name.isdigit() else b""
            except OSError:
                continue
            if own in environ and b"SIMSCEN_STACK_FD=" in environ:
                found.add(int(entry.name))
        return found

    return look


LINGERS = "if os.fork() == 0:\n    os.setsid()\n    while True: time.sleep(60)\n"


def test_killing_a_worker_ends_its_stack_and_the_processes_that_it_started(session, processes) -> None:
    kill = "os.kill(int(open(f'/proc/{os.getppid()}/stat').read().rsplit(')', 1)[1].split()[1]), signal.SIGKILL)\n"
    # The keeper is the parent of a stack, the worker the parent of the keeper.
    answers = session("out", {"worker": LINGERS + HELLO + "next(iter(peer))\n" + kill + "time.sleep(60)", "fine": GOOD})
    assert answers["worker"].result.error.kind == "crashed"
    assert answers["fine"].outcome is Outcome.PASSED
    assert not processes()


def test_killing_the_supervisor_ends_every_stack(load, processes, tmp_path: Path) -> None:
    loaded = load(LINGERS + HELLO + "for step in peer: time.sleep(60)", answer_limit=60.0)
    pid = os.fork()
    if pid == 0:
        options = SessionOptions()
        run_session(plan_jobs([loaded], options, tmp_path / "out"), options, backend_of(options), lambda event: None)
        os._exit(0)
    _until(lambda: len(processes()) >= 2)
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    _until(lambda: not processes())


def _until(done) -> None:
    end = time.monotonic() + 60
    while not done():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_interrupting_a_session_ends_every_stack(load, processes, tmp_path: Path) -> None:
    from simscen.run.process.supervisor import Interrupted

    loaded = load(LINGERS + HELLO + "for step in peer: time.sleep(60)", answer_limit=60.0)

    def interrupt(event) -> None:
        if isinstance(event, RunStarted):
            _until(lambda: len(processes()) >= 2)
            raise Interrupted(signal.SIGINT)

    options = SessionOptions()
    with backend_of(options) as backend:
        answers, stopped = run_session(plan_jobs([loaded], options, tmp_path / "out"), options, backend, interrupt)
    assert stopped is not None
    assert [answer.result.error.kind for answer in answers] == ["interrupted"]
    assert not processes()
