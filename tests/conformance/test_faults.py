"""Conformance tests of runs that crash, hang, use too much memory, or leave processes: one session with all of them."""

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from junitparser import JUnitXml

from simscen.record.log_reader import read_log
from simscen.record.trace_difference import first_difference

SCRIPTED_FORK_SERVER = Path(__file__).with_name("scripted_fork_server.py")
WITH_FAULTS = f"""
import sys
import simscen.cli.session.backends
from simscen.cli.main import main
simscen.cli.session.fork_server_start.FORK_SERVER = ({str(SCRIPTED_FORK_SERVER)!r},)
main()
"""
WALL_LIMIT_S = 3
"""Wall limit of the runs that never end. The other runs have the default limit."""


class Case(NamedTuple):
    """A fault, and the kind and a pattern of the error that its run must report; "" if the run must pass."""

    number: int
    name: str
    fault: str
    kind: str
    words: str


CASES = [
    Case(52, "SIGSEGV", "segfault.at.0", "crashed", r"^crashed: SIGSEGV, in string_at \(__init__.py:\d+\)"),
    Case(53, "SIGKILL", "sigkill.at.0", "crashed", r"killed \(SIGKILL; possibly out of memory; peak memory \d+ MiB"),
    Case(54, "exit 0", "exit-0.at.0", "crashed", "^exited 0 without a result"),
    Case(55, "sys.exit(0)", "sys-exit.at.0", "crashed", r"^called sys.exit\(0\) \(\w+.py:\d+\)"),
    Case(58, "memory in Python", "memory.at.0", "out-of-memory", "exceeded its memory limit"),
    Case(58, "memory in C", "swell.at.0", "crashed", r"^crashed: SIGABRT, in leak .*peak memory \d+ MiB of 4096 MiB"),
    Case(59, "a grandchild", "grandchild.at.0", "crashed", "left a process behind"),
    Case(59, "a daemon", "daemon.at.0", "crashed", "left a process behind"),
    Case(60, "200 MiB of output", "flood.at.0", "", ""),
    Case(
        61,
        "an exception",
        "exception.at.0",
        "crashed",
        r"ZeroDivisionError: division by zero \(\w+.py:\d+\)",
    ),
    Case(62, "a pose that is not finite", "nan.at.0", "diverged", r"simulation diverged at t=\d"),
    Case(64, "no particle has weight", "weightless.at.0", "", ""),
    Case(64, "weights that are not finite", "nan-weights.at.0", "", ""),
    Case(98, "a crash during preparation", "crash-to-prepare", "crashed", r"\(SIGSEGV\) while it prepared"),
    Case(99, "out of memory during preparation", "swell-to-prepare", "crashed", r"\(SIGABRT\) while it prepared"),
    Case(100, "stray bytes on its pipes", "stray-bytes.at.0", "", ""),
    Case(
        101,
        "kills the fork server",
        "kill-preparer.at.0",
        "crashed",
        r"was killed \(SIGKILL\) while",
    ),
    Case(66, "no fault", "fine", "", ""),
    Case(66, "no fault, another run", "fine-too", "", ""),
]
ENDLESS = [
    Case(56, "a loop in C", "spin.at.0", "timeout", r"^stopped after \d+ s of wall time, in spin \(\w+.py:\d+\)"),
    Case(57, "ignores SIGTERM", "deaf.at.0", "timeout", r"^stopped after \d+ s of wall time, in ignore_sigterm"),
]
"""Faults of runs that never end."""
SPAWN_LID = """\
events:
  - when: {time: 0.1}
    do: {spawn: {name: lid, box: [0.1, 4, 1], pose: {x: 2, y: 2}}}
"""


class Session(NamedTuple):
    """Exit code, output folder, results by scenario, and console output of the session."""

    code: int
    out: Path
    runs: dict[str, dict[str, Any]]
    printed: str


@pytest.fixture(scope="session")
def session(tmp_path_factory: pytest.TempPathFactory, texts: dict[str, str]) -> Session:
    home = tmp_path_factory.mktemp("faults")
    blocked = texts["a.scenario.yaml"].replace(
        "goals: [{pose: {x: 1.5, y: 1}}]", "goals: [{pose: {x: 3, y: 1}, timeout: 6 s}]"
    )
    (home / "63-shut.scenario.yaml").write_text(blocked + SPAWN_LID)
    return run_cases(home, texts, CASES)


def run_cases(home: Path, texts: dict[str, str], cases: list[Case], *options: str) -> Session:
    """Run a scenario for each case, and the scenarios that are in the folder `home` already, in one session."""
    for name in ("room.world.yaml", "cube.robot.yaml"):
        (home / name).write_text(texts[name])
    for case in cases:
        tagged = texts["a.scenario.yaml"].replace("seed: 7", f"seed: 7\ntags: [{case.fault}]")
        if case.number == 64:
            tagged += "stack: {localizer: {type: scan_matching_amcl, max_particles: 500}}\n"
        (home / f"{case.number}-{case.fault}.scenario.yaml").write_text(tagged)
    command = [sys.executable, "-c", WITH_FAULTS, "run", ".", "--out", "out", "-j", "2", *options]
    done = subprocess.run(command, cwd=home, capture_output=True, text=True, timeout=300, check=False)
    assert done.stderr == ""
    runs = json.loads((home / "out/results.json").read_text())["runs"]
    return Session(done.returncode, home / "out", {run["scenario"]: run for run in runs}, done.stdout)


@pytest.mark.sample(10)
@pytest.mark.parametrize("case", CASES, ids=lambda case: f"{case.number} {case.name}")
def test_fault_of_a_worker_is_reported_with_its_type(session: Session, case: Case) -> None:
    assert_outcome_of_fault(session, case)


def assert_outcome_of_fault(session: Session, case: Case) -> None:
    run = session.runs[f"{case.number}-{case.fault}"]
    if not case.kind:
        assert (run["outcome"], run["error"]) == ("passed", None)
        return
    assert (run["outcome"], run["error"]["kind"]) == ("error", case.kind)
    assert re.search(case.words, run["error"]["message"])


def test_56_57_run_that_never_ends_is_stopped_at_its_wall_limit(tmp_path: Path, texts: dict[str, str]) -> None:
    session = run_cases(tmp_path, texts, ENDLESS, "--wall-limit", str(WALL_LIMIT_S))
    assert session.code == 3
    for case in ENDLESS:
        assert_outcome_of_fault(session, case)


def test_63_unreachable_goal_is_a_failure_not_an_error(session: Session) -> None:
    run = session.runs["63-shut"]
    assert (run["outcome"], run["error"]) == ("failed", None)


def test_65_every_run_has_one_result_and_aborted_runs_set_the_exit_code(session: Session) -> None:
    assert session.code == 3
    assert len(session.runs) == len(CASES) + 1
    cases = [case for suite in JUnitXml.fromfile(str(session.out / "junit.xml")) for case in suite]
    assert len(cases) == len(CASES) + 1
    assert len({case.name + case.classname for case in cases}) == len(CASES) + 1


def test_52_python_stack_of_a_crash_is_in_log_and_report(session: Session) -> None:
    assert "lockstep.py" in session.runs["52-segfault.at.0"]["error"]["tail"]


def test_60_worker_log_of_excessive_output_is_truncated(session: Session) -> None:
    (log,) = session.out.rglob("60-flood.at.0/*/worker.log")
    assert log.stat().st_size < 2 << 20
    assert log.read_bytes().startswith(b"start of the output\n")


def test_59_no_processes_or_files_are_left_behind(session: Session) -> None:
    commands = [path.read_bytes() for path in Path("/proc").glob("[0-9]*/cmdline") if path.exists()]
    assert [line for line in commands if b"61.5" in line.split(b"\0")] == []


@pytest.mark.parametrize("fault", ["52-segfault.at.0", "53-sigkill.at.0", "54-exit-0.at.0", "61-exception.at.0"])
def test_71_log_of_an_aborted_run_opens_in_all_readers(session: Session, fault: str) -> None:
    from mcap.reader import make_reader

    (log,) = session.out.rglob(f"{fault}/*/run.partial.mcap")
    with log.open("rb") as stream:
        assert make_reader(stream).get_summary() is not None
    assert "its log until then is run.partial.mcap" in session.runs[fault]["error"]["message"]


def test_66_other_runs_have_the_same_logs_as_without_faults(session: Session, log: Path) -> None:
    for name in ("66-fine", "66-fine-too", "60-flood.at.0"):
        (other,) = session.out.rglob(f"{name}/*/run.mcap")
        assert first_difference(read_log(log).trace, read_log(other).trace) is None
