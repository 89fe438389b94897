"""Command `simscen judge`, which evaluates criteria on recorded runs."""

import json
import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.diagnostics import escaped, print_json, print_text
from simscen.cli.session.exit_codes import exit_code
from simscen.cli.session.judging import LogJudge, runs_without_log
from simscen.cli.session.logs import find_logs
from simscen.cli.shared_options import (
    RootOption,
    SameFrameOption,
    ScenarioOption,
    TickRateOption,
    TimeOption,
    TimeStamps,
    TopicOption,
    TruthOption,
    WorldPathOption,
    foreign_log_options,
)
from simscen.core.records.session_events import RunFinished
from simscen.judge.result_json import result_data
from simscen.record.foreign.options import ForeignLogOptions
from simscen.report.display_text import StyledLine, escape_ci_commands, plain_text
from simscen.report.judged_logs import full_log_lines, margin_table, short_log_line, summary_line
from simscen.report.results_json import in_order, results_document


def command(
    logs: Annotated[
        list[Path],
        typer.Argument(
            help="Logs (run.mcap, *.mcap, rosbag2 folders), or folders to search for logs.",
            autocompletion=completions.logs,
        ),
    ],
    scenario: ScenarioOption = None,
    truth: TruthOption = None,
    topic: TopicOption = None,
    time: TimeOption = TimeStamps.HEADER,
    tick_rate: TickRateOption = 1000,
    same_frame: SameFrameOption = False,
    root: RootOption = None,
    world_path: WorldPathOption = None,
    json_: Annotated[bool, typer.Option("--json", help="Print result.json; for several logs, results.json.")] = False,
) -> None:
    """Evaluate criteria on recorded runs without simulating them.

    A log written by simscen contains the truth, the goals, and the scenario. Use --scenario to try other criteria. In a
    folder, every log is judged. Logs of real robots with the standard ROS 2 topics need --scenario, and --truth for
    criteria that use the true pose. If a log is not sufficient to decide a criterion, the verdict is inconclusive.

    Exit code 0: all criteria hold; 1: one fails or is inconclusive; 2: a log or scenario is unusable; 3: a log could
    not be judged, or one of several logs is unusable; 5: no logs found.
    """
    foreign = foreign_log_options(truth, topic, time, tick_rate, same_frame)
    files = find_logs(logs)
    judging = LogJudge(foreign, scenario, root, world_path or [])
    without_log = runs_without_log(logs)
    is_only_log = len(files) + len(without_log) == 1
    runs = [*((str(file), judging.judge(file, is_only_log)) for file in files), *without_log]
    if foreign != ForeignLogOptions() and not judging.foreign_count:
        judging.notes.append("logs of simscen contain truth and times; options for logs of real robots have no effect")
    for note in judging.notes:
        print_text(f"note: {escaped(note)}", sys.stderr)
    results = [run for _, run in runs]
    if json_:
        print_json(_document(results, _options(foreign, scenario, root, world_path or [])))
    else:
        for line in _lines(runs, scenario is not None):
            print_text(escape_ci_commands(plain_text(line)))
    sys.exit(exit_code(results))


def _lines(runs: list[tuple[str, RunFinished]], has_same_criteria: bool) -> list[StyledLine]:
    """Return the lines about one result, or a line for each of several results; a table if all have the same criteria.

    `runs` are pairs of the path of a log and its result.
    """
    if len(runs) == 1:
        return list(full_log_lines(runs[0][1], runs[0][0]))
    width = max(len(name) for name, _ in runs)
    rows = margin_table(runs) if has_same_criteria else (short_log_line(run, f"{name:{width}}") for name, run in runs)
    return [*rows, summary_line([run for _, run in runs])]


def _document(runs: list[RunFinished], options: list[str]) -> str:
    """Return the JSON text: result.json for one log, results.json for several logs.

    The value of `again` is the command that evaluates the log again. `options` are the options of this command.
    """
    document = {**result_data(runs[0].result)} if len(runs) == 1 else results_document(runs)
    logs = [run.artifacts.mcap for run in in_order(runs)]
    for log, data in zip(logs, document.get("runs", [document]), strict=True):
        if log:
            data["again"] = shlex.join(["simscen", "judge", log, *options])
    return json.dumps(document, sort_keys=True, indent=2, ensure_ascii=False, allow_nan=False)


def _options(foreign: ForeignLogOptions, scenario: Path | None, root: Path | None, world_path: list[Path]) -> list[str]:
    """Return the command-line options with which `simscen judge` gives the same result."""
    single = {"--scenario": scenario, "--truth": foreign.truth, "--root": root}
    repeated = [("--topic", f"{name}={topic}") for name, topic in foreign.topics.items()]
    repeated += [("--world-path", str(folder)) for folder in world_path]
    words = [word for name, value in single.items() if value is not None for word in (name, str(value))]
    words += [word for pair in repeated for word in pair]
    words += ["--time", "log"] if foreign.clock == "log" else []
    words += ["--tick-rate", str(foreign.tick_rate)] if foreign.tick_rate != ForeignLogOptions.tick_rate else []
    return [*words, *(["--same-frame"] if foreign.same_frame else [])]
