"""User configuration with the commands of external stacks, and problems of missing and conflicting commands."""

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.errors import InvalidInput, Problem
from simscen.core.external_command import ExternalCommand
from simscen.core.files import expand_home
from simscen.loading.files.paths import PathSandbox, exists, is_folder
from simscen.loading.loaded import LoadedScenario
from simscen.loading.multirobot import external_stack_name
from simscen.loading.schema.messages import did_you_mean, quoted
from simscen.loading.schema.validate import check
from simscen.loading.stacks.choice import EXTERNAL
from simscen.loading.stacks.external_commands import parse_command
from simscen.loading.yaml.library import Library
from simscen.loading.yaml.tree import Node, value_position
from simscen.model.stack_files import ExternalStackSpec, UserConfigSpec


@dataclass(frozen=True)
class UserConfig:
    """User configuration in `file`.

    `tree` is the YAML tree of the file, and `library` has read the file. They are None if the file does not exist.
    """

    file: Path
    spec: UserConfigSpec
    tree: Node | None = field(repr=False, default=None)
    library: Library | None = field(repr=False, default=None)

    def command(self, name: str, environment: Mapping[str, str], folder: Path) -> ExternalCommand | None:
        """Return the command of the external stack `name`; None if the configuration does not define the stack.

        `environment` and `folder` are the environment variables and the working folder of this process. Raises
        InvalidInput if the command cannot be run.
        """
        if name not in self.spec.stacks:
            return None
        stack = self.spec.stacks[name]
        working_folder = folder if stack.cwd is None else expand_home(stack.cwd)
        if not is_folder(working_folder):
            raise self._invalid((name, "cwd"), "no such folder", "")
        try:
            timeouts = stack.start_limit, stack.answer_limit
            return parse_command(stack.command, environment, working_folder, stack.env, timeouts)
        except ValueError as error:
            hint = "" if stack.cwd is None else f"it starts in {working_folder}"
            raise self._invalid((name, "command"), str(error), hint) from error

    def _invalid(self, keys: tuple[str, str], message: str, hint: str) -> InvalidInput:
        assert self.tree is not None and self.library is not None, "only stacks from a file can be invalid"
        position = value_position(self.tree, ("stacks", *keys))
        problem = Problem(*position, code="SC061", message=message, hint=hint)
        return InvalidInput(self.library.with_source([problem]))


def load_config(file: Path) -> UserConfig:
    """Return the configuration in `file`; an empty configuration if it does not exist. Raises InvalidInput."""
    if not exists(file):
        return UserConfig(file, UserConfigSpec())
    # No file is inside this root, so that problems show the absolute path of the file.
    library = Library(PathSandbox.around(Path(os.devnull), [file.parent]))
    tree, problems = library.read(file)
    spec = check(UserConfigSpec, tree) if tree is not None else []
    if problems or isinstance(spec, list):
        raise InvalidInput(library.with_source([*problems, *(spec if isinstance(spec, list) else [])]))
    return UserConfig(file, spec, tree, library)


def undefined_stack_problem(
    loaded: LoadedScenario, defined_names: Iterable[str] = (), config_file: Path | None = None
) -> Problem | None:
    """Return a problem if the scenario has an external stack without a command; else None.

    The hint contains a similar name of `defined_names`, and the path `config_file`.
    """
    stack = loaded.spec.stack
    if not isinstance(stack, ExternalStackSpec) or loaded.external_command is not None:
        return None
    name = stack.external
    alternative = f", or under `stacks:` in {config_file}" if config_file is not None else ""
    hint = did_you_mean(name, defined_names) or f"give it with --stack {name}='COMMAND'{alternative}"
    message = f"the external stack {quoted(name)} has no command"
    return loaded.problem(("stack", EXTERNAL), "SC060", message, hint)


def conflicting_stacks_problems(
    loaded: LoadedScenario, option_names: Iterable[str], config_file: Path
) -> list[Problem]:
    """Return a problem if the robots of a scenario use several external stacks that `--stack` options define.

    `option_names` are the names of the stacks in `--stack` options.
    """
    views = {name: view for view in loaded.robots.values() if (name := external_stack_name(view.tree)) is not None}
    names = [name for name in option_names if name in views]
    if len(names) < 2:
        return []
    stacks = " and ".join(map(quoted, names))
    message = f"robots of this scenario have the stacks {stacks}, but a run can have only one --stack"
    hint = f"define the commands of all but one under `stacks:` in {config_file}"
    return [views[names[1]].problem(("stack", EXTERNAL), "SC042", message, hint)]
