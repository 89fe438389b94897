"""Runs the checks of `simscen validate` on the text in the editor, whether it is saved or not."""

from dataclasses import dataclass, field

from simscen.core.errors import InvalidInput, Problem
from simscen.editor.document import EditedFile
from simscen.loading.checks.runner import check_world_file
from simscen.loading.checks.scene_runner import world_file_warnings, world_problems
from simscen.loading.files.single_files import load_world_file
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import try_variations
from simscen.loading.stacks.choice import StackChoice
from simscen.loading.variations.variation_problems import VariationProblems, merge_problems
from simscen.loading.world_cache import WorldCache

CHECKED_VARIATIONS = range(1, 4)
"""Numbers of the variations (sets of values of a scenario) that the editor checks."""

MAX_CACHED_WORLDS = 8
"""Maximum number of cached worlds."""


@dataclass
class TextChecks:
    """Loads and checks versions of the text of one file.

    file:     edited file
    lenient:  value of the option --lenient
    stack:    stack that replaces the stack of the scenario; None to keep it
    cache:    cache of built worlds and shortest paths
    """

    file: EditedFile
    lenient: bool = False
    stack: StackChoice | None = None
    cache: WorldCache = field(default_factory=lambda: WorldCache(MAX_CACHED_WORLDS))

    def load(self, text: str) -> tuple[LoadedScenario, ...]:
        """Return the variations CHECKED_VARIATIONS of the scenario in a text. Raises InvalidInput."""
        file, unsaved = self.file, {self.file.path: text}
        loaded = try_variations(file.path, file.root, file.world_path, self.stack, CHECKED_VARIATIONS, unsaved)
        if isinstance(loaded, list):
            raise InvalidInput(loaded)
        return tuple(scenario.with_changes(lenient=self.lenient) for scenario in loaded)

    def problems(self, text: str) -> list[Problem]:
        """Return all problems of a text, in the order of the file."""
        try:
            problems = self._scenario_problems(text) if self.file.kind == "scenario" else self._world_problems(text)
        except InvalidInput as error:
            problems = error.problems
        return sorted(dict.fromkeys(problems))

    def _scenario_problems(self, text: str) -> list[Problem]:
        checked = [
            VariationProblems(
                scenario.variation, scenario.varied_paths, [*scenario.notes, *world_problems(scenario, self.cache)]
            )
            for scenario in self.load(text)
        ]
        return merge_problems(checked)

    def _world_problems(self, text: str) -> list[Problem]:
        file = self.file
        source = load_world_file(file.path, file.root, file.world_path, {file.path: text})
        warnings = world_file_warnings(source, file.root, file.world_path, self.lenient)
        return [*check_world_file(source), *warnings]
