"""Validation of scenario, world, and robot files for `simscen validate` and before runs."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from simscen.cli.session.stacks import Stacks
from simscen.core.errors import InvalidInput, Problem
from simscen.core.files import collect_read_files
from simscen.loading.checks.robot_geometry import robot_problems
from simscen.loading.checks.scene_runner import world_file_warnings, world_problems
from simscen.loading.files.single_files import load_robot_file, load_world_file
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import try_variations
from simscen.loading.stacks.choice import StackChoice
from simscen.loading.variations.variation_problems import VariationProblems, merge_problems
from simscen.loading.world_cache import WorldCache


@dataclass(frozen=True)
class FileChecker:
    """Loads and validates files, and caches built worlds.

    root:               folder that must contain all files
    world_path:         further folders with worlds and models
    lenient:            whether unsupported parts of SDF worlds are warnings instead of errors
    fast:               whether to skip checks for which the world or the robot must be built
    pictures:           folder for pictures of scenarios with geometric problems; None for no pictures
    cache:              cache of built worlds
    stacks:             stacks of --stack
    requires_commands:  whether an external stack without a command is an error instead of a warning
    """

    root: Path
    world_path: Sequence[Path] = ()
    lenient: bool = False
    fast: bool = False
    pictures: Path | None = None
    cache: WorldCache = field(default_factory=WorldCache)
    stacks: Stacks = field(default_factory=Stacks)
    requires_commands: bool = True

    @property
    def choices(self) -> Sequence[StackChoice | None]:
        """Stacks with which each scenario is checked; None stands for the stack in the scenario."""
        return self.stacks.choices or (None,)

    def check_scenario(
        self, file: Path, choice: StackChoice | None = None, variation_numbers: Sequence[int] | None = None
    ) -> tuple[Sequence[LoadedScenario], list[Problem]]:
        """Return the variations of a scenario and their problems. If a problem is an error, return no variations.

        `choice` is one of `choices`. `variation_numbers` selects the variations to check; None for all variations.
        """
        loaded = try_variations(file, self.root, self.world_path, choice, variation_numbers)
        if isinstance(loaded, list):
            return (), loaded
        checked = [self.check_variation(variation) for variation in loaded]
        problems = merge_problems(
            [
                VariationProblems(variation.variation, variation.varied_paths, found)
                for variation, (_, found) in zip(loaded, checked, strict=True)
            ]
        )
        usable = [variation for variation, _ in checked if variation is not None]
        return (usable if len(usable) == len(checked) else ()), problems

    def check_variation(self, loaded: LoadedScenario) -> tuple[LoadedScenario | None, list[Problem]]:
        """Return a checked variation and its problems. The variation is None if a problem is an error.

        The returned variation has the commands of its external stacks, and the list of files that it uses.
        """
        loaded, undefined = self.stacks.with_command(loaded.with_changes(lenient=self.lenient))
        if undefined and self.requires_commands:
            return None, [*loaded.notes, *undefined]
        with collect_read_files() as read:
            problems = [*loaded.notes, *([] if self.fast else world_problems(loaded, self.cache, self.pictures))]
        problems += [replace(problem, severity="warning") for problem in undefined]
        loaded = loaded.with_changes(read_files=tuple(sorted(read)))
        usable = not any(problem.severity == "error" for problem in problems)
        return (loaded if usable else None), list(dict.fromkeys(problems))

    def check_world(self, file: Path) -> list[Problem]:
        """Return the problems of a world file that are found by loading and, unless `fast`, building the world.

        `check_file` finds the problems of its text.
        """
        try:
            source = load_world_file(file, self.root, self.world_path)
            notes = list(source.map.notes) if source.map else []
            return notes if self.fast else world_file_warnings(source, self.root, self.world_path, self.lenient)
        except InvalidInput as error:
            return error.problems

    def check_robot(self, file: Path) -> list[Problem]:
        """Return the problems of a robot file that are found by building the robot; [] if `fast`."""
        if self.fast:
            return []
        try:
            return robot_problems(load_robot_file(str(file), self.root, self.world_path))
        except InvalidInput as error:
            return error.problems
