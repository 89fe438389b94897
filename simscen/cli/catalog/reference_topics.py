"""Numbers and names by which results are told: Nav2's error codes, types of JUnit errors, exit codes."""

from collections.abc import Iterator, Sequence

from pydantic import BaseModel

from simscen.cli.catalog.commands_page import EXITS
from simscen.cli.catalog.json_schema import MODELS
from simscen.cli.catalog.topics import OPTIONAL, Field, Topic, added_topics, fields_of, topics
from simscen.core.errors import BROKEN_COMPONENT
from simscen.core.messages.navigation import ErrorCode
from simscen.criteria.plugin_metric import AnyMeasure
from simscen.criteria.trace_signals.catalog import SIGNALS, Signal
from simscen.judge.metrics.catalog import METRICS, Metric
from simscen.loading.codes import CODES
from simscen.loading.schema.lookup import models_at
from simscen.run.external.protocol import CRASHED, FAILED, PROTOCOL, TIMEOUT
from simscen.spec.choice import Choice

NAV2_ERROR_CODES = {
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
EXTERNAL_ONLY_CODES = frozenset({
    ErrorCode.FOLLOW_PATH_UNKNOWN, ErrorCode.TF_ERROR, ErrorCode.INVALID_PATH, ErrorCode.CONTROLLER_TIMED_OUT,
    ErrorCode.PLANNER_UNKNOWN, ErrorCode.PLANNER_TIMEOUT, ErrorCode.NO_VIAPOINTS_GIVEN,
    ErrorCode.FOLLOW_WAYPOINTS_UNKNOWN, ErrorCode.TASK_EXECUTOR_FAILED, ErrorCode.NO_VALID_WAYPOINTS,
    ErrorCode.BACKUP_INVALID_INPUT, ErrorCode.NAVIGATE_UNKNOWN,
})  # fmt: skip
"""Codes with which nothing in the reference stack ends: its planners and controllers have no clock, its planners hand
on no empty path, every robot can drive backward, and goals are checked before a run."""
EXTERNAL_ONLY_NOTE = "The reference stack never ends with it; Nav2, other external stacks and installed components may."

JUNIT_ERROR_TYPES = {
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
    BROKEN_COMPONENT: "Something that an installed package adds answered with what is no answer.",
}
"""Type of a JUnit `<error>` → what has happened to the run; none of them is a verdict on the robot."""


def code_topics() -> list[Topic]:
    """Nav2's error codes, JUnit's error types and exit codes."""
    nav2 = [
        Topic("error code", code.name, None, f"Nav2's error code {int(code)}.\n\n{_error_code_text(code)}",
              f"error_code: {{code: {code.name}}}", alias=str(int(code)))
        for code in NAV2_ERROR_CODES
    ]  # fmt: skip
    told = "The run could not be completed: a JUnit `<error>`, and exit code 3."
    junit = [Topic("error type", kind, None, f"{text}\n\n{told}") for kind, text in JUNIT_ERROR_TYPES.items()]
    exits = [
        Topic("exit code", f"exit {code.value}", None, text, alias=f"{code.value}") for code, text in EXITS.items()
    ]
    return [*nav2, *junit, *exits]


def _error_code_text(code: ErrorCode) -> str:
    return f"{NAV2_ERROR_CODES[code]} {EXTERNAL_ONLY_NOTE}" if code in EXTERNAL_ONLY_CODES else NAV2_ERROR_CODES[code]


CLOCK = """\
A signal has one value for each sample of the truth (`physics: truth_rate`, 40 Hz by default), and it is the same from
the run and from its log. What comes more rarely (belief, command, scans, plans) is held from when it came until the
next one comes; its first value holds before it. What lasts for less than a sample counts at the sample that follows it.
A signal that is not a number makes the verdict an error that names signal and time; one that was not recorded leaves it
inconclusive. Derivatives are differences over the time between two samples; being carried elsewhere (`kidnap`) is no
motion."""


def signal_topics() -> list[Topic]:
    """The list of all, then each."""
    rows = tuple(Field(name, kind(signal), OPTIONAL, signal.text) for name, signal in SIGNALS.items())
    every = [Topic("signal", name, None, text_of(signal), example(name, signal)) for name, signal in SIGNALS.items()]
    return [Topic("signal", "signals", None, CLOCK, rows=rows), *every]


def kind(signal: Signal) -> str:
    """What its values are: "length in m", "number", "yes or no"."""
    return f"{signal.dimension} in {signal.unit}" if signal.unit else signal.dimension


def text_of(signal: Signal) -> str:
    """What it is, its unit, and what it is about."""
    return (
        f"{signal.text}\n\nIt is a {kind(signal)}.{_keys(signal)}"
        if not signal.is_boolean
        else signal.text + _keys(signal)
    )


def example(name: str, signal: Signal) -> str:
    """A condition that uses it."""
    about = "".join(
        f", {key}: {_EXAMPLES[key]}" for key in (*signal.required_arguments[:1], *signal.optional_arguments)
    )
    bound = "" if signal.is_boolean else f', op: "<=", value: 1.5 {signal.unit}'.rstrip()
    return f"{{signal: {name}{about}{bound}}}"


_EXAMPLES = {
    "object": "cart",
    "region": "dock",
    "fault": "lidar.off",
    "event": "cart appears",
    "goal": "shelf",
    "recovery": "spin",
    "with": "cart",
}


def _keys(signal: Signal) -> str:
    needed = (
        f" Needs {' or '.join(f'`{key}`' for key in signal.required_arguments)}." if signal.required_arguments else ""
    )
    return needed + "".join(f" May name one: `{key}`." for key in signal.optional_arguments)


def signals_page() -> str:
    """The body of docs/reference/signals.md."""
    head = "| signal | what | unit | about |\n|---|---|---|---|"
    rows = [
        f"| `{name}` | {signal.text} | {signal.unit or signal.dimension} | {_cell(signal)} |"
        for name, signal in SIGNALS.items()
    ]
    intro = "# Signals\n\nWhat [temporal criteria](../guides/temporal-criteria.md) speak of."
    return "\n".join([f"{intro} `simscen explain signals` tells the same.\n\n{CLOCK}\n\n{head}", *rows]) + "\n"


def _cell(signal: Signal) -> str:
    names = [f"`{key}`" for key in signal.required_arguments] + [f"(`{key}`)" for key in signal.optional_arguments]
    return " or ".join(names)


REPORTED = """\
Every run reports these numbers in result.json, whether a criterion asks for them or not; they are computed from the
trace, so that `simscen judge` of its log gives the same. They are of the truth unless they say otherwise. Where a
number is not defined (a robot that never moved has no smoothness) it is null, and `undefined` says why. Being carried
elsewhere (`kidnap`) is neither driving nor turning. What people feel when a robot comes near (`intrusion_*`) is left
out: there are no people to ask yet."""

CAVEATS = """\
SPARC and LDLJ are reported, and nothing is judged by them unless a `smoothness` criterion asks. SPARC hardly notices a
stop of 2 s but sees a slow wobble; LDLJ sees the stop; both drift with the duration of a drive. Compare them only
between drives of the same way. NEES of one run is a mean over correlated errors; the bounds of the chi-square
distribution hold for a mean over runs at a fixed time, as `simscen bench nav` takes it."""

SESSION = """\
A session reports in results.json under `suite` (`suites` by name for several `--stack`), and `simscen report DIR`
prints: `runs`, without the second runs of `--check-determinism`; `success_rate` with its 95 %
Wilson interval, of all runs, those with errors included; `spl` and `soft_spl`, means over the runs that have them
(`spl_runs` of them); `collisions_per_km` and `collisions_per_hour` over `kilometers` driven and `hours` simulated of
the `measured_runs` that came to their end. Each of several robots of a run drives, collides and has an SPL of its own;
the run succeeds where all do. With several stacks (`--stack`), `simscen report` prints these for each,
and `comparison` holds, for each stack against the first (`baseline`): `pairs` of the same scenario and seed, what was
`left_out`, `flips` (passed with one, failed with the other) with McNemar's exact `flips_p`, and `differences` of time,
way, clearance, jerk, standing, replans, recoveries, collisions (of each robot: `a/collisions`) and the metrics of
installed packages: `difference` is the mean over pairs, `interval` its 95 % bootstrap interval (from five pairs on),
`p` the sign test."""


def metric_topics(installed: bool = False) -> list[Topic]:
    """The list of all, then each; with those that `installed` packages add, if asked."""
    rows = tuple(Field(name, metric.unit or "number", OPTIONAL, metric.text) for name, metric in METRICS.items())
    every = [Topic("metric", name, None, _metric_text(metric)) for name, metric in METRICS.items()]
    return [
        Topic("metric", "metrics", None, f"{REPORTED}\n\n{CAVEATS}\n\n{SESSION}", rows=rows),
        *every,
        *added_topics(AnyMeasure, installed),
    ]


def metrics_page() -> str:
    """The body of docs/reference/metrics.md."""
    rows = [
        f"| `{name}` | {metric.unit} | {metric.text.replace('|', chr(92) + '|')} | {metric.source} |"
        for name, metric in METRICS.items()
    ]
    head = "| metric | unit | definition | source |\n|---|---|---|---|"
    table = "\n".join([head, *rows])
    intro = "# Metrics\n\n`simscen explain metrics` tells the same."
    return f"{intro}\n\n{REPORTED}\n\n{table}\n\n{CAVEATS}\n\n## Of a session\n\n{SESSION}\n"


def _metric_text(metric: Metric) -> str:
    unit = f"\n\nIts unit is {metric.unit}." if metric.unit else ""
    return metric.text + unit + (f"\n\nSource: {metric.source}." if metric.source else "")


def everything() -> list[Topic]:
    """Every topic, in the order of the overview; codes of problems apart."""
    return [*topics(installed=True), *signal_topics(), *metric_topics(installed=True), *code_topics()]


def known_names(keys: bool = False) -> list[str]:
    """What there is to explain, in order; with `keys` the paths of keys instead."""
    found = everything()
    return keys_of_topics(found) if keys else [*dict.fromkeys(topic.name for topic in found), *CODES]


# MERGED: What a single key means, by its path: `goals.pose`, `amcl.update_min_a`, `stack.localizer.alpha1`.
def key_topics(path: str, known: Sequence[Topic]) -> list[Topic]:
    """Every key that a path may mean: below a topic, or from the top of a file; a bare key means it wherever it is."""
    parts = path.split(".")
    if len(parts) == 1:
        found = [
            _key(f"{topic.name}.{path}", field, ()) for topic in known for field in topic.fields if field.key == path
        ]
    else:
        found = [topic for model, keys in _starts(parts, known) for topic in _below(model, keys, path)]
        name, _, key = path.rpartition(".")
        listed = [row for topic in known if topic.name == name for row in topic.rows if row.key == key]
        found += [_key(path, row, ()) for row in listed]
    return list({(topic.name, topic.text): topic for topic in found}.values())


def keys_of_topics(known: Sequence[Topic]) -> list[str]:
    """The paths of all keys of all topics."""
    return [f"{topic.name}.{field.key}" for topic in known for field in topic.fields]


def _starts(parts: list[str], known: Sequence[Topic]) -> Iterator[tuple[type[BaseModel], list[str]]]:
    for length in (1, 2):
        prefix, keys = ".".join(parts[:length]), parts[length:]
        for topic in known:
            if keys and topic.model is not None and prefix in (topic.name, f"{topic.group}.{topic.name}"):
                yield topic.model, keys
    for model in MODELS.values():
        yield model, parts


def _below(model: type[BaseModel], keys: list[str], path: str) -> Iterator[Topic]:
    """The last of `keys` below a model, with the keys of what stands there where that is one mapping."""
    *above, key = keys
    for holder in models_at(model, _with_items(model, above)):
        for field in fields_of(holder):
            if field.key == key:
                within = models_at(holder, _with_items(holder, [key]))
                rows = fields_of(within[0]) if len(within) == 1 and not issubclass(within[0], Choice) else []
                yield _key(path, field, tuple(rows))


def _with_items(model: type[BaseModel], keys: list[str]) -> list[str | int]:
    """The keys with a number behind each that holds a list."""
    way: list[str | int] = []
    for key in keys:
        way.append(key)
        if not models_at(model, way) or models_at(model, [*way, 0]) != models_at(model, way):
            way.append(0)
    return way


def _key(path: str, field: Field, rows: tuple[Field, ...]) -> Topic:
    needed = (
        "required" if not field.default else "optional" if field.default == OPTIONAL else f"default {field.default}"
    )
    text = f"{field.text}\n\n{field.kind} ({needed})" if field.text else f"{field.kind} ({needed})"
    return Topic("key", path, None, text, rows=rows)
