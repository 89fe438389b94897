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

    Args:
        scenario: Path of the scenario file.
        seed: Seed (1 … 2³²-1); default: the seed in the scenario.
        log: Path of the MCAP log to write; default: no log.
        root: Root folder, like --root on the command line.
        world_path: Additional folders with worlds and models, like --world-path.
        stack: Stack to use instead of the scenario's own, as NAME=VALUE like --stack.
        variation: Name of one of the scenario's variations; see `variations`.

    The same scenario and seed give the same run bit for bit as on the command line, unless NumPy was imported before
    the first call: then NumPy uses its own CPU kernels (docs/design/determinism.md). If the physics engine crashes, it
    ends this process; the command line therefore gives each run its own process.

    Raises:
        simscen.core.errors.InvalidInput: A file is invalid.
        simscen.core.errors.UsageError: The stack or the variation is invalid.
        simscen.core.errors.RunError: The run could not be completed.
    """
    from simscen.core.cpu_kernels import pin_kernels

    pin_kernels()  # before NumPy is imported
    from pathlib import Path

    from simscen.cli.diagnostics import paths_from_working_folder
    from simscen.cli.session.stacks import load_with_stack
    from simscen.run.preparation import prepare
    from simscen.run.simulate import simulate as run

    root_folder = None if root is None else Path(root)
    loaded = load_with_stack(stack, Path(scenario), root_folder, [Path(folder) for folder in world_path], variation)
    with paths_from_working_folder(loaded.root):
        return run(prepare(loaded), seed, log=None if log is None else Path(log))


def variations(
    scenario: str | PathLike[str],
    *,
    root: str | PathLike[str] | None = None,
    world_path: Sequence[str | PathLike[str]] = (),
) -> list[str]:
    """Return the names of a scenario's variations, in order, for `simulate(…, variation=NAME)`; `[""]` without any.

    In a test: `@pytest.mark.parametrize("variation", simscen.variations("speeds.scenario.yaml"))`. Raises
    simscen.core.errors.InvalidInput for invalid files.
    """
    from pathlib import Path

    from simscen.cli.diagnostics import relative_to_working_folder
    from simscen.core.errors import InvalidInput
    from simscen.loading.files.discovery import default_root
    from simscen.loading.scenario import try_variations

    file = Path(scenario)
    root_folder = default_root([file]) if root is None else Path(root)
    found = try_variations(file, root_folder, [Path(folder) for folder in world_path])
    if isinstance(found, list):
        raise InvalidInput(relative_to_working_folder(found, root_folder))
    return [one.variation for one in found]
