"""`simscen run --last-failed`: which runs that means, and what to say of it."""

from collections.abc import Collection, Sequence
from pathlib import Path

from simscen.core.result import RunKey
from simscen.loading.loaded import LoadedScenario
from simscen.report.sessions import last_failed
from simscen.run.outfolder import DEFAULT
from simscen.run.session import Options, seeds_of

EVERYTHING = "everything that is chosen runs"


def failed_runs(
    scenarios: Sequence[LoadedScenario], options: Options, out: Path | None
) -> tuple[frozenset[RunKey] | None, str]:
    """The runs of these scenarios that failed when they were run last, and what to tell.

    None where there is nothing to choose by: then, as with pytest, everything runs. Sessions are looked for beside the
    output folder `out`. A failed run keeps its seed, unless the options name seeds.
    """
    home = DEFAULT if out is None else out.absolute().parent
    last = last_failed(home)
    if last is None:
        return None, f"there is no earlier session in {home}: {EVERYTHING}"
    if not last.runs:
        return None, f"nothing failed in the last session, {last.folder}: {EVERYTHING}"
    chosen = {(one.title, one.stack_name): one for one in scenarios if one.spec.skip is None}
    found = frozenset(key for key in last.runs if _asked(key, chosen.get((key.test, key.stack_name)), options))
    left = len(last.runs) - len(found)
    where = f"{left} {_is(left)} not among what is chosen"
    if not found:
        return None, f"{_runs(last.runs)} failed last, and {_is(left)} not among what is chosen: {EVERYTHING}"
    return found, f"{_runs(last.runs)} failed last" + (f": {len(found)} {_is(len(found))} run, {where}" if left else "")


def _asked(key: RunKey, scenario: LoadedScenario | None, options: Options) -> bool:
    if scenario is None:
        return False
    return (options.seed is None and options.repeat == 1) or key.seed in seeds_of(scenario, options)


def _runs(runs: Collection[RunKey]) -> str:
    return f"{len(runs)} run{'' if len(runs) == 1 else 's'}"


def _is(number: int) -> str:
    return "is" if number == 1 else "are"
