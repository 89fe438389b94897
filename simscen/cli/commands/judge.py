"""`simscen judge`."""

import json
import shlex
import sys
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.diagnostics import escaped, print_text
from simscen.cli.session.judging import LogJudge, runs_without_log
from simscen.cli.session.logs import logs_of
from simscen.cli.session.output_files import verdict
from simscen.core.errors import UsageError
from simscen.core.records.session_events import RunFinished
from simscen.judge.result_json import result_data
from simscen.record.foreign.options import TOPICS, Clock, ForeignLogOptions
from simscen.report.judged_logs import full_log_lines, margin_table, short_log_line, summary_line
from simscen.report.results_json import as_document, in_order
from simscen.report.styled_line import plain_text


class TimeStamps(str, Enum):
    """Time stamp of a message that counts."""

    HEADER = "header"
    LOG = "log"


def command(
    logs: Annotated[
        list[Path],
        typer.Argument(
            help="Logs (run.mcap, *.mcap, rosbag2 folders), or folders to search for logs.",
            autocompletion=completions.logs,
        ),
    ],
    scenario: Annotated[Path | None, typer.Option(help="Use the criteria of this file; it needs only `pass:`.")] = None,
    truth: Annotated[
        str | None,
        typer.Option(help="Ground truth in a foreign log: a topic, or two frames such as map:base_link."),
    ] = None,
    topic: Annotated[
        list[str] | None,
        typer.Option(help="NAME=TOPIC: other name of a standard topic, e.g. odom=/my/odom; repeatable."),
    ] = None,
    time: Annotated[
        TimeStamps, typer.Option(help="Time stamps to use in a foreign log: of the message headers, or of logging.")
    ] = TimeStamps.HEADER,
    tick_rate: Annotated[int, typer.Option(min=1, max=10_000, help="Ticks per second for foreign logs.")] = 1000,
    same_frame: Annotated[
        bool,
        typer.Option("--same-frame", help="Treat the frame of the truth as the map frame although its name differs."),
    ] = False,
    root: Annotated[
        Path | None, typer.Option(help="Root folder; the scenario may only refer to files below it.")
    ] = None,
    world_path: Annotated[
        list[Path] | None, typer.Option(help="Additional folder with worlds and models; repeatable.")
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="Print result.json; for several logs, results.json.")] = False,
) -> None:
    """Evaluate criteria on recorded runs without simulating them.

    A log written by simscen contains the truth, the goals, and the scenario. Use --scenario to try other criteria. In a
    folder, every log is judged. Logs of real robots with the standard ROS 2 topics need --scenario, and --truth for
    criteria that use the true pose. A criterion that the log does not decide is inconclusive, never passed.

    Exit code 0: all criteria hold; 1: one fails or is inconclusive; 2: a log or scenario is unusable; 3: a log could
    not be judged, or one of several logs is unusable; 5: no logs found.
    """
    wanted = wanted_of(truth, topic or [], time, tick_rate, same_frame)
    files = logs_of(logs)
    judging = LogJudge(wanted, scenario, root, world_path or [])
    lost = runs_without_log(logs)
    runs = [*((str(file), judging.judged(file, alone=len(files) + len(lost) == 1)) for file in files), *lost]
    if wanted != ForeignLogOptions() and not judging.foreign:
        judging.notes.append("logs of simscen contain truth and times; options for foreign logs have no effect")
    for note in judging.notes:
        print_text(f"note: {escaped(note)}", sys.stderr)
    if json_:
        options = _options(wanted, scenario, root, world_path or [])
        print(_document([run for _, run in runs], options), end="")
    else:
        _print(runs, scenario is not None)
    sys.exit(verdict([run for _, run in runs]))


def wanted_of(
    truth: str | None, topic: list[str], time: TimeStamps, tick_rate: int, same_frame: bool
) -> ForeignLogOptions:
    """Return how to read a foreign log according to the command-line options. Raises UsageError."""
    clock: Clock = "log" if time is TimeStamps.LOG else "header"
    wanted = ForeignLogOptions(truth, _topics(topic), tick_rate, clock, same_frame)
    _check_truth(wanted)
    return wanted


def _print(runs: list[tuple[str, RunFinished]], one_scenario: bool) -> None:
    if len(runs) == 1:
        lines = list(full_log_lines(runs[0][1], runs[0][0]))
    elif one_scenario:
        lines = [*margin_table(runs), summary_line([run for _, run in runs])]
    else:
        width = max(len(name) for name, _ in runs)
        lines = [
            *(short_log_line(run, f"{name:{width}}") for name, run in runs),
            summary_line([run for _, run in runs]),
        ]
    for line in lines:
        print_text(plain_text(line))


def _document(runs: list[RunFinished], options: list[str]) -> str:
    """Return result.json for one log, results.json for several; `again` is the command that judges the log again."""
    document = {**result_data(runs[0].result)} if len(runs) == 1 else as_document(runs)
    logs = [run.artifacts.mcap for run in in_order(runs)]
    for log, data in zip(logs, document.get("runs", [document]), strict=True):
        if log:
            data["again"] = shlex.join(["simscen", "judge", log, *options])
    return json.dumps(document, sort_keys=True, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _options(wanted: ForeignLogOptions, scenario: Path | None, root: Path | None, world_path: list[Path]) -> list[str]:
    """Return the options of this command that affect the result."""
    given = {"--scenario": scenario, "--truth": wanted.truth, "--root": root}
    several = [("--topic", f"{name}={topic}") for name, topic in wanted.topics.items()]
    several += [("--world-path", str(folder)) for folder in world_path]
    words = [word for name, value in given.items() if value is not None for word in (name, str(value))]
    words += [word for pair in several for word in pair]
    words += ["--time", "log"] if wanted.clock == "log" else []
    words += ["--tick-rate", str(wanted.tick_rate)] if wanted.tick_rate != ForeignLogOptions.tick_rate else []
    return [*words, *(["--same-frame"] if wanted.same_frame else [])]


def _check_truth(wanted: ForeignLogOptions) -> None:
    """Raise UsageError if --truth is malformed or names the belief."""
    if wanted.truth is None:
        return
    if not wanted.truth.startswith("/") and not (wanted.frames and all(wanted.frames)):
        expected = "expected a /topic, or two frames such as map:base_link"
        raise UsageError(f"cannot read --truth: {expected}, got {escaped(wanted.truth) or 'nothing'}")
    if wanted.truth == wanted.topic("amcl_pose"):
        raise UsageError(f"--truth {escaped(wanted.truth)} is the belief of the robot; name an independent source")


def _topics(written: list[str]) -> dict[str, str]:
    """Return the topics by standard name. Raises UsageError."""
    found = {}
    for text in written:
        name, equals, topic = text.partition("=")
        if not equals or name not in TOPICS or not topic.startswith("/"):
            known = ", ".join(TOPICS)
            raise UsageError(f"cannot read --topic {escaped(text)}: expected NAME=/TOPIC with one of {known}")
        found[name] = topic
    return found
