"""Read the user's own configuration."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.errors import InvalidInput
from simscen.core.externalcommand import ExternalCommand
from simscen.core.problems import Problem
from simscen.loading.document import Library
from simscen.loading.paths import Fence, exists
from simscen.loading.program import command_of
from simscen.loading.tree import Fields, value_place
from simscen.loading.validation import check
from simscen.model.userconfig import UserConfigSpec


@dataclass(frozen=True)
class UserConfig:
    """A configuration with where it is written."""

    file: Path
    spec: UserConfigSpec
    tree: Fields | None = field(repr=False, default=None)
    library: Library | None = field(repr=False, default=None)

    def command(self, name: str, environment: Mapping[str, str], folder: Path) -> ExternalCommand | None:
        """What a stack's name runs, called from `folder` with this environment; None for a name that is not there.

        Raises InvalidInput where it cannot be run.
        """
        if name not in self.spec.stacks:
            return None
        said = self.spec.stacks[name]
        home = folder if said.cwd is None else Path(said.cwd).expanduser()
        if not home.is_dir():
            raise self._wrong((name, "cwd"), "there is no such folder", "")
        try:
            return command_of(said.command, environment, home, said.env, (said.start_limit, said.answer_limit))
        except ValueError as error:
            hint = "" if said.cwd is None else f"it starts in {home}"
            raise self._wrong((name, "command"), str(error), hint) from error

    def _wrong(self, keys: tuple[str, str], message: str, hint: str) -> InvalidInput:
        assert self.tree is not None and self.library is not None, "a stack that is not in a file"
        place = value_place(self.tree, ("stacks", *keys))
        problem = Problem(*place, code="SC061", message=message, hint=hint)
        return InvalidInput(self.library.with_source([problem]))


def load_config(file: Path) -> UserConfig:
    """The configuration in `file`; an empty one where there is none. Raises InvalidInput with all that is wrong."""
    if not exists(file):
        return UserConfig(file, UserConfigSpec())
    # Its root holds nothing, so that problems show where the file is: it is no part of a project.
    library = Library(Fence.around(Path(os.devnull), [file.parent]))
    tree, problems = library.read(file)
    spec = check(UserConfigSpec, tree) if tree is not None else []
    if problems or isinstance(spec, list) or not isinstance(tree, Fields):
        raise InvalidInput(library.with_source([*problems, *(spec if isinstance(spec, list) else [])]))
    return UserConfig(file, spec, tree, library)
