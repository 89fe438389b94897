"""Command `simscen replay`, which writes a page that plays recorded runs."""

import sys
import webbrowser
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.diagnostics import escaped, print_text
from simscen.cli.session.judging import LogJudge
from simscen.cli.session.logs import COMPLETE_LOG, PARTIAL_LOG, find_logs, log_name
from simscen.cli.session.user_files import save
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
from simscen.core.errors import UsageError
from simscen.record.log_reader import invalid_log


def command(
    runs: Annotated[
        list[Path],
        typer.Argument(help="Logs, or folders to search for logs.", autocompletion=completions.logs),
    ],
    against: Annotated[
        Path | None, typer.Option(help="Second run to show beside the first, for example with another seed or stack.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Output file; default: replay.html beside run.mcap, NAME.replay.html beside other logs."),
    ] = None,
    open_: Annotated[bool, typer.Option("--open", help="Open the page in a browser.")] = False,
    scenario: ScenarioOption = None,
    truth: TruthOption = None,
    topic: TopicOption = None,
    time: TimeOption = TimeStamps.HEADER,
    tick_rate: TickRateOption = 1000,
    same_frame: SameFrameOption = False,
    root: RootOption = None,
    world_path: WorldPathOption = None,
) -> None:
    """Write a page that plays a recorded run, or two runs side by side.

    The page shows the sensor readings, pose estimates, and motions of the robot over time, the events, the signals, the
    verdicts, and the text of the scenario. It starts at the time of the failure, or at 0 s without a failure. The page
    is a single file that needs no network. For the log of a real robot, the page lacks data that were not recorded,
    such as the true pose.

    Exit code 0: written; 2: a log is unusable, or the page cannot be written; 5: no logs found.
    """
    from simscen.report.replay import write_replay

    files = find_logs(runs)
    if len(files) > 1 and (against is not None or out is not None):
        option = "--against" if against is not None else "--out"
        raise UsageError(f"{option} takes one run, but {len(files)} were found")
    judging = LogJudge(foreign_log_options(truth, topic, time, tick_rate, same_frame), scenario, root, world_path or [])
    others = [] if against is None else find_logs([against])
    if len(others) > 1:
        raise UsageError(f"--against takes one run, but {escaped(str(against))} contains {len(others)}")
    for file in files:
        prefix = "" if file.name in (COMPLETE_LOG, PARTIAL_LOG) else f"{log_name(file)}."
        page = out or file.with_name(f"{prefix}replay.html")
        recorded_runs = [judging.judge_for_replay(log) for log in (file, *others)]
        try:
            save(page, partial(write_replay, runs=recorded_runs), [file, *others])
        except ValueError as error:  # from the sensor data and the scenery, which are read only here
            raise invalid_log(file, "SC802", f"the log is damaged: {error}") from error
        print_text(escaped(str(page)))
        if open_:
            webbrowser.open(page.resolve().as_uri())
    for note in judging.notes:
        print_text(f"note: {escaped(note)}", sys.stderr)
