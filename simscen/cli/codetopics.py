"""Numbers and names by which results are told: Nav2's error codes, types of JUnit errors, exit codes."""

from simscen.cli.catalogue import Topic
from simscen.cli.options import EXITS
from simscen.core.errors import BROKEN
from simscen.core.navigation import ErrorCode
from simscen.run.external.errors import CRASHED, FAILED, PROTOCOL, TIMEOUT

NAV2 = {
    ErrorCode.NONE: "Nothing went wrong.",
    ErrorCode.FOLLOW_PATH_UNKNOWN: "The controller failed for a reason that it does not tell.",
    ErrorCode.TF_ERROR: "The controller does not know where the robot is in the frame of its path.",
    ErrorCode.INVALID_PATH: "The controller was given a path that it cannot follow, an empty one for example.",
    ErrorCode.PATIENCE_EXCEEDED: "The controller found no valid command for longer than `failure_tolerance`.",
    ErrorCode.FAILED_TO_MAKE_PROGRESS: "The robot moved less than `progress_checker` asks for in the time it allows.",
    ErrorCode.NO_VALID_CONTROL: "All that the controller tried leads into an obstacle, and `failure_tolerance` is 0.",
    ErrorCode.CONTROLLER_TIMED_OUT: "The controller took too long for a command.",
    ErrorCode.PLANNER_UNKNOWN: "The planner failed for a reason that it does not tell.",
    ErrorCode.START_OUTSIDE_MAP: "The robot believes to be outside of its map.",
    ErrorCode.GOAL_OUTSIDE_MAP: "The goal is outside of the robot's map.",
    ErrorCode.START_OCCUPIED: "The robot believes to stand in an obstacle of its costmap.",
    ErrorCode.GOAL_OCCUPIED: "The goal is in an obstacle of the costmap.",
    ErrorCode.PLANNER_TIMEOUT: "The planner took too long for a plan.",
    ErrorCode.NO_VALID_PATH: "The planner found no way within its iterations.",
    ErrorCode.NO_VIAPOINTS_GIVEN: "There is no pose to go through.",
    ErrorCode.FOLLOW_WAYPOINTS_UNKNOWN: "Following waypoints failed for a reason that is not told.",
    ErrorCode.TASK_EXECUTOR_FAILED: "What was to be done at a waypoint failed.",
    ErrorCode.NO_VALID_WAYPOINTS: "There is no waypoint to go to.",
    ErrorCode.STOP_ON_MISSED_WAYPOINT: "A waypoint was missed, and that ends the task.",
    ErrorCode.SPIN_TIMEOUT: "A spin did not end in the time that it may take.",
    ErrorCode.SPIN_COLLISION_AHEAD: "A spin would have turned the robot into an obstacle.",
    ErrorCode.BACKUP_TIMEOUT: "Backing up, straight or the way it came, took too long: something holds the robot.",
    ErrorCode.BACKUP_INVALID_INPUT: "The robot was told to back up and cannot drive backward.",
    ErrorCode.BACKUP_COLLISION_AHEAD: "Backing up would have led into an obstacle.",
    ErrorCode.NAVIGATE_UNKNOWN: "Navigation failed for a reason that it does not tell.",
    ErrorCode.NAVIGATE_TIMEOUT: "The goal took longer than its `timeout`.",
}
"""Error code → what has happened."""
OF_OTHERS = frozenset({
    ErrorCode.FOLLOW_PATH_UNKNOWN, ErrorCode.TF_ERROR, ErrorCode.INVALID_PATH, ErrorCode.CONTROLLER_TIMED_OUT,
    ErrorCode.PLANNER_UNKNOWN, ErrorCode.PLANNER_TIMEOUT, ErrorCode.NO_VIAPOINTS_GIVEN,
    ErrorCode.FOLLOW_WAYPOINTS_UNKNOWN, ErrorCode.TASK_EXECUTOR_FAILED, ErrorCode.NO_VALID_WAYPOINTS,
    ErrorCode.BACKUP_INVALID_INPUT, ErrorCode.NAVIGATE_UNKNOWN,
})  # fmt: skip
"""Codes with which nothing in the reference stack ends: its planners and controllers have no clock, its planners hand
on no empty path, every robot can drive backward, and goals are checked before a run."""
BY_OTHERS = "The reference stack never ends with it; Nav2, other external stacks and installed components may."

JUNIT = {
    "crashed": "The process of the run ended before it was done.",
    "timeout": "The run took longer than --wall-limit allows.",
    "out-of-memory": "The process of the run was killed for want of memory, or could not get what it asked for.",
    "invalid": "Its files cannot be used, or nothing in it could be judged.",
    "interrupted": "The session was interrupted while this run was going on.",
    "not-run": "The session ended before this run began: it was interrupted, or --fail-fast stopped it.",
    "internal": "A bug in simscen.",
    "diverged": "The physics came to positions or speeds that no robot has.",
    "output": "The log or the result of the run could not be written.",
    "nondeterministic": "Two runs that must be equal were not, with --check-determinism or --check-against.",
    CRASHED: "The process of an external stack ended, could not be started, or hung up.",
    TIMEOUT: "An external stack gave no answer within its limit of wall time.",
    PROTOCOL: "What an external stack said is not what the stack protocol allows.",
    FAILED: "An external stack said itself that it cannot go on.",
    BROKEN: "Something that an installed package adds answered with what is no answer.",
}
"""Type of a JUnit `<error>` → what has happened to the run; none of them is a verdict on the robot."""


def code_topics() -> list[Topic]:
    """Nav2's error codes, JUnit's error types and exit codes."""
    nav2 = [
        Topic("error code", code.name, None, f"Nav2's error code {int(code)}.\n\n{_told(code)}",
              f"error_code: {{code: {code.name}}}", alias=str(int(code)))
        for code in NAV2
    ]  # fmt: skip
    told = "The run could not be completed: a JUnit `<error>`, and exit code 3."
    junit = [Topic("error type", kind, None, f"{text}\n\n{told}") for kind, text in JUNIT.items()]
    exits = [
        Topic("exit code", f"exit {code.value}", None, text, alias=f"{code.value}") for code, text in EXITS.items()
    ]
    return [*nav2, *junit, *exits]


def _told(code: ErrorCode) -> str:
    return f"{NAV2[code]} {BY_OTHERS}" if code in OF_OTHERS else NAV2[code]
