"""Keeps what has been prepared, so that a world is built once for all the runs in it."""

import hashlib
import pickle
from dataclasses import replace

from simscen.core.environment.world_model import BuiltWorld
from simscen.loading.loaded import LoadedScenario
from simscen.run.keptworlds import KeptWorlds
from simscen.run.prepare import Prepared, prepare
from simscen.run.worldsource import load_world

MOST = 100
"""Scenarios that are kept; their runs follow each other, and a file may have a thousand variations."""


class PreparedCache:
    """Prepares scenarios; lives in the warm process, whose forks inherit what is here."""

    def __init__(self, kept: KeptWorlds) -> None:
        """`kept` is what earlier sessions left."""
        self._kept = kept
        self._worlds: dict[str, BuiltWorld] = {}
        self._scenarios: dict[tuple[str, str, str], Prepared] = {}

    def prepared(self, loaded: LoadedScenario) -> Prepared:
        """The prepared scenario; the first one in a world builds it. Raises InvalidInput."""
        name = loaded.id, loaded.variation, loaded.stack_name
        if name not in self._scenarios:
            if len(self._scenarios) == MOST:
                del self._scenarios[next(iter(self._scenarios))]
            self._scenarios[name] = prepare(loaded, self._world, self._kept.legs)
        return self._scenarios[name]

    def clear(self) -> None:
        """Forget everything."""
        self._worlds.clear()
        self._scenarios.clear()

    def _world(self, loaded: LoadedScenario, height: float) -> BuiltWorld:
        key = hashlib.sha256(pickle.dumps((replace(loaded.world, tree=None), height))).hexdigest()
        if key not in self._worlds:
            self._worlds[key] = self._kept.build(load_world(loaded), height)
        return self._worlds[key]
