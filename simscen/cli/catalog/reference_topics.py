"""Topics of `simscen explain` and reference pages about signals, metrics, error codes, and exit codes."""

from simscen.cli.catalog.commands_page import EXIT_CODES
from simscen.cli.catalog.fields import OPTIONAL, Field
from simscen.cli.catalog.topics import Topic, installed_types
from simscen.core.errors import BROKEN_COMPONENT
from simscen.core.messages.navigation import ErrorCode
from simscen.criteria.base import AnyMeasure
from simscen.criteria.trace_signals.catalog import SIGNALS, Signal
from simscen.judge.metrics.catalog import METRICS, Metric
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
"""Codes that the reference stack never returns."""
EXTERNAL_ONLY_NOTE = "The reference stack never returns this code; Nav2, external stacks, and installed components may."

JUNIT_ERROR_TYPES = {
    "crashed": "The process of the run ended unexpectedly.",
    "timeout": "The run took longer than --wall-limit.",
    "out-of-memory": "The run needed more memory than available, or its process was killed for lack of memory.",
    "invalid": "The files of the run are invalid, or its log contains nothing to evaluate.",
    "interrupted": "The session was interrupted during this run.",
    "not-run": "The session ended before this run started: it was interrupted, or --fail-fast stopped it.",
    "internal": "A bug in simscen.",
    "diverged": "The physics simulation diverged to unrealistic positions or speeds.",
    "output": "The log or the result of the run could not be written.",
    "nondeterministic": "Two runs that must be equal differ, with --check-determinism or --check-against.",
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
        text = f"{meaning}\n\nThe run could not be completed: a JUnit `<error>`, and exit code 3."
        found.append(Topic("error type", kind, None, text))
    for exit_code, meaning in EXIT_CODES.items():
        found.append(Topic("exit code", f"exit {exit_code.value}", None, meaning, alias=f"{exit_code.value}"))
    return found


SIGNALS_TEXT = """\
- A signal has one value per sample of the truth (`physics: truth_rate`, 40 Hz by default). Its values are the same in
  the run and in its log.
- Data with a lower rate (belief, command, scans, plans) keeps its value until the next message. The first value also
  holds before it.
- An event that is shorter than a sample counts at the next sample.
- Derivatives are differences between two samples, divided by the time between them.
- A jump by `kidnap` does not count as motion.
- If a value is not a number, the verdict is an error that names the signal and the time. If the signal was not
  recorded, the verdict is inconclusive."""


def signal_topics() -> list[Topic]:
    """Return a topic that lists all signals, then a topic for each signal."""
    rows = tuple(Field(name, _signal_kind(signal), OPTIONAL, signal.text) for name, signal in SIGNALS.items())
    single = [
        Topic("signal", name, None, _signal_description(signal), _signal_example(name, signal))
        for name, signal in SIGNALS.items()
    ]
    return [Topic("signal", "signals", None, SIGNALS_TEXT, rows=rows), *single]


def _signal_kind(signal: Signal) -> str:
    """Return the kind of the values of a signal, such as "length in m", "number", or "yes or no"."""
    return f"{signal.dimension} in {signal.unit}" if signal.unit else signal.dimension


def _signal_description(signal: Signal) -> str:
    """Return the description of a signal, with its unit and arguments."""
    text = signal.text if signal.is_boolean else f"{signal.text}\n\nIt is a {_signal_kind(signal)}."
    if signal.alternative_arguments:
        text += f" Needs {' or '.join(f'`{key}`' for key in signal.alternative_arguments)}."
    return text + "".join(f" Optional argument: `{key}`." for key in signal.optional_arguments)


def _signal_example(name: str, signal: Signal) -> str:
    """Return a YAML example of a condition with this signal."""
    keys = (*signal.alternative_arguments[:1], *signal.optional_arguments)
    arguments = "".join(f", {key}: {_EXAMPLE_ARGUMENTS[key]}" for key in keys)
    bound = "" if signal.is_boolean else f', op: "<=", value: 1.5 {signal.unit}'.rstrip()
    return f"{{signal: {name}{arguments}{bound}}}"


_EXAMPLE_ARGUMENTS = {
    "object": "cart",
    "region": "dock",
    "fault": "lidar.off",
    "event": "cart appears",
    "goal": "shelf",
    "recovery": "spin",
    "with": "cart",
}


_SIGNALS_INTRO = """\
A signal is a quantity of a run over time, such as the speed of the robot. This page lists all signals; `simscen explain
signals` prints the same. Use them in [temporal criteria](../guides/temporal-criteria.md):

```yaml
pass:
  - always: {signal: distance_to, object: cart, op: ">=", value: 0.5 m}
```

Arguments in parentheses are optional. *True* values are those of the simulator, not the estimates of the stack.
"""


def signals_page() -> str:
    """Return the text of docs/reference/signals.md."""
    head = "| signal | meaning | unit | arguments |\n|---|---|---|---|"
    rows = []
    for name, signal in SIGNALS.items():
        arguments = [f"`{key}`" for key in signal.alternative_arguments]
        arguments += [f"(`{key}`)" for key in signal.optional_arguments]
        unit = signal.unit or signal.dimension
        rows.append(f"| `{name}` | {signal.text} | {unit} | {' or '.join(arguments)} |")
    sampling = f"\n## Values of a signal\n\n{SIGNALS_TEXT}\n"
    return "\n".join([f"# Signals\n\n{_SIGNALS_INTRO}\n{head}", *rows, sampling])


METRICS_TEXT = """\
- Metrics do not depend on the criteria. They are computed from the trace, the recorded data of the run, so
  `simscen judge` returns the same numbers for its log.
- Metrics refer to the true state of the robot unless noted otherwise.
- A number that is not defined is null, for example the smoothness of a robot that never moved; `undefined` contains
  the reason.
- A jump by `kidnap` counts neither as driving nor as turning.
- `intrusion_*` are computed from distances alone. They do not measure how safe people feel near a robot."""

METRICS_CAVEATS = """\
- SPARC and LDLJ affect the verdict only with a `smoothness` criterion. SPARC shows a slow wobble, but hardly a
  stop of 2 s; LDLJ shows the stop. Both depend on the duration: compare them only between drives on the same route.
- The errors within a run are correlated, so the bounds of the chi-square distribution do not apply to its NEES.
  They apply to a mean over runs at a fixed time, as computed by `simscen bench nav`."""

SESSION_METRICS_TEXT = """\
A session reports these numbers in results.json under `suite`, and `simscen report DIR` prints them. With several
`--stack`, `suites` contains them for each stack:

- `runs`: number of runs, without the second runs of `--check-determinism`.
- `success_rate`: share of successful runs in all runs, including errors, with its 95 % Wilson interval.
- `spl`, `soft_spl`: means over the runs that have these metrics. `spl_runs` is their number.
- `collisions_per_km`, `collisions_per_hour`: collisions per driven kilometer and per simulated hour. `measured_runs` is
  the number of completed runs, and `kilometers` and `hours` are their sums.

In a run with several robots, each robot has its own distance, collisions, and SPL. The run succeeds if all robots do.

With several `--stack`, `comparison` compares each stack with the first one (`baseline`):

- `pairs`: number of pairs of runs with the same scenario and seed. `left_out` counts the `broken_pairs`, in which a run
  was not completed, and the `runs_without_partner`.
- `flips`: pairs that passed with one stack and failed with the other; `flips_p` is from McNemar's exact test.
- `differences`: for each metric, the mean `difference` over pairs, its 95 % bootstrap `interval` (from five pairs on),
  and `p` from Wilcoxon's signed-rank test.

The compared metrics are time, path length, clearance, jerk, standing time, replans, recoveries, collisions (of each
robot: `a/collisions`), and those of installed packages."""


def metric_topics(installed: bool = False) -> list[Topic]:
    """Return a topic that lists all metrics, then a topic for each metric.

    `installed` adds the metrics of installed packages.
    """
    rows = tuple(Field(name, metric.unit or "number", OPTIONAL, metric.text) for name, metric in METRICS.items())
    single = [Topic("metric", name, None, _metric_text(metric)) for name, metric in METRICS.items()]
    return [
        Topic("metric", "metrics", None, f"{METRICS_TEXT}\n\n{METRICS_CAVEATS}\n\n{SESSION_METRICS_TEXT}", rows=rows),
        *single,
        *installed_types(AnyMeasure.group, installed),
    ]


def metrics_page() -> str:
    """Return the text of docs/reference/metrics.md."""
    lines = []
    for name, metric in METRICS.items():
        if name in _METRIC_GROUPS:
            lines += [f"\n## {_METRIC_GROUPS[name]}\n", "| metric | unit | definition | source |", "|---|---|---|---|"]
        definition = metric.text.replace("|", chr(92) + "|")
        lines.append(f"| `{name}` | {metric.unit} | {definition} | {metric.source} |")
    tables = "\n".join(lines)
    statistics = "[Statistics](statistics.md) explains the intervals and tests."
    session = f"## Metrics of a session\n\n{SESSION_METRICS_TEXT}\n\n{statistics}\n"
    notes = f"## Notes on single metrics\n\n{METRICS_CAVEATS}\n"
    return f"# Metrics\n\n{_METRICS_INTRO}\n\n{METRICS_TEXT}\n{tables}\n\n{notes}\n{session}"


_METRICS_INTRO = """\
A metric is one number of a run, such as the length of its path. This page defines the metrics that every run reports in
`result.json`, and the [metrics of a session](#metrics-of-a-session). `simscen explain metrics` prints the same."""
_METRIC_GROUPS = {
    "success": "Success and time",
    "path_length": "Path",
    "max_speed": "Motion",
    "min_clearance": "Clearance, pedestrians, and collisions",
    "replans": "Replans and recoveries",
    "ape_trans_rmse": "Localization",
}
"""Headings of docs/reference/metrics.md, by the first metric below each."""


def _metric_text(metric: Metric) -> str:
    unit = f"\n\nIts unit is {metric.unit}." if metric.unit else ""
    return metric.text + unit + (f"\n\nSource: {metric.source}." if metric.source else "")
