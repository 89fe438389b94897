"""simscen: declarative, deterministic scenario tests for mobile-robot navigation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from simscen.core.version import __version__

if TYPE_CHECKING:
    from collections.abc import Sequence
    from os import PathLike

    from simscen.core.run import Run

__all__ = ["__version__", "simulate"]


def simulate(
    scenario: str | PathLike[str],
    seed: int | None = None,
    *,
    log: str | PathLike[str] | None = None,
    root: str | PathLike[str] | None = None,
    world_path: Sequence[str | PathLike[str]] = (),
) -> Run:
    """Run a scenario file in this process and judge it: `simscen.simulate("goal.scenario.yaml", seed=7).passed`.

    `seed` (1 … 2³²-1) defaults to the scenario's own. `log` is where the MCAP log is written, if anywhere. `root` and
    `world_path` mean what --root and --world-path mean on the command line. The same scenario and seed give the same
    run to the last bit, as often as it is called and whatever ran before. Raises simscen.core.errors.InvalidInput for
    files that cannot be used and RunError for a run that cannot be completed; an engine that crashes takes the process
    along, which is why the command line gives each run its own.
    """
    from pathlib import Path

    from simscen.run.simulate import simulate_file

    written, home = (None if path is None else Path(path) for path in (log, root))
    return simulate_file(Path(scenario), seed, written, home, [Path(folder) for folder in world_path])
