"""Topics of `simscen explain` about Nav2's error codes, JUnit's error types, and exit codes."""

from simscen.cli.catalog.commands_page import EXIT_CODES
from simscen.cli.catalog.topics import Topic
from simscen.core.errors import BROKEN_COMPONENT
from simscen.core.messages.navigation import ErrorCode
from simscen.core.records.run_result import INTERRUPTED, NONDETERMINISTIC, NOT_RUN
from simscen.run.external.protocol import CRASHED, FAILED, PROTOCOL, TIMEOUT

NAV2_ERROR_CODES = {
    ErrorCode.NONE: "No error.",
    ErrorCode.FOLLOW_PATH_UNKNOWN: "The controller failed for an unknown reason.",
    ErrorCode.TF_ERROR: "The controller does not know the pose of the robot in the frame of its path.",
    ErrorCode.INVALID_PATH: "The controller received a path that it cannot follow, for example an empty one.",
    ErrorCode.PATIENCE_EXCEEDED: "The controller found no valid command for longer than `failure_tolerance`.",
    ErrorCode.FAILED_TO_MAKE_PROGRESS: "The robot moved less than `progress_checker` requires within its time.",
    ErrorCode.NO_VALID_CONTROL: "All commands lead to a collision, and `failure_tolerance` is 0.",
    ErrorCode.CONTROLLER_TIMED_OUT: "The controller took too long to compute a command.",
    ErrorCode.PLANNER_UNKNOWN: "The planner failed for an unknown reason.",
    ErrorCode.START_OUTSIDE_MAP: "The estimated pose of the robot is outside of its map.",
    ErrorCode.GOAL_OUTSIDE_MAP: "The goal is outside of the map of the robot.",
    ErrorCode.START_OCCUPIED: "The estimated pose of the robot is in an obstacle of the costmap.",
    ErrorCode.GOAL_OCCUPIED: "The goal is in an obstacle of the costmap.",
    ErrorCode.PLANNER_TIMEOUT: "The planner took too long to compute a plan.",
    ErrorCode.NO_VALID_PATH: "The planner found no path within its maximum number of iterations.",
    ErrorCode.NO_VIAPOINTS_GIVEN: "The list of poses to drive through is empty.",
    ErrorCode.FOLLOW_WAYPOINTS_UNKNOWN: "The waypoint follower failed for an unknown reason.",
    ErrorCode.TASK_EXECUTOR_FAILED: "The task at a waypoint failed.",
    ErrorCode.NO_VALID_WAYPOINTS: "The list of waypoints is empty or invalid.",
    ErrorCode.STOP_ON_MISSED_WAYPOINT: "A waypoint was missed, which ends the task.",
    ErrorCode.SPIN_TIMEOUT: "A spin took longer than allowed.",
    ErrorCode.SPIN_COLLISION_AHEAD: "A spin would have led to a collision.",
    ErrorCode.BACKUP_TIMEOUT: "Backing up or retracing took longer than allowed; something may block the robot.",
    ErrorCode.BACKUP_INVALID_INPUT: "Backing up was requested of a robot that cannot drive backward.",
    ErrorCode.BACKUP_COLLISION_AHEAD: "Backing up would have led to a collision.",
    ErrorCode.NAVIGATE_UNKNOWN: "Navigation failed for an unknown reason.",
    ErrorCode.NAVIGATE_TIMEOUT: "The goal was not reached within its `timeout`.",
}
"""Meaning of Nav2's error codes."""
EXTERNAL_ONLY_CODES = frozenset({
    ErrorCode.FOLLOW_PATH_UNKNOWN, ErrorCode.TF_ERROR, ErrorCode.INVALID_PATH, ErrorCode.CONTROLLER_TIMED_OUT,
    ErrorCode.PLANNER_UNKNOWN, ErrorCode.PLANNER_TIMEOUT, ErrorCode.NO_VIAPOINTS_GIVEN,
    ErrorCode.FOLLOW_WAYPOINTS_UNKNOWN, ErrorCode.TASK_EXECUTOR_FAILED, ErrorCode.NO_VALID_WAYPOINTS,
    ErrorCode.BACKUP_INVALID_INPUT, ErrorCode.NAVIGATE_UNKNOWN,
})  # fmt: skip
"""Codes that the reference stack never returns. BACKUP_INVALID_INPUT is one of them because every robot can reverse."""
EXTERNAL_ONLY_NOTE = "The reference stack never returns this code; Nav2, external stacks, and installed components may."

JUNIT_ERROR_TYPES = {
    "crashed": "The process of the run ended unexpectedly.",
    "timeout": "The run took longer than --wall-limit.",
    "out-of-memory": "The run needed more memory than available, or its process was killed for lack of memory.",
    "invalid": "The files of the run are invalid, or its log contains nothing to evaluate.",
    INTERRUPTED: "The session was interrupted during this run.",
    NOT_RUN: "The session ended before this run started: it was interrupted, or --fail-fast stopped it.",
    "internal": "A bug in simscen.",
    "diverged": "The physics simulation diverged to unrealistic positions or speeds.",
    "output": "The log or the result of the run could not be written.",
    NONDETERMINISTIC: "Two runs that must be equal differ, with --check-determinism or --check-against.",
    CRASHED: "The process of an external stack ended, could not be started, or closed the connection.",
    TIMEOUT: "An external stack did not answer within its wall-clock limit.",
    PROTOCOL: "A message of an external stack violates the stack protocol.",
    FAILED: "An external stack reported that it cannot continue.",
    BROKEN_COMPONENT: "A component of an installed package returned an invalid value.",
}
"""Meaning of each type of the JUnit element `<error>`."""


def code_topics() -> list[Topic]:
    """Return the topics of Nav2's error codes, JUnit's error types, and exit codes."""
    found = []
    for code, meaning in NAV2_ERROR_CODES.items():
        number, example = str(int(code)), f"error_code: {{code: {code.name}}}"
        note = f" {EXTERNAL_ONLY_NOTE}" if code in EXTERNAL_ONLY_CODES else ""
        text = f"Nav2's error code {number}.\n\n{meaning}{note}"
        found.append(Topic("error code", code.name, None, text, example, alias=number))
    for kind, meaning in JUNIT_ERROR_TYPES.items():
        # The exit code of unfinished runs depends on the signal, or on the run for which --fail-fast ended the session.
        exit_code_text = "" if kind in (INTERRUPTED, NOT_RUN) else ", and exit code 3"
        text = f"{meaning}\n\nThe run could not be completed: a JUnit `<error>`{exit_code_text}."
        found.append(Topic("error type", kind, None, text))
    for exit_code, meaning in EXIT_CODES.items():
        found.append(Topic("exit code", f"exit {exit_code.value}", None, meaning, alias=f"{exit_code.value}"))
    return found
