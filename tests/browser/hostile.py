"""Log in which each name contains HTML and escape sequences."""

from simscen.core.geometry import Pose2
from simscen.core.messages.goals import Goal
from simscen.core.records.case import Case
from simscen.core.records.run_result import RunKey, RunResult
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.outcome import outcome_of_verdicts
from simscen.record.log_header import LogHeader
from simscen.record.log_reader import Log
from simscen.testing.synthetic_trace import synthetic_trace

MARKUP = "</script><img src=x onerror=pwned()>\u202eevil\u2066 \x1b[31m{{data}}"
TEXT = f'simscen: 1\nname: "{MARKUP}"\n# --> ]]> <!-- <script>pwned()</script>\n'


def hostile_log() -> tuple[Log, RunResult]:
    """Return the log and a failed result."""
    trace = synthetic_trace(
        {
            "seconds": 4,
            "truth": [[0, 0, 0], [4, 2, 0]],
            "events": [
                [0.5, "goal.accepted", MARKUP, {"x": 2.0, "y": 0.0}],
                [1, "mark", MARKUP, {"note": MARKUP}],
                [2, "object.spawned", MARKUP, {"x": 1.0, "y": 1.0, "yaw": 0.0, "shape": MARKUP, "size": []}],
                [3, "fault.started", MARKUP, {"entry": 0, "sensor": MARKUP, "fault": MARKUP}],
            ],
            "objects": {MARKUP: [[0, 1, 1], [4, 2, 1]]},
        }
    )
    case = Case(Pose2(0, 0), (Goal(MARKUP, Pose2(2, 0)),), regions={MARKUP: ((0, 0), (1, 0), (1, 1))})
    header = LogHeader(MARKUP, 1, case, TEXT, facts={"stack": MARKUP, "variation": MARKUP})
    finding = Finding(Status.FAIL, MARKUP, MARKUP, MARKUP, -1.0, "m", 2.0, 480, (1.0, 0.0), (MARKUP,))
    verdicts = (Verdict(MARKUP, MARKUP, "fail", (finding,)),)
    result = RunResult(
        RunKey(MARKUP, 1, MARKUP, MARKUP), MARKUP, outcome_of_verdicts(verdicts), verdicts, ended=MARKUP, simulated=4.0
    )
    return Log(header, trace, "", True), result
