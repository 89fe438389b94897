"""Stacks chosen with `--stack NAME=VALUE`, and the commands of external stacks (programs outside of simscen)."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from simscen.cli.diagnostics import escaped, paths_from_working_folder
from simscen.cli.process import caller_environment, config_file
from simscen.core.errors import InvalidInput, Problem, UsageError
from simscen.core.external_command import ExternalCommand
from simscen.core.records.run_result import RunKey
from simscen.loading.files.discovery import STACK_SUFFIXES, default_root
from simscen.loading.loaded import LoadedScenario
from simscen.loading.scenario import load_scenario
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.stacks.choice import REFERENCE, StackChoice
from simscen.loading.stacks.userconfig import (
    UserConfig,
    conflicting_stacks_problems,
    load_config,
    undefined_stack_problem,
)
from simscen.model.stack_files import ExternalStackSpec
from simscen.spec.registry import all_types, find_type

YAML_SUFFIXES = (".yaml", ".yml")
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,59}")
"""Valid name of a stack."""


@dataclass
class Stacks:
    """Stacks of the options --stack in order (`choices`), and the commands of external stacks.

    Commands come from --stack or the user's configuration, and never from a scenario or another file of a project.
    """

    choices: Sequence[StackChoice] = ()
    _commands: dict[str, ExternalCommand | None] = field(default_factory=dict)

    @cached_property
    def config(self) -> UserConfig:
        """Configuration of the user, which is read on first use. Raises InvalidInput."""
        return load_config(config_file())

    def with_command(self, loaded: LoadedScenario) -> tuple[LoadedScenario, list[Problem]]:
        """Return the scenario with the commands of its external stacks, and a problem for each stack without a command.

        Raises InvalidInput if the configuration is invalid.
        """
        if loaded.robots:
            checked = {name: self.with_command(view) for name, view in loaded.robots.items()}
            names = [choice.name for choice in self.choices if choice.external_command]
            problems = [
                *(problem for _, found in checked.values() for problem in found),
                *conflicting_stacks_problems(loaded, names, config_file()),
            ]
            complete = replace(loaded, robots={name: view for name, (view, _) in checked.items()})
            return complete, list(dict.fromkeys(problems))
        stack = loaded.spec.stack
        if not isinstance(stack, ExternalStackSpec):
            return loaded, []
        if (command := self.command(stack.external)) is not None:
            return replace(loaded, external_command=command), []
        names = [*(choice.name for choice in self.choices if choice.external_command), *self.config.spec.stacks]
        problem = undefined_stack_problem(loaded, names, self.config.file)
        return loaded, [problem] if problem is not None else []

    def command(self, name: str) -> ExternalCommand | None:
        """Return the command of the external stack `name` from --stack or the configuration; None without a command."""
        if name not in self._commands:
            from_option = next(
                (choice.external_command for choice in self.choices if choice.name == name and choice.external_command),
                None,
            )
            self._commands[name] = from_option or self.config.command(name, caller_environment(), Path.cwd())
        return self._commands[name]


def external_commands(scenarios: Iterable[LoadedScenario]) -> dict[str, dict[str, object]]:
    """Return the commands of the scenarios' external stacks by name, as JSON data for run.json.

    Environment variables are not included, because they can contain secrets.
    """
    stacks = ((view.spec.stack, view.external_command) for loaded in scenarios for view in loaded.robot_views.values())
    commands = {
        stack.external: command for stack, command in stacks if isinstance(stack, ExternalStackSpec) and command
    }
    return {
        name: {"command": list(command.argv), "cwd": command.cwd, "digest": command.digest}
        for name, command in sorted(commands.items())
    }


def load_with_stack(
    stack: str | None, file: Path, root: Path | None, world_path: Sequence[Path], variation: str = ""
) -> LoadedScenario:
    """Load a scenario, or one of its variations, and replace its stack if `stack` is given.

    `stack` is a value of --stack; None keeps the stack of the scenario. Raises InvalidInput, and UsageError for a
    missing or unknown `variation`.
    """
    root_folder = root or default_root([file])
    stacks = parse_stacks([] if stack is None else [stack], root_folder, world_path)
    chosen = next(iter(stacks.choices), None)
    with paths_from_working_folder(root_folder):
        loaded, problems = stacks.with_command(load_scenario(file, root_folder, world_path, chosen, variation))
        if problems:
            raise InvalidInput(problems)
    return loaded


def parse_stacks(arguments: Sequence[str], root: Path, world_path: Sequence[Path] = ()) -> Stacks:
    """Parse the values of --stack, such as "mine=my_stack.stack.yaml".

    Raises UsageError for a malformed value, a missing program, or a duplicate name, and InvalidInput for an invalid
    stack file or configuration.
    """
    stacks = Stacks()
    choices: dict[str, StackChoice] = {}
    for text in arguments:
        choice = _parse_choice(text, root, world_path, stacks)
        if choice.name.casefold() in choices:
            raise UsageError(f"--stack {escaped(text)}: the name is already used; choose another")
        choices[choice.name.casefold()] = choice
    return Stacks(tuple(choices.values()))


def _parse_choice(text: str, root: Path, world_path: Sequence[Path], stacks: Stacks) -> StackChoice:
    """Parse one value of --stack. `stacks` has the user's configuration."""
    name, equals, value = text.partition("=")
    if not _NAME.fullmatch(name):
        hint = "a name consists of letters, digits, `_`, `.`, and `-`"
        raise UsageError(f"cannot read --stack {escaped(text)}: expected NAME=VALUE; {hint}")
    if RunKey("", 1, stack_name=name.casefold()).is_repetition:
        raise UsageError(f"--stack {escaped(text)}: the name {quoted(name)} is reserved for second runs")
    value = value if equals else name
    if value == REFERENCE or (_NAME.fullmatch(value) and find_type("stack", value)):
        return StackChoice(name, value, type=value)
    if value.endswith(STACK_SUFFIXES) or (value.endswith(YAML_SUFFIXES) and Path(value).is_file()):
        from simscen.loading.stacks.stack_files import load_stack_file

        with paths_from_working_folder(root):
            return load_stack_file(name, value, Path(value), root, world_path)
    return StackChoice(name, value, external_command=_command(text, value, bool(equals), stacks))


def _command(text: str, value: str, may_be_command: bool, stacks: Stacks) -> ExternalCommand:
    """Return the command that the configuration defines as `value`; otherwise, if allowed, parse `value` as a command.

    `may_be_command` is false if --stack has only a name. `text` is the value of --stack for messages. Raises
    UsageError.
    """
    if _NAME.fullmatch(value) and (known := stacks.command(value)) is not None:
        return known
    if not may_be_command:
        names = [REFERENCE, *(entry.name for entry in all_types("stack")), *stacks.config.spec.stacks]
        reason = f"{quoted(value)} is neither a stack type nor a name in {stacks.config.file}"
        hint = suggestion(value, dict.fromkeys(names))
        raise UsageError(f"cannot read --stack {escaped(text)}: expected NAME=VALUE; {reason}; {hint}")
    from simscen.loading.stacks.external_commands import parse_command

    try:
        return parse_command(value, caller_environment(), Path.cwd())
    except ValueError as error:
        raise UsageError(f"--stack {escaped(text)}: {escaped(str(error))}") from error
