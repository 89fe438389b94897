"""Command-line options that several commands share: options for runs, for reports, and for reading logs."""

from collections.abc import Collection
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.diagnostics import escaped
from simscen.core.errors import UsageError
from simscen.record.foreign.options import TOPICS, ForeignLogOptions, TimeSource
from simscen.run.kept_files import LogRetention, OutcomeFilter


class Format(str, Enum):
    """Output format."""

    TEXT = "text"
    JSON = "json"
    GITHUB = "github"


class TextOrJson(str, Enum):
    """Output format of a simscen command that does not support `--format github`."""

    TEXT = "text"
    JSON = "json"


class JunitFamily(str, Enum):
    """Dialect of JUnit XML."""

    SIMSCEN = "simscen"
    XUNIT2 = "xunit2"


STACK_HELP = (
    "Run every scenario with the stack VALUE instead of its own. NAME is the name of the stack in the results. VALUE "
    "is a command that speaks the stack protocol, a *.stack.yaml file, a Nav2 parameter file, `reference`, another "
    "type of stack, or a name in your configuration. `--stack mine` is short for `--stack mine=mine`. With several "
    "robots, VALUE replaces the stack of each; but if a robot's stack is `external: NAME`, NAME='COMMAND' defines its "
    "command, and the other robots keep their stacks. "
)
FormatOption = Annotated[Format, typer.Option("--format", help="Output format.")]
OutOption = Annotated[Path | None, typer.Option(help="New or empty output folder; default: simscen-out/<session id>.")]
JobsOption = Annotated[
    int | None, typer.Option("-j", "--jobs", min=1, max=256, help="Number of parallel runs; default: one per core.")
]
JunitOption = Annotated[Path | None, typer.Option(help="Also write JUnit XML to this file.")]
JunitFamilyOption = Annotated[
    JunitFamily, typer.Option(help="Dialect of JUnit XML; xunit2 omits what the schema of Jenkins forbids.")
]
ResumeOption = Annotated[
    Path | None,
    typer.Option(
        help="Continue in this output folder: execute runs without a result, with an error, or with changed files."
    ),
]
OpenOption = Annotated[bool, typer.Option("--open", help="Open the report in a browser and update it as runs finish.")]
WallLimitOption = Annotated[float, typer.Option(min=1, max=1e6, help="Wall-clock limit of one run in seconds.")]
StackOption = Annotated[
    str | None, typer.Option(metavar="NAME=VALUE", autocompletion=completions.stacks, help=STACK_HELP)
]
RootOption = Annotated[Path | None, typer.Option(help="Root folder; scenarios may only refer to files below it.")]
WorldPathOption = Annotated[
    list[Path] | None, typer.Option(help="Additional folder with worlds and models; repeatable.")
]
ReplayOption = Annotated[
    OutcomeFilter, typer.Option(help="Runs for which replay.html is written; see `simscen replay`.")
]
KeepLogsOption = Annotated[
    LogRetention,
    typer.Option(help="`failed` keeps logs and pictures only of runs that do not pass; useful for thousands of runs."),
]
LenientOption = Annotated[bool, typer.Option("--lenient", help="Skip unsupported parts of SDF worlds with a warning.")]


class BackendName(str, Enum):
    """Backend that executes the runs."""

    LOCAL = "local"
    RAY = "ray"


BackendOption = Annotated[
    BackendName,
    typer.Option(help="local: this machine; ray: all nodes of a running Ray cluster (needs Ray: pip install ray)."),
]
AddressOption = Annotated[
    str | None,
    typer.Option(
        metavar="HOST:PORT", help="Address of the Ray cluster; default: RAY_ADDRESS, or the cluster of this machine."
    ),
]


@dataclass(frozen=True)
class OutputOptions:
    """Values of the options for the output of a session: --out, --resume, --junit, --junit-family, --format, --open."""

    out: Path | None
    resume: Path | None
    junit: Path | None
    junit_family: JunitFamily
    format_: Format
    open_: bool


class TimeStamps(str, Enum):
    """Source of the time stamp of a message: its header, or the time at which it was logged."""

    HEADER = "header"
    LOG = "log"


ScenarioOption = Annotated[Path | None, typer.Option(help="Use the criteria of this file; it needs only `pass:`.")]
TruthOption = Annotated[
    str | None,
    typer.Option(help="Ground truth in a log of a real robot: a topic, or two frames such as map:base_link."),
]
TopicOption = Annotated[
    list[str] | None,
    typer.Option(help="NAME=TOPIC: other name of a standard topic, e.g. odom=/my/odom; repeatable."),
]
TimeOption = Annotated[
    TimeStamps, typer.Option(help="Time stamps to use in a log of a real robot: of message headers, or of logging.")
]
TickRateOption = Annotated[int, typer.Option(min=1, max=10_000, help="Ticks per second for logs of real robots.")]
SameFrameOption = Annotated[
    bool,
    typer.Option("--same-frame", help="Treat the frame of the truth as the map frame although its name differs."),
]


def foreign_log_options(
    truth: str | None, topics: list[str] | None, time: TimeStamps, tick_rate: int, same_frame: bool
) -> ForeignLogOptions:
    """Return the options for reading a log of a real robot. Raises UsageError if --truth or --topic is invalid."""
    clock: TimeSource = "log" if time is TimeStamps.LOG else "header"
    options = ForeignLogOptions(truth, parse_topics(topics or [], TOPICS), tick_rate, clock, same_frame)
    if truth is not None and not truth.startswith("/") and not (options.frames and all(options.frames)):
        expected = "expected a /topic, or two frames such as map:base_link"
        raise UsageError(f"cannot read --truth: {expected}, got {escaped(truth) or 'nothing'}")
    if truth is not None and truth == options.topic("amcl_pose"):
        raise UsageError(f"--truth {escaped(truth)} is the belief of the robot; name an independent source")
    return options


def parse_topics(arguments: list[str], names: Collection[str]) -> dict[str, str]:
    """Return topics by name from arguments such as "odom=/my/odom".

    Raises UsageError for a malformed argument, and for a name that is not in `names`.
    """
    topics = {}
    for argument in arguments:
        name, equals, topic = argument.partition("=")
        if not equals or name not in names or not topic.startswith("/"):
            known = ", ".join(names)
            raise UsageError(f"cannot read --topic {escaped(argument)}: expected NAME=/TOPIC with one of {known}")
        topics[name] = topic
    return topics
