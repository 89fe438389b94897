"""`simscen run`."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.session.output_files import JunitFamily
from simscen.cli.session.run_session import Asked, cores, session
from simscen.cli.session.selection import Selection, shard_of
from simscen.cli.session.stacks import STACK_HELP
from simscen.cli.session.terminal import Format
from simscen.cli.session.watch import watched
from simscen.report.journaldata import NAME
from simscen.run.process.jobs import Replays
from simscen.run.session import Options


def command(
    paths: Annotated[
        list[Path], typer.Argument(help="Scenario files, or folders to search.", autocompletion=completions.scenarios)
    ],
    out: Annotated[
        Path | None, typer.Option(help="Output folder, new or empty; default: simscen-out/<run-id>.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option("-j", "--jobs", min=1, max=256, help="Runs at a time; default: one for each core.")
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=1, max=2**32 - 1, help="Use this seed instead of each scenario's own.")
    ] = None,
    repeat: Annotated[
        int, typer.Option(min=1, max=100_000, help="Run each scenario with this many seeds in a row.")
    ] = 1,
    keyword: Annotated[
        str, typer.Option("-k", help='Only ids and variations that match, e.g. "faults and not slip".')
    ] = "",
    tag: Annotated[list[str] | None, typer.Option(help="Only scenarios with this tag; repeatable.")] = None,
    fail_fast: Annotated[
        bool, typer.Option("--fail-fast", "-x", help="Stop after the first run that does not pass.")
    ] = False,
    check_determinism: Annotated[
        bool,
        typer.Option(
            "--check-determinism",
            help="Run everything twice and compare the logs, byte for byte; with the output folder of an earlier "
            "session behind it, as --check-against.",
        ),
    ] = False,
    check_against: Annotated[
        Path | None,
        typer.Option(help="Compare with this output folder of another session or machine."),
    ] = None,
    junit: Annotated[Path | None, typer.Option(help="Write JUnit XML here as well.")] = None,
    junit_family: Annotated[
        JunitFamily, typer.Option(help="xunit2 leaves out what Jenkins' schema forbids.")
    ] = JunitFamily.SIMSCEN,
    format_: Annotated[Format, typer.Option("--format", help="What to print.")] = Format.TEXT,
    wall_limit: Annotated[float, typer.Option(min=1, help="Seconds of wall time that one run may take.")] = 300.0,
    resume: Annotated[
        Path | None, typer.Option(help="Go on in this output folder: only what has no verdict yet, or has changed.")
    ] = None,
    shard: Annotated[str, typer.Option(help="i/n: only every n-th scenario, from the i-th on.")] = "1/1",
    stack: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            autocompletion=completions.stacks,
            help=STACK_HELP + "Repeatable: each scenario runs with each, and the first is compared with the others.",
        ),
    ] = None,
    last_failed: Annotated[
        bool,
        typer.Option(
            "--last-failed",
            "--lf",
            help="Only what failed when it was run last, by the sessions in simscen-out, or beside --out; everything, "
            "where nothing did.",
        ),
    ] = False,
    durations: Annotated[
        int | None, typer.Option(min=0, metavar="N", help="List the N slowest runs in the end; 0 = all.")
    ] = None,
    watch: Annotated[
        bool, typer.Option("--watch", help="Stay, and run again what a saved file touches; keys are told then.")
    ] = False,
    open_: Annotated[
        bool, typer.Option("--open", help="Open the report in a browser, where it follows the runs as they end.")
    ] = False,
    variation: Annotated[
        list[str] | None, typer.Option(help="Only the variation of exactly this name; repeatable.")
    ] = None,
    root: Annotated[Path | None, typer.Option(help="Files inside scenarios stay in this folder.")] = None,
    world_path: Annotated[list[Path] | None, typer.Option(help="Folder with worlds and models; repeatable.")] = None,
    replay: Annotated[
        Replays, typer.Option(help="Which runs get replay.html, a page that plays them; see `simscen replay`.")
    ] = Replays.FAILED,
    lenient: Annotated[
        bool, typer.Option("--lenient", help="Leave out what of an SDF world cannot be used, with a warning.")
    ] = False,
) -> None:
    """Run scenarios and report what passed.

    Everything is validated first; with one bad file nothing is run. Each run leaves its MCAP log, a picture and its
    verdicts in the output folder, and one that failed a page that plays it, beside results.json and junit.xml. Should
    simscen itself be killed, `simscen report` makes these from the journal, and --resume goes on where it stopped.

    Exit code 0: all passed, or failed as expected; 1: a criterion failed, or held although it was expected to fail; 2:
    an invalid scenario or an unusable output folder (nothing was run); 3: a run could not be completed; 5: nothing
    selected, or everything skipped; 129, 130 and 143: interrupted.
    """
    if check_determinism and (earlier := [path for path in paths if (path / NAME).is_file()]):
        paths, check_determinism, check_against = [p for p in paths if p not in earlier], False, earlier[0]
    asked = Asked(
        paths,
        Selection(keyword, tag or [], shard_of(shard), variation or []),
        Options(
            workers or cores(), seed, repeat, check_determinism, fail_fast, wall_limit, check_against, replay=replay
        ),
        root,
        world_path or [],
        lenient,
        stack or [],
        out,
        resume,
        junit,
        junit_family,
        format_,
        durations,
        last_failed,
        open_,
    )
    sys.exit(watched(asked) if watch else session(asked))
