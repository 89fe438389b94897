"""Command `simscen shrink`, which writes the smallest scenario that still fails in the same way."""

import shlex
import sys
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.diagnostics import escaped, paths_from_working_folder, print_text
from simscen.cli.session.backends import backend_of, workers_and_cluster
from simscen.cli.session.file_checks import FileChecker
from simscen.cli.session.shrinking import BudgetSpent, CandidateRuns, Failure, Shrinker, Stopped, failure_of
from simscen.cli.session.stacks import parse_stacks
from simscen.cli.session.user_files import require_writable, save
from simscen.cli.shared_options import (
    AddressOption,
    BackendName,
    BackendOption,
    JobsOption,
    LenientOption,
    RootOption,
    WallLimitOption,
    WorldPathOption,
)
from simscen.core.errors import Exit, UsageError
from simscen.core.records.run_result import RunResult
from simscen.loading.files.discovery import default_root, sibling
from simscen.loading.reduction import changed_values, removed_parts, with_inline_world, with_only_criterion
from simscen.loading.scenario import ChangedScenario
from simscen.loading.yaml.tree import MappingNode, Node, ScalarNode, child, nodes_with_keys
from simscen.report.journal_reader import JOURNAL_FILE, read_journal
from simscen.run.sessions.output_folder import RUNS_FOLDER, write_atomically
from simscen.run.sessions.results import display_path
from simscen.run.sessions.run_session import SessionOptions


def command(
    run: Annotated[
        Path,
        typer.Argument(
            help="Folder of a failed run in an output folder, or a scenario file.", autocompletion=completions.scenarios
        ),
    ],
    seed: Annotated[
        int | None, typer.Option(min=1, max=2**32 - 1, help="Seed of the failed run of a scenario file.")
    ] = None,
    variation: Annotated[str, typer.Option(help="Variation of the failed run of a scenario file.")] = "",
    stack: Annotated[
        str | None,
        typer.Option(metavar="NAME=VALUE", autocompletion=completions.stacks, help="Stack, as for `simscen run`."),
    ] = None,
    criterion: Annotated[
        str, typer.Option(help="Id of the criterion that must still fail; default: the first one that failed.")
    ] = "",
    keep: Annotated[
        float,
        typer.Option(min=0, max=1, help="Part of the violation that must remain: 0.5 is half of it."),
    ] = 0.5,
    out: Annotated[
        Path | None, typer.Option(help="File to write; default: NAME.minimal.scenario.yaml beside the scenario.")
    ] = None,
    runs: Annotated[int, typer.Option(min=1, max=100_000, help="Maximum number of runs.")] = 500,
    workers: JobsOption = None,
    backend: BackendOption = BackendName.LOCAL,
    address: AddressOption = None,
    keep_world: Annotated[
        bool, typer.Option("--keep-world", help="Keep the world file instead of writing its needed parts inline.")
    ] = False,
    wall_limit: WallLimitOption = 300.0,
    root: RootOption = None,
    world_path: WorldPathOption = None,
    lenient: LenientOption = False,
) -> None:
    """Find the smallest scenario that still fails in the same way.

    Removes parts of the scenario, such as events, faults, people, obstacles, and goals, in groups and one by one. The
    same criterion must still fail, with at least the fraction --keep of its violation. Then numbers are rounded. The
    result is a normal scenario file in which unchanged parts keep their comments. The result does not depend on the
    number of parallel runs.

    Exit code 0: the file was written; 1: it was written, but --runs did not suffice; 2: invalid options, or the run did
    not fail; 3: the run could not be completed; 129, 130, and 143: interrupted.
    """
    chosen = _chosen_run(run, seed, variation, stack)
    root_folder = root or default_root([chosen.file])
    stacks = parse_stacks([] if chosen.stack is None else [chosen.stack], root_folder, world_path or ())
    choice = next(iter(stacks.choices), None)
    with paths_from_working_folder(root_folder):
        scenario = ChangedScenario(chosen.file, root_folder, world_path or (), choice, chosen.variation)
    target = out or sibling(chosen.file, "minimal")
    if target.exists():
        raise UsageError(f"{target} exists already; choose another file with --out")
    require_writable(target)
    workers, cluster = workers_and_cluster(workers, backend, address)
    options = SessionOptions(workers, wall_limit=wall_limit, cluster=cluster)
    checker = FileChecker(root_folder, world_path or (), lenient, stacks=stacks)
    node = child(scenario.tree, "seed")
    first_seed = chosen.seed or (node.plain if node is not None and isinstance(node.plain, int) else 1)
    try:
        with backend_of(options) as processes:
            candidates = CandidateRuns(scenario, checker, options, processes, first_seed, runs)
            shrinker, before = _shrink(candidates, criterion, keep, keep_world)
    except Stopped as stopped:
        sys.exit(stopped.exit)
    except BudgetSpent as error:
        count = "1 run is" if runs == 1 else f"{runs} runs are"
        raise UsageError(f"{count} not enough to reproduce the failure; increase --runs") from error
    source = f"{chosen.file.name}, seed {first_seed}" + (f", {chosen.variation}" if chosen.variation else "")
    failure = shrinker.failure.verdict_id or "an error of the stack"
    comment = f"The smallest scenario that simscen shrink found to fail in {failure}, from {source}."
    text = scenario.text_in(target.parent, shrinker.tree, comment)
    save(target, lambda file: write_atomically(file, text.encode()))
    _print_summary(shrinker, before, target, chosen.stack)
    sys.exit(Exit.PASSED if shrinker.is_complete else Exit.FAILED)


@dataclass(frozen=True)
class ChosenRun:
    """Failed run to start from.

    file:       scenario file
    seed:       seed of the run; None for the seed in the scenario
    variation:  name of the variation; "" without a variation
    stack:      value of --stack; None for the stack in the scenario
    """

    file: Path
    seed: int | None
    variation: str
    stack: str | None


def _chosen_run(run: Path, seed: int | None, variation: str, stack: str | None) -> ChosenRun:
    """Return the failed run from the arguments of the command; for a folder, from the journal of its session.

    Raises UsageError and InvalidInput.
    """
    if not run.is_dir():
        return ChosenRun(run, seed, variation, stack)
    if seed is not None or variation or stack is not None:
        raise UsageError("--seed, --variation, and --stack are for a scenario file; the folder of a run has its own")
    folder = run.absolute()
    for session in folder.parents:
        if (session / JOURNAL_FILE).is_file():
            inside = folder.relative_to(session).as_posix()
            for planned in read_journal(session).planned:
                if f"{RUNS_FOLDER}/{planned.key.scenario}/{planned.key.folder}" == inside:
                    file = Path(planned.file or planned.path)
                    return ChosenRun(file, planned.key.seed, planned.key.variation, planned.stack or None)
    raise UsageError(f"{folder} is not the folder of a run, such as simscen-out/latest/runs/NAME/seed-1")


def _shrink(candidates: CandidateRuns, criterion: str, keep: float, keep_world: bool) -> tuple[Shrinker, MappingNode]:
    """Run the scenario, and make it as small as possible. Return the shrinker, and the scenario before shrinking.

    Raises UsageError if the scenario is invalid or does not fail, RunError if its run could not be completed,
    BudgetSpent, and Stopped.
    """
    scenario = candidates.scenario
    (first,) = candidates.results([scenario.tree])
    if first is None:
        raise UsageError(f"{scenario.file} is not valid; see simscen validate")
    failure = failure_of(first, criterion, keep)
    print_text(f"the run fails: {escaped(_failure_text(first, failure))}")
    tree = with_only_criterion(scenario.tree, failure.criterion, failure.verdict_id, candidates.seed)
    if not keep_world and (loaded := candidates.load(tree)) is not None:
        inline = with_inline_world(tree, loaded.world.tree)
        if inline is not None and candidates.first_accepted([inline], failure.occurs_in) is not None:
            tree = inline
    shrinker = Shrinker(candidates, failure, tree)
    if sys.stderr.isatty():
        candidates.report_progress = lambda: print(
            f"\r{candidates.run_count} runs, {_size(shrinker.tree)} values left \x1b[K",
            end="",
            file=sys.stderr,
            flush=True,
        )
    if candidates.first_accepted([tree], failure.occurs_in) is None:
        raise UsageError("the run no longer fails if only this criterion is kept; this is a bug in simscen")
    base: Node | None = scenario.base_tree
    nominal = {change.target.keys: reduce(child, change.target.keys, base) for change in scenario.changes}
    shrinker.shrink({keys: value for keys, value in nominal.items() if keys[0] in tree.entries})
    if sys.stderr.isatty():
        print_text("", sys.stderr)
    return shrinker, tree


def _size(tree: MappingNode) -> int:
    """Return the number of scalar values in a YAML tree."""
    return sum(isinstance(node, ScalarNode) for _, node in nodes_with_keys(tree))


def _failure_text(result: RunResult, failure: Failure) -> str:
    """Return a failure in words, with the value and its limit."""
    if result.error is not None:
        return result.error.message
    verdict = next(verdict for verdict in result.verdicts if verdict.id == failure.verdict_id)
    finding = verdict.tightest
    return verdict.id if finding is None else f"{verdict.id}: {finding.measured} (limit {finding.limit})"


def _print_summary(shrinker: Shrinker, before: MappingNode, target: Path, stack: str | None) -> None:
    for title, texts in (
        ("not needed:", removed_parts(before, shrinker.tree)),
        ("simplified:", changed_values(before, shrinker.tree)),
    ):
        if texts:
            print_text("\n".join([title, *(f"  {escaped(text)}" for text in texts)]))
    incomplete = "" if shrinker.is_complete else ", which were not enough to try everything; increase --runs"
    print_text(f"{_size(shrinker.tree)} values left after {shrinker.candidates.run_count} runs{incomplete}")
    command = shlex.join(["simscen", "run", display_path(target), *([] if stack is None else ["--stack", stack])])
    print_text(f"wrote {escaped(str(target))}; try: {escaped(command)}")
