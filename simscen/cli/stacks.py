"""What `--stack NAME=VALUE` means."""

import re
from collections.abc import Sequence
from pathlib import Path

from simscen.cli.diagnostics import from_here, harmless
from simscen.core.errors import InvalidInput, UsageError
from simscen.core.result import AGAIN
from simscen.loading.discovery import STACK
from simscen.loading.messages import quoted
from simscen.loading.stackchoice import REFERENCE, StackChoice
from simscen.loading.stackfile import load_stack_file

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_-]{0,39}")


def choices_of(written: Sequence[str], root: Path, world_path: Sequence[Path]) -> list[StackChoice]:
    """The stacks that were given, in their order.

    Raises UsageError for what cannot be read or has the name of another, InvalidInput for a stack file that is wrong.
    """
    choices: dict[str, StackChoice] = {}
    for text in written:
        choice = _choice(text, root, world_path)
        if choice.name.casefold() in choices:
            raise UsageError(
                f"--stack {harmless(text)}: there is another stack of that name; give it a name of its own"
            )
        choices[choice.name.casefold()] = choice
    return list(choices.values())


def _choice(text: str, root: Path, world_path: Sequence[Path]) -> StackChoice:
    name, equals, value = text.partition("=")
    if not equals or not _NAME.fullmatch(name):
        hint = "a name begins with a letter and has letters, digits, `_` and `-`"
        raise UsageError(f"cannot read --stack {harmless(text)}: expected NAME=VALUE; {hint}")
    if name.casefold() == AGAIN:
        raise UsageError(f"--stack {harmless(text)}: no stack may be called {quoted(name)}; it names second runs")
    if value == REFERENCE:
        return StackChoice(name, value, REFERENCE)
    if value.endswith(STACK):
        try:
            return load_stack_file(name, value, Path(value), root, world_path)
        except InvalidInput as error:
            raise InvalidInput(from_here(error.problems, root)) from error
    raise UsageError(f"--stack {harmless(text)}: {quoted(value)} is neither a *.stack.yaml file nor `{REFERENCE}`")
