"""Loading of a scenario with its variations (sets of values) and all files that it names."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from simscen.core.errors import InvalidInput, Problem, UsageError
from simscen.loading import multirobot
from simscen.loading.checks.registry import ROBOT_NAMES
from simscen.loading.checks.runner import check_scenario
from simscen.loading.codes import UNSUPPORTED_BY_STACK
from simscen.loading.file_kinds import kind_of_content, not_a_scenario_problem
from simscen.loading.files.assets import Assets, find_criterion_masks
from simscen.loading.files.paths import PathSandbox, is_unusable_name, scenario_id
from simscen.loading.loaded import KEEPOUT_MASK_KEYS, SPEED_MASK_KEYS, LoadedMap, LoadedScenario
from simscen.loading.named_places import places_of, resolve_places, unknown_places
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.schema.validate import check, not_a_mapping_problem
from simscen.loading.stacks.choice import StackChoice
from simscen.loading.stacks.nav2_expansion import with_nav2_parameters
from simscen.loading.variations.expand import VARIATIONS, Variation, VariationSpace, expand_variations, variation_space
from simscen.loading.variations.naming import number_of
from simscen.loading.variations.options import Change
from simscen.loading.variations.variation_problems import VariationProblems, merge_problems
from simscen.loading.yaml.library import Library
from simscen.loading.yaml.tree import Keys, MappingNode, ScalarNode, child, node_at, value_position
from simscen.model.scenario import ScenarioSpec


def load_scenario(
    path: Path, root: Path, world_path: Sequence[Path] = (), choice: StackChoice | None = None, variation: str = ""
) -> LoadedScenario:
    """Load the scenario in the file `path`, or its variation with the name `variation`.

    All files must lie in `root` or in a folder of `world_path`. `choice` replaces the stack of the scenario. Raises
    InvalidInput with all problems of the files, and UsageError for a variation that is unknown or missing.
    """
    number = number_of(variation)
    loaded = try_variations(path, root, world_path, choice, None if number is None else [number])
    if isinstance(loaded, list):
        raise InvalidInput(loaded)
    if (found := next((scenario for scenario in loaded if scenario.variation == variation), None)) is not None:
        return found
    names = [scenario.variation for scenario in loaded if scenario.variation]
    if loaded and not names:
        raise UsageError(f"{path} has no variations, so not {quoted(variation)} either")
    reason = f"has no variation {quoted(variation)}" if variation else f"has {len(names)} variations: choose one"
    raise UsageError(f"{path} {reason}; {suggestion(variation, names)}".removesuffix("; "))


def try_variations(
    path: Path,
    root: Path,
    world_path: Sequence[Path] = (),
    choice: StackChoice | None = None,
    variation_numbers: Sequence[int] | None = None,
    unsaved: Mapping[Path, str] | None = None,
) -> tuple[LoadedScenario, ...] | list[Problem]:
    """Return all variations of the scenario in a file; or all problems if one of the variations has errors.

    A scenario without `variations` counts as one variation. `variation_numbers` selects variations by number, from 1;
    unknown numbers are ignored. `unsaved` are texts that replace the content of files, by absolute path. The other
    parameters are those of `load_scenario`.
    """
    library = Library(PathSandbox.around(root, world_path), unsaved=unsaved or {})
    read = _read(path, library, choice)
    if isinstance(read, list):
        return read
    file, tree = read
    expanded = expand_variations(tree, variation_numbers)
    variations = [variation for variation in expanded if isinstance(variation, Variation)]
    if problems := [problem for problem in expanded if isinstance(problem, Problem)]:
        return library.with_source(sorted(problems))
    results = [(variation, _load_variation(variation, library, file, choice)) for variation in variations]
    if any(isinstance(result, list) for _, result in results):
        return merge_problems(
            [
                VariationProblems(variation.name, variation.varied_paths, result if isinstance(result, list) else ())
                for variation, result in results
            ]
        )
    return tuple(result for _, result in results if isinstance(result, LoadedScenario))


def read_variation_space(path: Path, root: Path, world_path: Sequence[Path] = ()) -> VariationSpace | None:
    """Return the variations of the scenario in a file; None if it has none. Raises InvalidInput."""
    library = Library(PathSandbox.around(root, world_path))
    read = _read(path, library, None)
    space = read if isinstance(read, list) else variation_space(read[1])
    if isinstance(space, list):
        raise InvalidInput(library.with_source(sorted(space)))
    return space


class ChangedScenario:
    """Scenario file of which changed versions can be loaded without writing them to files.

    `file` is the absolute path. `merged_tree` is the YAML tree of the file, merged with `extends` and `defaults.yaml`.
    `base_tree` is `merged_tree` without `variations`. `changes` are the values of the selected variation, and `tree` is
    `base_tree` with these values.
    """

    def __init__(
        self,
        path: Path,
        root: Path,
        world_path: Sequence[Path] = (),
        choice: StackChoice | None = None,
        variation: str | None = "",
    ) -> None:
        """Read the file, and check the selected variation as `load_scenario` does, unless `variation` is None."""
        self._library, self._choice = Library(PathSandbox.around(root, world_path)), choice
        if variation is not None:
            load_scenario(path, root, world_path, choice, variation)
        read = _read(path, self._library, choice)
        if isinstance(read, list):
            raise InvalidInput(read)
        self.file, self.merged_tree = read
        self.base_tree = self.tree = self.merged_tree.without_keys(VARIATIONS)
        self.changes: tuple[Change, ...] = ()
        if variation:
            number = number_of(variation)
            variations = expand_variations(self.merged_tree, None if number is None else [number])
            selected = next(v for v in variations if isinstance(v, Variation) and v.name == variation)
            self.tree, self.changes = selected.tree, selected.changes

    def load(self, tree: MappingNode) -> LoadedScenario | list[Problem]:
        """Return the scenario with the content `tree`, ignoring its `variations`; or all its problems."""
        merged, problems = self._library.with_defaults(self.file, tree, [])
        if problems or not isinstance(merged, MappingNode):
            return problems
        variation = Variation("", merged.without_keys(VARIATIONS))
        return _load_variation(variation, self._library, self.file, self._choice)

    def text_in(self, folder: Path, tree: MappingNode, comment: str) -> str:
        """Return the content `tree` as text for a file in `folder`, with `comment` at the top.

        Unchanged parts keep their lines. Paths in the text are relative to `folder`.
        """
        from simscen.loading.files.copying import with_paths_relative_to  # most commands write no scenarios
        from simscen.loading.yaml.writing import changed_text

        name = self._library.sandbox.display_name(self.file)
        content = with_paths_relative_to(folder, tree, self._library.files)
        return changed_text(self._library.texts[name], name, content.plain, comment)


def _read(path: Path, library: Library, choice: StackChoice | None) -> tuple[Path, MappingNode] | list[Problem]:
    """Return the absolute path of a scenario file and its tree, merged with the files it extends; or all problems."""
    sandbox = library.sandbox
    file = sandbox.resolve_argument(path)
    if isinstance(file, Problem):
        return [file]
    if is_unusable_name(name := scenario_id(file, sandbox.root).rpartition("/")[2]):
        message, hint = f"its id would end in {name!r}: not a folder name", "give the file a name before the suffix"
        return [Problem(sandbox.display_name(file), 0, 0, "SC041", message, hint)]
    tree, problems = library.read(file, defaults=True)
    display_name = sandbox.display_name(file)
    kind = kind_of_content(tree, library.texts.get(display_name, ""), display_name)
    if kind != "scenario":
        return [not_a_scenario_problem(kind, display_name)]
    if choice is not None:
        library.add(choice.texts, choice.files)
    if not problems and tree is not None and not isinstance(tree, MappingNode):
        problems = [not_a_mapping_problem(tree)]
    if problems or not isinstance(tree, MappingNode):
        return library.with_source(sorted(problems))
    return file, tree


def _load_variation(
    variation: Variation, library: Library, file: Path, choice: StackChoice | None
) -> LoadedScenario | list[Problem]:
    tree = variation.tree if choice is None else multirobot.apply_stack_choice(variation.tree, choice)
    if choice is not None and (ineffective := list(_ineffective_variation_problems(variation, tree, choice))):
        return library.with_source(ineffective)
    expanded_tree = with_nav2_parameters(tree, library)
    if expanded_tree.problems:
        return library.with_source(sorted(expanded_tree.problems))
    tree = expanded_tree.tree
    spec = check(ScenarioSpec, tree, multirobot.scenario_robot_problems)
    if isinstance(spec, list):
        assets, world = Assets(library), child(tree, "world")
        if isinstance(world, ScalarNode) and isinstance(world.value, str) and world.value:
            assets.world(world)  # also reports the problems of the world file
        return library.with_source(sorted([*spec, *assets.problems]))
    if problems := ROBOT_NAMES.problems(tree, spec):
        return library.with_source(problems)
    load = _load_multi_robot if spec.robots else _load_single_robot
    loaded = load(spec, tree, library, file)
    if isinstance(loaded, list):
        return loaded
    notes = (*loaded.notes, *library.with_source(expanded_tree.notes), *(choice.notes if choice is not None else ()))
    return replace(loaded, notes=notes).with_changes(
        choice=choice, variation=variation.name, varied_paths=variation.varied_paths, varied_values=variation.values
    )


def _ineffective_variation_problems(variation: Variation, tree: MappingNode, choice: StackChoice) -> Iterator[Problem]:
    """Yield a problem for each value of a variation that has no effect, because `choice` replaces the stack."""
    robot_trees = multirobot.split_by_robot(tree).values() if multirobot.has_valid_robots(tree) else ()
    for change in variation.changes:
        if all(node_at(part, change.target.keys) is not change.value for part in (tree, *robot_trees)):
            message = f"{quoted(change.target.path)} changes nothing with --stack {choice.option_text}"
            hint = "select variations that do not set it with -k or --variation, or choose another stack"
            yield Problem(*change.target.position, UNSUPPORTED_BY_STACK, message, hint)


def _load_multi_robot(
    spec: ScenarioSpec, tree: MappingNode, library: Library, file: Path
) -> LoadedScenario | list[Problem]:
    views: dict[str, LoadedScenario] = {}
    problems: list[Problem] = []
    for name, robot_tree in multirobot.split_by_robot(tree).items():
        robot_spec = check(ScenarioSpec, robot_tree)
        if isinstance(robot_spec, list):
            problems += robot_spec
            continue
        others = tuple(other for other in sorted(spec.robots or ()) if other != name)
        view = _load_single_robot(robot_spec, robot_tree, library, file, name, others)
        if isinstance(view, list):
            problems += view
        else:
            views[name] = view
    if problems:
        return library.with_source(sorted(set(problems)))
    first, notes = next(iter(views.values())), [note for view in views.values() for note in view.notes]
    return replace(
        first,
        spec=resolve_places(spec, places_of(first.world)),
        tree=tree,
        robots=views,
        notes=tuple(dict.fromkeys(notes)),
        robot_name="",
        other_robots=(),
    )


def _load_single_robot(
    spec: ScenarioSpec, tree: MappingNode, library: Library, file: Path, name: str = "", others: tuple[str, ...] = ()
) -> LoadedScenario | list[Problem]:
    """Return a scenario of one robot, or the view of the robot `name` beside the robots `others`; or all problems."""
    assets = Assets(library)
    world = assets.world_of(spec.world, tree, file)
    robot_map = None if spec.map == "none" else _map_at(("map",), tree, assets)
    keepout_mask = _map_at(KEEPOUT_MASK_KEYS, tree, assets)
    speed_mask = _map_at(SPEED_MASK_KEYS, tree, assets)
    criterion_masks = find_criterion_masks(spec, tree, assets)
    robot = assets.robot(spec.only_robot.model, value_position(tree, ("robot", "model")))
    if world is None or robot is None or assets.problems:
        return library.with_source(sorted(assets.problems))
    sandbox, display_name, places = library.sandbox, library.sandbox.display_name(file), places_of(world)
    unknown = library.with_source(list(unknown_places(spec, tree, places)))
    maps = (world.map, robot_map, keepout_mask, speed_mask, *(mask.map for mask in criterion_masks.values()))
    loaded = LoadedScenario(
        id=scenario_id(file, sandbox.root),
        path=display_name,
        file=file,
        root=sandbox.root,
        world_path=sandbox.world_path,
        text=library.texts[display_name],
        spec=resolve_places(spec, places),
        world=world,
        map="none" if spec.map == "none" else robot_map,
        robot=robot,
        tree=tree,
        sources=dict(library.texts),
        files=dict(library.files),
        notes=tuple(dict.fromkeys(note for ros_map in maps if ros_map is not None for note in ros_map.notes)),
        keepout_mask=keepout_mask,
        speed_mask=speed_mask,
        criterion_masks=criterion_masks,
        robot_name=name,
        other_robots=others,
    )
    problems = sorted(check_scenario(loaded, unknown_places=unknown))
    if any(problem.severity == "error" for problem in problems):
        return problems
    return replace(loaded, notes=(*loaded.notes, *problems))


def _map_at(keys: Keys, tree: MappingNode, assets: Assets) -> LoadedMap | None:
    node = node_at(tree, keys)
    return assets.map(node) if isinstance(node, ScalarNode) else None
