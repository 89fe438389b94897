"""Conformance tests of sessions that are killed, interrupted, or resumed, or that have a full disk or closed output."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from junitparser import JUnitXml

QUICK = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 5, y: 3}}]
time_limit: 1 s
pass: [{collisions: {max: 0}}]
"""
FAILING = QUICK.replace("collisions: {max: 0}", "clearance: {min: 2}")
LONG = QUICK.replace("time_limit: 1 s", "time_limit: 600 s").replace(
    "goals: [{pose: {x: 5, y: 3}}]", "goals: [" + ", ".join(["{pose: {x: 5, y: 3}}, {pose: {x: 1, y: 1}}"] * 40) + "]"
)

TEXTS = {"quick": QUICK, "failing": FAILING, "long": LONG}

Start = Callable[..., "subprocess.Popen[str]"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return the working folder of the commands."""
    return tmp_path


@pytest.fixture
def scenario(folder: Path) -> Callable[[str, str], None]:
    """Return a function that writes a scenario; "quick" passes, "failing" fails, and "long" lasts minutes."""
    return lambda name, kind: (folder / f"{name}.scenario.yaml").write_text(TEXTS[kind]) and None


@pytest.fixture
def start(folder: Path) -> Start:
    """Return a function that starts `simscen ARGUMENTS` in `folder`."""

    def popen(*arguments: str, **options: object) -> "subprocess.Popen[str]":
        settings = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "cwd": folder, **options}
        return subprocess.Popen([sys.executable, "-m", "simscen.cli.main", *arguments], **settings)  # type: ignore[call-overload,no-any-return]

    return popen


TIMEOUT_S = 60.0


def outcomes(folder: Path) -> dict[str, str]:
    """Return the outcome, or the kind of the error, of each scenario in results.json; junit.xml must list as many."""
    found = {
        run["scenario"]: run["error"]["kind"] if run["error"] else run["outcome"]
        for run in json.loads((folder / "results.json").read_text())["runs"]
    }
    cases = [case for suite in JUnitXml.fromfile(str(folder / "junit.xml")) for case in suite]
    assert len(cases) == len(found)
    return found


def wait_for(condition) -> None:
    end = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < end, "the condition was never true"
        time.sleep(0.02)


def descendants(pid: int) -> set[int]:
    """Return the ids of all descendants of a process, from /proc."""
    parents: dict[int, int] = {}
    for entry in os.scandir("/proc"):
        if entry.name.isdigit():
            try:
                parents[int(entry.name)] = int(Path(entry.path, "stat").read_text().rsplit(")", 1)[1].split()[1])
            except OSError:
                continue
    below: set[int] = set()
    while more := {child for child, parent in parents.items() if parent in below | {pid}} - below:
        below |= more
    return below


def have_ended(pids: set[int]) -> bool:
    return all(not Path(f"/proc/{pid}").exists() or _is_zombie(pid) for pid in pids)


def _is_zombie(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z"
    except OSError:
        return True


def journal_has(folder: Path, *events: str) -> bool:
    journal = folder / "out" / "events.jsonl"
    found = journal.read_text() if journal.exists() else ""
    return all(f'"event": "{event}"' in found for event in events)


def is_simulating(folder: Path) -> bool:
    return bool(list(folder.glob("out/runs/*/*/run.partial.mcap")))


@pytest.fixture
def three_scenarios(folder, scenario):
    """Write a scenario that passes at once and two that last minutes; return the folder."""
    for name, kind in (("a", "quick"), ("b", "long"), ("c", "long")):
        scenario(name, kind)
    return folder


@pytest.fixture
def two_scenarios(folder, scenario):
    """Write two scenarios that pass at once; return the folder."""
    scenario("quick", "quick")
    scenario("quick2", "quick")
    return folder


@pytest.mark.slow
def test_69_and_76_and_79_killed_session_leaves_no_process_and_can_be_resumed(start, three_scenarios, scenario):
    run = start("run", ".", "--out", "out", "-j", "1")
    wait_for(lambda: journal_has(three_scenarios, "finished") and is_simulating(three_scenarios))
    below = descendants(run.pid)
    assert below
    again = start("run", "a.scenario.yaml", "--out", "out")
    assert f"the output folder out is in use by pid {run.pid}" in again.communicate(timeout=TIMEOUT_S)[1]
    assert again.returncode == 2
    run.kill()
    run.communicate()
    wait_for(lambda: have_ended(below))
    report = start("report", "out")
    report.communicate(timeout=TIMEOUT_S)
    assert report.returncode == 3
    assert outcomes(three_scenarios / "out") == {"a": "passed", "b": "interrupted", "c": "not-run"}
    first = (three_scenarios / "out/runs/a/seed-1/run.mcap").stat().st_mtime_ns
    scenario("b", "quick")
    scenario("c", "failing")
    more = start("run", ".", "--resume", "out")
    more.communicate(timeout=TIMEOUT_S)
    assert more.returncode == 1
    assert outcomes(three_scenarios / "out") == {"a": "passed", "b": "passed", "c": "failed"}
    assert (three_scenarios / "out/runs/a/seed-1/run.mcap").stat().st_mtime_ns == first


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("number", "code"),
    [
        pytest.param(signal.SIGINT, 130, id="67 SIGINT"),
        pytest.param(signal.SIGTERM, 143, id="68 SIGTERM"),
        pytest.param(signal.SIGHUP, 129, id="68 SIGHUP"),
    ],
)
def test_70_interrupted_session_lists_all_runs_and_leaves_no_process(start, three_scenarios, number, code):
    run = start("run", ".", "--out", "out", "-j", "1")
    wait_for(lambda: journal_has(three_scenarios, "finished") and is_simulating(three_scenarios))
    below = descendants(run.pid)
    run.send_signal(number)
    run.send_signal(number)  # as if Ctrl-C is pressed twice
    out, err = run.communicate(timeout=TIMEOUT_S)
    assert run.returncode == code, err
    assert have_ended(below)
    assert outcomes(three_scenarios / "out") == {"a": "passed", "b": "interrupted", "c": "not-run"}
    assert "interrupted" in out


@pytest.mark.slow
def test_80_a_changed_scenario_is_run_again(start, two_scenarios, scenario):
    start("run", ".", "--out", "out").communicate(timeout=TIMEOUT_S)
    assert outcomes(two_scenarios / "out") == {"quick": "passed", "quick2": "passed"}
    scenario("quick2", "failing")
    more = start("run", ".", "--resume", "out")
    out, _ = more.communicate(timeout=TIMEOUT_S)
    assert more.returncode == 1, out
    assert outcomes(two_scenarios / "out") == {"quick": "passed", "quick2": "failed"}


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_77_full_stdout_changes_the_exit_code_but_not_the_reports(start, two_scenarios):
    with Path("/dev/full").open("w") as full:
        run = start("run", "quick.scenario.yaml", "--out", "out", stdout=full)
        err = run.communicate(timeout=TIMEOUT_S)[1]
    assert run.returncode == 3
    assert err == "simscen: cannot write to stdout: No space left on device\n"
    assert outcomes(two_scenarios / "out") == {"quick": "passed"}


def test_77_closed_pipe_has_no_effect(start, two_scenarios):
    reading, writing = os.pipe()
    os.close(reading)
    run = start("run", "quick.scenario.yaml", "--out", "out", stdout=writing)
    os.close(writing)
    err = run.communicate(timeout=TIMEOUT_S)[1]
    assert (run.returncode, err) == (0, "")
    assert outcomes(two_scenarios / "out") == {"quick": "passed"}
