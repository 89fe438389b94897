"""Loading of scenario files and of the scenario texts in logs, for tests."""

from pathlib import Path
from typing import Any

from simscen.core.errors import Problem
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import try_variations
from simscen.loading.scenario_text import _read, _validated
from simscen.model.scenario import ScenarioSpec


def try_scenario(path: Path, root: Path, *args: Any) -> LoadedScenario | list[Problem]:
    """Return the scenario in a file (its first variation if it has any), or all problems of the file."""
    loaded = try_variations(path, root, *args)
    return loaded if isinstance(loaded, list) else loaded[0]


def spec_of_text(text: str, name: str) -> ScenarioSpec:
    """Return the specification in the scenario text of a log; `name` is its name in problems."""
    return _validated(ScenarioSpec, _read(text, name))
