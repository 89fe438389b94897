"""One YAML document out of several files: `extends:` and the `defaults.yaml` beside it."""

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
EXTENDS = "extends"
MAX_FILES = 32
APPEND_SUFFIX = "+"
"""Behind the key of a list at top level: what stands there is added to that of the file that is extended."""


@dataclass
class Library:
    """Reads the files of one scenario and keeps their texts, so that problems can show their lines.

    `texts` and `files` are by the name that problems use; `loaded` is what was made of files, for whoever asks again.
    """

    fence: PathSandbox
    texts: dict[str, str] = field(default_factory=dict)
    files: dict[str, Path] = field(default_factory=dict)
    loaded: dict[tuple[str, Path], Any] = field(default_factory=dict)

    def read(self, path: Path, defaults: bool = False) -> tuple[Node | None, list[Problem]]:
        """The tree of `path` with what it extends, and with `defaults`, the `defaults.yaml` beside it, merged in."""
        tree, problems = self._with_base(path, ())
        beside = path.parent / DEFAULTS_FILE
        # Whatever is called so is meant to be read: one that cannot be is told rather than passed over.
        if defaults and isinstance(tree, MappingNode) and os.path.lexists(beside) and path.name != DEFAULTS_FILE:
            below, more = self._defaults(beside)
            problems += more
            if isinstance(below, MappingNode):
                tree = extend_mapping(tree, below)
            elif not more and below is not None:
                problems.append(Problem(self.fence.shown(beside), 0, 0, "SC004", "expected a mapping at top level"))
        return tree, problems

    def add(self, texts: Mapping[str, str], files: Mapping[str, Path]) -> None:
        """Know files that were read elsewhere, by the names that problems use for them here."""
        self.texts |= texts
        self.files |= files

    def folder_of(self, place: Position) -> Path:
        """The folder of the file in which something stands: what paths there are relative to."""
        return self.files[place.path].parent

    def with_source(self, problems: list[Problem]) -> list[Problem]:
        """The problems with the text of their lines."""
        return [self._sourced(problem) for problem in problems]

    def with_source_where_missing(self, problems: list[Problem]) -> list[Problem]:
        """Likewise, of problems some of which are in files that were read elsewhere and have it."""
        return [problem if problem.source else self._sourced(problem) for problem in problems]

    def _sourced(self, problem: Problem) -> Problem:
        lines = self.texts.get(problem.path, "").split("\n")
        return replace(problem, source=lines[problem.line - 1]) if 0 < problem.line <= len(lines) else problem

    def _with_base(self, path: Path, chain: tuple[Path, ...]) -> tuple[Node | None, list[Problem]]:
        tree, problems = self._one(path)
        if not isinstance(tree, MappingNode) or EXTENDS not in tree.entries:
            return tree, problems
        entry = tree.entries[EXTENDS]
        own = MappingNode(tree.place, {key: value for key, value in tree.entries.items() if key != EXTENDS})
        base = self._base(entry, path, (*chain, path))
        if isinstance(base, Problem):
            return own, [*problems, base]
        below, more = self._with_base(base, (*chain, path))
        if isinstance(below, MappingNode):
            return extend_mapping(own, below), problems + more
        return own, problems + more

    def _defaults(self, beside: Path) -> tuple[Node | None, list[Problem]]:
        entered = self.fence.entered(beside)
        return (None, [entered]) if isinstance(entered, Problem) else self._with_base(entered, ())

    def _one(self, path: Path) -> tuple[Node | None, list[Problem]]:
        shown = self.fence.shown(path)
        self.files[shown] = path
        text = read_text(path, shown)
        if isinstance(text, Problem):
            return None, [text]
        self.texts[shown] = text
        return parse_yaml(text, shown)

    def _base(self, entry: Entry, path: Path, chain: tuple[Path, ...]) -> Path | Problem:
        place = entry.value.place
        if not isinstance(entry.value, ScalarNode) or not isinstance(entry.value.value, str):
            return Problem(*place, "SC011", f"`{EXTENDS}` expects the path of one file")
        base = self.fence.find(entry.value.value, path.parent)
        if isinstance(base, PathProblem):
            return Problem(*place, base.code, base.message, base.hint)
        if base in chain:
            names = " → ".join(self.fence.shown(file) for file in (*chain[chain.index(base) :], base))
            return Problem(*place, "SC024", f"files extend each other in a circle: {names}")
        if len(self.files) >= MAX_FILES:
            return Problem(*place, "SC024", f"more than {MAX_FILES} files extend each other")
        return base


def extend_mapping(over: MappingNode, under: MappingNode) -> MappingNode:
    """The file `over` with what `under` says besides; `pass+` and the like add to the list that is there.

    Where there is none yet, the key stays: a file further below may have it.
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
                entries[known] = Entry(more.key, SequenceNode(more.value.place, items))
                break
    return merge_mappings(MappingNode(over.place, entries), under)


def merge_mappings(over: MappingNode, under: MappingNode) -> MappingNode:
    """Keys of `over` win; mappings on both sides are merged, everything else is replaced as a whole.

    Mappings whose `type` differs are different things and are replaced, too, as is a stack by an `external` one, and
    that by one with a `type`.
    """
    entries = dict(over.entries)
    for key, below in under.entries.items():
        above = entries.get(key)
        if above is None:
            entries[key] = below
        elif (
            isinstance(above.value, MappingNode)
            and isinstance(below.value, MappingNode)
            and _same_type(key, above, below)
        ):
            entries[key] = Entry(above.key, merge_mappings(above.value, below.value))
    return MappingNode(over.place, entries)


def _same_type(key: str, above: Entry, below: Entry) -> bool:
    if key == "stack" and (
        (_has(above, "external") and not _has(below, "external")) or (_has(above, "type") and _has(below, "external"))
    ):
        return False
    types = [
        entry.value.entries["type"].value.plain
        for entry in (above, below)
        if isinstance(entry.value, MappingNode) and "type" in entry.value.entries
    ]
    return len(types) < 2 or types[0] == types[1]


def _has(entry: Entry, key: str) -> bool:
    return isinstance(entry.value, MappingNode) and key in entry.value.entries
