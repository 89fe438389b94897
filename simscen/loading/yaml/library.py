"""Reads a YAML file, the files that it `extends`, and the `defaults.yaml` in its folder."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from simscen.core.errors import Problem
from simscen.loading.files.paths import PathSandbox
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.textfile import read_text, with_source_line
from simscen.loading.yaml.tree import Entry, MappingNode, Node, Position, ScalarNode, SequenceNode, child

DEFAULTS_FILE = "defaults.yaml"
"""Name of the file whose values apply to all scenarios in its folder."""
EXTENDS = "extends"
"""Key of a file. The value is the path of the file that this file extends."""
MAX_FILES = 32
"""Maximum number of YAML files of one scenario."""
APPEND_SUFFIX = "+"
"""Suffix of a top-level key such as `pass+`. The items of `pass+` are added to the list `pass` of the extended file."""


@dataclass
class Library:
    """Reader of the YAML files of one scenario, which keeps the texts for the source lines of problems."""

    sandbox: PathSandbox
    texts: dict[str, str] = field(default_factory=dict)
    """Texts of the files read so far, by path in messages (see `PathSandbox.display_name`)."""
    files: dict[str, Path] = field(default_factory=dict)
    """Absolute paths of the same files, by path in messages."""
    loaded: dict[tuple[str, Path], Any] = field(default_factory=dict)
    """Worlds, maps, and robots loaded so far, by (name of the method of Assets that loaded them, path)."""
    unsaved: Mapping[Path, str] = field(default_factory=dict)
    """Texts that replace the content of files, by absolute path, such as unsaved texts of an editor."""

    def read(self, path: Path, defaults: bool = False) -> tuple[Node | None, list[Problem]]:
        """Return the tree of a file (None if it cannot be parsed), merged with the files it extends, and all problems.

        With `defaults`, the tree is also merged with the `defaults.yaml` in the folder of the file.
        """
        tree, problems = self._read_with_base(path, ())
        return self.with_defaults(path, tree, problems) if defaults else (tree, problems)

    def text(self, path: Path) -> str | Problem:
        """Return the text of a file, or a problem."""
        return self.unsaved[path] if path in self.unsaved else read_text(path, self.sandbox.display_name(path))

    def with_defaults(
        self, path: Path, tree: Node | None, problems: list[Problem]
    ) -> tuple[Node | None, list[Problem]]:
        """Return `tree`, the content of `path`, merged with the `defaults.yaml` in the folder of `path`.

        Also return `problems` and the problems of `defaults.yaml`.
        """
        defaults_file = path.parent / DEFAULTS_FILE
        # A defaults.yaml that cannot be read is a problem; ignoring it would change the scenario silently.
        if isinstance(tree, MappingNode) and os.path.lexists(defaults_file) and path.name != DEFAULTS_FILE:
            file = self.sandbox.resolve_argument(defaults_file)
            base, more = (None, [file]) if isinstance(file, Problem) else self._read_with_base(file, ())
            problems = [*problems, *more]
            if isinstance(base, MappingNode):
                tree = extend_mapping(tree, base)
            elif not more and base is not None:
                message = "expected a mapping at top level"
                problems = [*problems, Problem(self.sandbox.display_name(defaults_file), 0, 0, "SC004", message)]
        return tree, problems

    def add(self, texts: Mapping[str, str], files: Mapping[str, Path]) -> None:
        """Add texts and absolute paths of files that were read without this library, by path in messages."""
        self.texts |= texts
        self.files |= files

    def find(self, path_text: str, position: Position) -> Path | Problem:
        """Return the existing file or folder with the path `path_text`, or a problem.

        `position` is the position of the path in a YAML file.
        """
        return self.sandbox.find(path_text, self.files[position.path].parent, position)

    def with_source(self, problems: list[Problem]) -> list[Problem]:
        """Return the problems with source lines. Problems that already have a source line are unchanged."""
        return [problem if problem.source else with_source_line(problem, self.texts) for problem in problems]

    def _read_with_base(self, path: Path, chain: tuple[Path, ...]) -> tuple[Node | None, list[Problem]]:
        """Return the merged tree of a file and all problems. `chain` are the files that led to `path` by `extends`."""
        tree, problems = self._read_file(path)
        if not isinstance(tree, MappingNode) or EXTENDS not in tree.entries:
            return tree, problems
        own, chain = tree.without_keys(EXTENDS), (*chain, path)
        base = self._base_file(tree.entries[EXTENDS].value, chain)
        if isinstance(base, Problem):
            return own, [*problems, base]
        base_tree, more = self._read_with_base(base, chain)
        if isinstance(base_tree, MappingNode):
            return extend_mapping(own, base_tree), problems + more
        return own, problems + more

    def _read_file(self, path: Path) -> tuple[Node | None, list[Problem]]:
        """Return the tree of a file without its base files, and all problems. Keep the text and the path."""
        name = self.sandbox.display_name(path)
        self.files[name] = path
        text = self.text(path)
        if isinstance(text, Problem):
            return None, [text]
        self.texts[name] = text
        return parse_yaml(text, name)

    def _base_file(self, extends: Node, chain: tuple[Path, ...]) -> Path | Problem:
        """Return the file that the last file of `chain` extends; or a problem. `extends` is the value of the key."""
        position = extends.position
        if not isinstance(extends, ScalarNode) or not isinstance(extends.value, str):
            return Problem(*position, "SC011", f"`{EXTENDS}` must be the path of one file")
        base = self.find(extends.value, position)
        if isinstance(base, Problem):
            return base
        if base in chain:
            names = " → ".join(self.sandbox.display_name(file) for file in (*chain[chain.index(base) :], base))
            return Problem(*position, "SC024", f"circular `extends`: {names}")
        if len(self.files) >= MAX_FILES:
            return Problem(*position, "SC024", f"a scenario can consist of at most {MAX_FILES} YAML files")
        return base


def extend_mapping(own: MappingNode, base: MappingNode) -> MappingNode:
    """Return `own`, the content of a file, merged with `base`, the content of the file that it extends.

    The items of a key such as `pass+` in `own` are appended to the list `pass` or `pass+` in `base`. Without such a
    list in `base`, the key `pass+` is kept.
    """
    entries = dict(own.entries)
    for key, more in own.entries.items():
        name = key.removesuffix(APPEND_SUFFIX)
        if name == key or name in own.entries or not isinstance(more.value, SequenceNode):
            continue
        for known in (name, key):
            extended = base.entries.get(known)
            if extended is not None and isinstance(extended.value, SequenceNode):
                del entries[key]
                items = (*extended.value.items, *more.value.items)
                entries[known] = Entry(more.key, SequenceNode(more.value.position, items))
                break
    return merge_mappings(MappingNode(own.position, entries), base)


def merge_mappings(own: MappingNode, base: MappingNode) -> MappingNode:
    """Return `base` updated by `own`. Nested mappings are merged if they have the same type."""
    entries = dict(own.entries)
    for key, base_entry in base.entries.items():
        entry, base_value = entries.get(key), base_entry.value
        if entry is None:
            entries[key] = base_entry
        elif (
            isinstance(entry.value, MappingNode)
            and isinstance(base_value, MappingNode)
            and _are_mergeable(key, entry.value, base_value)
        ):
            entries[key] = Entry(entry.key, merge_mappings(entry.value, base_value))
    return MappingNode(own.position, entries)


def _are_mergeable(key: str, own: MappingNode, base: MappingNode) -> bool:
    """Return whether two mappings under the same key `key` can be merged: their values of `type` do not differ.

    A missing `type` matches all types. An external stack and a stack with a `type` cannot be merged.
    """
    own_type, base_type = child(own, "type"), child(base, "type")
    if key == "stack" and "external" in own.entries and "external" not in base.entries:
        return False
    if key == "stack" and own_type is not None and "external" in base.entries:
        return False
    return own_type is None or base_type is None or own_type.plain == base_type.plain
