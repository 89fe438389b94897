"""simscen: declarative, deterministic scenario tests for mobile-robot navigation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simscen.core.version import __version__

if TYPE_CHECKING:
    from collections.abc import Sequence
    from os import PathLike

    from simscen.core.records.case import Run

__all__ = ["__version__", "simulate", "variations"]


def simulate(
    scenario: str | PathLike[str],
    seed: int | None = None,
    *,
    log: str | PathLike[str] | None = None,
    root: str | PathLike[str] | None = None,
    world_path: Sequence[str | PathLike[str]] = (),
    stack: str | None = None,
    variation: str = "",
) -> Run:
    """Run a scenario file in this process and judge it: `simscen.simulate("goal.scenario.yaml", seed=7).passed`.

    `seed` (1 … 2³²-1) defaults to the scenario's own. `log` is where the MCAP log is written, if anywhere. `root` and
    `world_path` mean what --root and --world-path mean on the command line; `stack` is the NAME=VALUE of --stack, and
    `variation` says which one of a scenario that has some (see `variations`). The same scenario and seed give the same
    run to the last bit, as often as it is called and whatever ran before. Raises simscen.core.errors.InvalidInput for
    files that cannot be used, UsageError for a stack or a variation that cannot, and RunError for a run that cannot be
    completed; an engine that crashes takes the process along, which is why the command line gives each run its own.
    """
    from pathlib import Path

    from simscen.cli.session.stacks import load_with
    from simscen.run.preparation.scenario import prepare
    from simscen.run.simulate import simulate as run

    home = None if root is None else Path(root)
    loaded = load_with(stack, Path(scenario), home, [Path(folder) for folder in world_path], variation)
    return run(prepare(loaded), seed, log=None if log is None else Path(log))


def variations(
    scenario: str | PathLike[str],
    *,
    root: str | PathLike[str] | None = None,
    world_path: Sequence[str | PathLike[str]] = (),
) -> list[str]:
    """The names of a scenario's variations, in order, for `simulate(…, variation=NAME)`; `[""]` where it has none.

    In a test: `@pytest.mark.parametrize("variation", simscen.variations("speeds.scenario.yaml"))`. Raises
    simscen.core.errors.InvalidInput for files that cannot be used.
    """
    from pathlib import Path

    from simscen.core.errors import InvalidInput
    from simscen.loading.files.discovery import default_root
    from simscen.loading.scenario import try_variations

    file = Path(scenario)
    home = default_root([file]) if root is None else Path(root)
    found = try_variations(file, home, [Path(folder) for folder in world_path])
    if isinstance(found, list):
        raise InvalidInput(found)
    return [one.variation for one in found]
