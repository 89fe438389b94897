"""A log with HTML and escape sequences in every name."""

from simscen.core.geometry import Pose2
from simscen.core.messages.goals import Goal
from simscen.core.records.case import Case
from simscen.core.records.run_result import RunKey, RunResult
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.outcome import outcome_of_verdicts
from simscen.record.log_header import LogHeader
from simscen.record.log_reader import Log
from simscen.testing.synthetic_trace import synthetic_trace

EVIL = "</script><img src=x onerror=pwned()>\u202eevil\u2066 \x1b[31m{{data}}"
TEXT = f'simscen: 1\nname: "{EVIL}"\n# --> ]]> <!-- <script>pwned()</script>\n'


def hostile_log() -> tuple[Log, RunResult]:
    """Return the log and a failed result."""
    trace = synthetic_trace(
        {
            "seconds": 4,
            "truth": [[0, 0, 0], [4, 2, 0]],
            "events": [
                [0.5, "goal.accepted", EVIL, {"x": 2.0, "y": 0.0}],
                [1, "mark", EVIL, {"note": EVIL}],
                [2, "object.spawned", EVIL, {"x": 1.0, "y": 1.0, "yaw": 0.0, "shape": EVIL, "size": []}],
                [3, "fault.started", EVIL, {"entry": 0, "sensor": EVIL, "fault": EVIL}],
            ],
            "objects": {EVIL: [[0, 1, 1], [4, 2, 1]]},
        }
    )
    case = Case(Pose2(0, 0), (Goal(EVIL, Pose2(2, 0)),), regions={EVIL: ((0, 0), (1, 0), (1, 1))})
    header = LogHeader(EVIL, 1, case, TEXT, facts={"stack": EVIL, "variation": EVIL})
    finding = Finding(Status.FAIL, EVIL, EVIL, EVIL, -1.0, "m", 2.0, 480, (1.0, 0.0), (EVIL,))
    verdicts = (Verdict(EVIL, EVIL, "fail", (finding,)),)
    result = RunResult(
        RunKey(EVIL, 1, EVIL, EVIL), EVIL, outcome_of_verdicts(verdicts), verdicts, ended=EVIL, simulated=4.0
    )
    return Log(header, trace, "", True), result
