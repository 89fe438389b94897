"""Read a YAML file, and merge it with the files that it extends and with the `defaults.yaml` next to it."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from simscen.core.errors import Problem
from simscen.loading.files.paths import PathProblem, PathSandbox
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.textfile import read_text
from simscen.loading.yaml.tree import Entry, MappingNode, Node, Position, ScalarNode, SequenceNode

DEFAULTS_FILE = "defaults.yaml"
"""Name of the file whose values apply to all scenarios in its folder."""
EXTENDS = "extends"
"""Key with the path of the file that a file extends."""
MAX_FILES = 32
"""Largest number of YAML files of one scenario. Further files cannot be extended."""
APPEND_SUFFIX = "+"
"""Suffix of a top-level key such as `pass+`, whose items are added to the list `pass` of the extended file."""


@dataclass
class Library:
    """Reader of the files of one scenario. Keeps their texts, so that problems can show their lines."""

    sandbox: PathSandbox
    texts: dict[str, str] = field(default_factory=dict)
    """Texts of the files read so far, by their names in messages (PathSandbox.display_name)."""
    files: dict[str, Path] = field(default_factory=dict)
    """Absolute paths of these files, by their names in messages."""
    loaded: dict[tuple[str, Path], Any] = field(default_factory=dict)
    """Worlds, maps, and robots loaded so far, by the name of the loading function and the path (see Assets)."""
    unsaved: Mapping[Path, str] = field(default_factory=dict)
    """Texts to use instead of the content of files, by absolute path, such as the text in an editor."""

    def read(self, path: Path, defaults: bool = False) -> tuple[Node | None, list[Problem]]:
        """Return the tree of a file merged with what it extends (None if it cannot be parsed), and all problems.

        With `defaults`, it is also merged with the `defaults.yaml` next to it.
        """
        tree, problems = self._read_with_base(path, ())
        return self.with_defaults(path, tree, problems) if defaults else (tree, problems)

    def with_defaults(
        self, path: Path, tree: Node | None, problems: list[Problem]
    ) -> tuple[Node | None, list[Problem]]:
        """Return `tree`, the content of the file `path`, merged with the `defaults.yaml` next to it.

        `problems` are the problems of the tree; they are returned with those of the `defaults.yaml`.
        """
        defaults_file = path.parent / DEFAULTS_FILE
        # A defaults.yaml that cannot be read is a problem; ignoring it would change the scenario silently.
        if isinstance(tree, MappingNode) and os.path.lexists(defaults_file) and path.name != DEFAULTS_FILE:
            below, more = self._read_defaults(defaults_file)
            problems = [*problems, *more]
            if isinstance(below, MappingNode):
                tree = extend_mapping(tree, below)
            elif not more and below is not None:
                message = "expected a mapping at top level"
                problems = [*problems, Problem(self.sandbox.display_name(defaults_file), 0, 0, "SC004", message)]
        return tree, problems

    def add(self, texts: Mapping[str, str], files: Mapping[str, Path]) -> None:
        """Add texts and paths of files that were read without this library, by their names in messages."""
        self.texts |= texts
        self.files |= files

    def folder_of(self, position: Position) -> Path:
        """Return the folder of the file that contains a position. Paths written in the file are relative to it."""
        return self.files[position.path].parent

    def with_source(self, problems: list[Problem]) -> list[Problem]:
        """Return the problems with the texts of their source lines."""
        return [self._with_source_line(problem) for problem in problems]

    def with_source_where_missing(self, problems: list[Problem]) -> list[Problem]:
        """Return the problems with the texts of their source lines; texts that are set already are kept."""
        return [problem if problem.source else self._with_source_line(problem) for problem in problems]

    def _with_source_line(self, problem: Problem) -> Problem:
        lines = self.texts.get(problem.path, "").split("\n")
        return replace(problem, source=lines[problem.line - 1]) if 0 < problem.line <= len(lines) else problem

    def _read_with_base(self, path: Path, chain: tuple[Path, ...]) -> tuple[Node | None, list[Problem]]:
        """Return the tree of a file merged with what it extends; `chain` are the files that extend it, in order."""
        tree, problems = self._read_file(path)
        if not isinstance(tree, MappingNode) or EXTENDS not in tree.entries:
            return tree, problems
        entry = tree.entries[EXTENDS]
        own = tree.without_keys(EXTENDS)
        base = self._base_file(entry, path, (*chain, path))
        if isinstance(base, Problem):
            return own, [*problems, base]
        below, more = self._read_with_base(base, (*chain, path))
        if isinstance(below, MappingNode):
            return extend_mapping(own, below), problems + more
        return own, problems + more

    def _read_defaults(self, defaults_file: Path) -> tuple[Node | None, list[Problem]]:
        path = self.sandbox.resolve_argument(defaults_file)
        return (None, [path]) if isinstance(path, Problem) else self._read_with_base(path, ())

    def _read_file(self, path: Path) -> tuple[Node | None, list[Problem]]:
        name = self.sandbox.display_name(path)
        self.files[name] = path
        text = self.unsaved[path] if path in self.unsaved else read_text(path, name)
        if isinstance(text, Problem):
            return None, [text]
        self.texts[name] = text
        return parse_yaml(text, name)

    def _base_file(self, entry: Entry, path: Path, chain: tuple[Path, ...]) -> Path | Problem:
        """Return the file that the entry `extends` of the file `path` names, or why it cannot be extended."""
        position = entry.value.position
        if not isinstance(entry.value, ScalarNode) or not isinstance(entry.value.value, str):
            return Problem(*position, "SC011", f"`{EXTENDS}` must be the path of one file")
        base = self.sandbox.find(entry.value.value, path.parent)
        if isinstance(base, PathProblem):
            return Problem(*position, base.code, base.message, base.hint)
        if base in chain:
            names = " → ".join(self.sandbox.display_name(file) for file in (*chain[chain.index(base) :], base))
            return Problem(*position, "SC024", f"circular `extends`: {names}")
        if len(self.files) >= MAX_FILES:
            return Problem(*position, "SC024", f"a scenario can extend at most {MAX_FILES} files")
        return base


def extend_mapping(over: MappingNode, under: MappingNode) -> MappingNode:
    """Return the top-level mapping `over` of a file merged with the mapping `under` of the file that it extends.

    The items of a key such as `pass+` in `over` are added to the list `pass` or `pass+` in `under`. If `under` has
    neither, the key `pass+` is kept: a `defaults.yaml`, which is merged later, may have the list.
    """
    entries = dict(over.entries)
    for key, more in over.entries.items():
        name = key.removesuffix(APPEND_SUFFIX)
        if name == key or name in over.entries or not isinstance(more.value, SequenceNode):
            continue
        for known in (name, key):
            below = under.entries.get(known)
            if below is not None and isinstance(below.value, SequenceNode):
                del entries[key]
                items = (*below.value.items, *more.value.items)
                entries[known] = Entry(more.key, SequenceNode(more.value.position, items))
                break
    return merge_mappings(MappingNode(over.position, entries), under)


def merge_mappings(over: MappingNode, under: MappingNode) -> MappingNode:
    """Return the keys of both mappings. For a key in both, the value in `over` is used, or mappings are merged.

    A mapping with another `type` is not merged. An external stack is not merged with a stack of another kind.
    """
    entries = dict(over.entries)
    for key, below in under.entries.items():
        above = entries.get(key)
        if above is None:
            entries[key] = below
        elif (
            isinstance(above.value, MappingNode)
            and isinstance(below.value, MappingNode)
            and _are_mergeable(key, above, below)
        ):
            entries[key] = Entry(above.key, merge_mappings(above.value, below.value))
    return MappingNode(over.position, entries)


def _are_mergeable(key: str, above: Entry, below: Entry) -> bool:
    """Return whether two mappings with the same key describe a thing of the same type."""
    if key == "stack" and (
        (_has_key(above, "external") and not _has_key(below, "external"))
        or (_has_key(above, "type") and _has_key(below, "external"))
    ):
        return False
    types = [
        entry.value.entries["type"].value.plain
        for entry in (above, below)
        if isinstance(entry.value, MappingNode) and "type" in entry.value.entries
    ]
    return len(types) < 2 or types[0] == types[1]


def _has_key(entry: Entry, key: str) -> bool:
    return isinstance(entry.value, MappingNode) and key in entry.value.entries
