"""What a session promises: every run is answered exactly once, and no fault is ever reported as a pass."""

import os
import signal
import threading
import time
from pathlib import Path

import pytest

from simscen.core.errors import Exit
from simscen.core.result import Outcome
from simscen.core.sessionevents import RunProgress, RunStarted
from simscen.loading.scenario import load_scenario
from simscen.run.session import Options, plan, run_session
from simscen.run.supervisor import Interrupted

ENTRY = (str(Path(__file__).with_name("faulty_zygote.py")),)
SCENARIO = """
simscen: 1
tags: [{fault}]
world: {{simscen: 1, walls: [{{points: [[0, 0], [9, 0]]}}]}}
robot: {{pose: {{x: 1, y: 1}}}}
pass: [{{collisions: {{max: 0}}}}]
"""


@pytest.fixture
def session(tmp_path):
    def run(*faults, events=None, **options):
        scenarios = []
        for number, fault in enumerate(faults):
            file = tmp_path / f"{number}-{fault}.scenario.yaml"
            file.write_text(SCENARIO.format(fault=fault))
            scenarios.append(load_scenario(file, tmp_path))
        chosen = Options(**{"wall_limit": 20.0, **options})
        heard = [] if events is None else events
        answers, stopped = run_session(plan(scenarios, chosen, tmp_path / "out"), chosen, ENTRY, heard.append)
        return {answer.key.scenario.partition("-")[2]: answer for answer in answers}, stopped

    return run


def test_a_run_that_ends_well_is_answered_with_its_result(session):
    events = []
    answers, stopped = session("fine", events=events)
    assert answers["fine"].outcome is Outcome.PASSED
    assert stopped is None
    assert [type(event) for event in events[:2]] == [RunStarted, RunProgress]
    assert events[1].simulated == 1.5


@pytest.mark.parametrize(
    ("fault", "kind", "told"),
    [
        ("segfault", "crashed", "crashed: SIGSEGV"),
        ("kill", "crashed", "killed (SIGKILL; possibly out of memory; peak memory"),
        ("exit-0", "crashed", "exited 0 without a result"),
        ("sys-exit", "crashed", "exited 0"),
        ("exception", "crashed", "ZeroDivisionError: the controller divided by zero (faulty_zygote.py:"),
        ("memory", "out-of-memory", "more memory than it may"),
        ("garbled", "crashed", "its result cannot be read"),
        ("grandchild", "crashed", "left a process behind"),
    ],
)
def test_a_fault_is_an_error_that_says_what_happened_and_leaves_its_neighbours_alone(session, fault, kind, told):
    answers, _ = session(fault, "fine", workers=2)
    assert answers[fault].outcome is Outcome.ERROR
    assert answers[fault].result.error.kind == kind
    assert told in answers[fault].result.error.message
    assert answers["fine"].outcome is Outcome.PASSED


def test_the_log_of_a_crashed_worker_shows_where_it_was(session):
    answers, _ = session("segfault")
    assert "faulty_zygote.py" in answers["segfault"].result.error.tail


@pytest.mark.parametrize("fault", ["hang", "deaf"])
def test_a_run_beyond_its_wall_limit_is_killed_and_told(session, fault):
    answers, _ = session(fault, wall_limit=1.0)
    assert answers[fault].result.error.kind == "timeout"


def test_what_a_worker_prints_goes_to_its_own_log(session, tmp_path, capfd):
    answers, _ = session("flood")
    assert answers["flood"].outcome is Outcome.PASSED
    assert capfd.readouterr().out == ""


def test_when_the_warm_process_dies_its_runs_are_errors_and_the_rest_still_runs(session):
    answers, _ = session("kill-parent", "fine")
    assert answers["kill-parent"].result.error.kind == "crashed"
    assert answers["fine"].outcome is Outcome.PASSED


def test_five_crashes_of_five_are_five_errors(session):
    answers, _ = session("segfault", "kill", "exit-0", "exception", "sys-exit", workers=2)
    assert [answer.outcome for answer in answers.values()] == [Outcome.ERROR] * 5


def test_fail_fast_answers_the_rest_as_not_run(session):
    answers, _ = session("exception", "fine", fail_fast=True)
    assert answers["fine"].result.error.kind == "not-run"


def test_an_interrupted_session_answers_every_run(session):
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
