"""What the fixture `simscen` gives to a test."""

from pathlib import Path

import simscen
from simscen.core.records.case import Run


class Simscen:
    """Runs scenarios in the test's own process, with `simscen.simulate()`. Files are relative to the test's folder.

    Each run leaves its log among the test's temporary files: `run.log`.
    """

    def __init__(self, folder: Path, out: Path) -> None:
        self._folder, self._out = folder, out
        self._runs = 0

    def __call__(
        self, scenario: str | Path, seed: int | None = None, *, stack: str | None = None, variation: str = ""
    ) -> Run:
        """Run it; the arguments are those of `simscen.simulate`."""
        self._runs += 1
        log = self._out / f"run-{self._runs}.mcap"
        return simscen.simulate(self._folder / scenario, seed, log=log, stack=stack, variation=variation)

    def variations(self, scenario: str | Path) -> list[str]:
        """The names of a scenario's variations; `[""]` where it has none."""
        return simscen.variations(self._folder / scenario)
