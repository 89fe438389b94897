"""Fixtures: finished runs, and a session with a passed, a failed, and a crashed run.

The texts of the crashed run contain markup, control characters, and commands of CI systems.
"""

from dataclasses import replace

import pytest

from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.session_events import (
    Artifacts,
    RunFinished,
    RunProgress,
    RunStarted,
    SessionFinished,
    SessionStarted,
)
from simscen.core.records.verdict import Finding, Status, Verdict

PATH = "scenarios/faults/lidar_off.scenario.yaml"


@pytest.fixture
def passed():
    """Return a run that passed."""
    finding = Finding(Status.PASS, "path_length", "9.86 m", "≤ 10.00 m", 0.14, "m", 9.86, 4320, (1.0, 2.0))
    return RunFinished(
        RunResult(
            key=RunKey("navigation/goal", 1),
            path="scenarios/navigation/goal.scenario.yaml",
            outcome=Outcome.PASSED,
            verdicts=(Verdict("path_length", "path_length", "fail", (finding,)),),
            lines=(20,),
            simulated=18.2,
            ended="navigation ended",
            metrics={"path_length": 9.86},
        ),
        wall=0.21,
    )


@pytest.fixture
def failed():
    """Return a run with a violated criterion and a warning."""
    late = Finding(
        status=Status.FAIL,
        what="stopped_within",
        measured="0.84 s",
        limit="≤ 0.50 s after lidar.off",
        margin=-0.34,
        unit="s",
        value=0.84,
        tick=2602,
        place=(2.1, 3.41),
        detail=("drove 0.31 m blind at 0.37 m/s; the newest scan was 0.9 s old",),
    )
    slow = Finding(Status.FAIL, "speed", "0.60 m/s", "≤ 0.50 m/s", -0.1, "m/s", 0.6, 240, (1.0, 1.0))
    return RunFinished(
        RunResult(
            key=RunKey("faults/lidar_off", 7),
            path=PATH,
            outcome=Outcome.FAILED,
            verdicts=(
                Verdict("stopped_within", "stopped_within", "fail", (late,)),
                Verdict("speed", "speed", "warn", (slow,)),
            ),
            lines=(27, 28),
            simulated=31.0,
            ended="navigation ended",
        ),
        wall=0.35,
        artifacts=Artifacts("out/x", "out/x/run.mcap", "out/x/map.png", "out/x/result.json"),
        again=f"simscen run {PATH} --seed 7",
    )


@pytest.fixture
def crashed():
    """Return a run whose worker crashed, with hostile texts."""
    tail = "::error::owned\n##[error]x\n\x1b[31mred\x1b[0m ]]> <script>&\nSegmentation fault"
    return RunFinished(
        RunResult(
            key=RunKey("evil/[red]::error::x", 1),
            path="scenarios/evil/[red]::error::x.scenario.yaml",
            outcome=Outcome.ERROR,
            error=RunFailure("crashed", "crashed: SIGSEGV", tail),
        ),
        wall=1.25,
        again="simscen run evil",
    )


@pytest.fixture
def skipped(passed):
    """Return a skipped run."""
    return replace(passed, result=replace(passed.result, outcome=Outcome.SKIPPED, verdicts=(), lines=()))


@pytest.fixture
def session(passed, failed, crashed):
    """Return the events of a session of three runs."""
    return [
        SessionStarted("0.1.0", 3, 3, 2, "out", ("evil/[red]::error::x", "faults/lidar_off", "navigation/goal")),
        RunStarted(passed.key, passed.result.path, 60.0),
        RunProgress(passed.key, 3.5),
        passed,
        RunStarted(failed.key, failed.result.path, 60.0),
        failed,
        crashed,
        SessionFinished(1, 1, 1, 49.2, 0.5, junit="out/junit.xml", folder="out", page="out/report.html"),
    ]
