"""YAML parser that returns a tree with positions, and limits the depth and the number of values of files."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import yaml
from yaml import events as ev

from simscen.core.errors import Problem
from simscen.loading.yaml.scalars import parse_scalar
from simscen.loading.yaml.syntax_problems import syntax_problem
from simscen.loading.yaml.tree import Entry, MappingNode, Node, Position, ScalarNode, SequenceNode, nodes_with_keys

MAX_DEPTH = 40
"""Maximum level of a value in nested mappings and lists. The level of the top-level value is 1."""
MAX_VALUES = 100_000
"""Maximum number of keys and values of a file, after the expansion of aliases."""

# The tree is built from PyYAML's events. PyYAML's constructors accept duplicate keys silently, expand alias bombs, and
# overflow the C stack at 30 000 brackets. libyaml yields the same events ten times faster, if PyYAML was built with it.
_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_LIBYAML_TOO_DEEP = "exceeded maximum nesting depth"
"""Message of libyaml for a file that is deeper than libyaml's limit."""


class _ParseError(Exception):
    """Parsing cannot continue because of `problem`."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem


def parse_yaml(text: str, path: str, *, allow_duplicates: bool = False) -> tuple[Node | None, list[Problem]]:
    """Return the only document of `text` as a tree (None if it cannot be parsed), and all problems.

    With `allow_duplicates`, a repeated key is only a warning, and the last value is used, as in ROS 2 parameter files.
    """
    composer = _Composer(path, text, allow_duplicates)
    try:
        root = composer.compose_document()
    except _ParseError as error:
        return None, [*composer.problems, error.problem]
    return root, composer.problems


@dataclass
class _Composer:
    """Builds the tree of a text from PyYAML's events, and collects problems.

    `path` is the path of the text in messages. In the methods, `depth` is the level of a node, from 1.
    """

    path: str
    text: str
    allow_duplicates: bool = False
    problems: list[Problem] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._events = self._parse_events()
        self._anchors: dict[str, Node | None] = {}  # None for a node that is not complete yet
        self._value_count = 0

    def compose_document(self) -> Node | None:
        """Return the root of the only document. Raises _ParseError if there is no document, or a second one."""
        next(self._events)  # the start of the stream
        if isinstance(next(self._events), ev.StreamEndEvent):
            raise _ParseError(self._problem(None, "SC004", "the file is empty"))
        start = next(self._events)
        root = self._compose_node(start, 1)
        next(self._events)  # the end of the document
        after = next(self._events)
        if not isinstance(after, ev.StreamEndEvent):
            message = f"more than one YAML document (line {self._position_of(after).line})"
            raise _ParseError(self._problem(after, "SC004", message, "put each scenario into its own file"))
        return root

    def _parse_events(self, end: int | None = None, skip: int = 0) -> Iterator[ev.Event]:
        """Yield the events of the text up to the index `end`, without the first `skip` events. Raises _ParseError."""
        # libyaml reads ahead of its events, and since 0.2.6 it fails at a depth of 1000. The text before that place is
        # then parsed again, because its events show where it becomes deeper than MAX_DEPTH.
        count = 0
        try:
            for count, event in enumerate(yaml.parse(self.text[:end], Loader=_Loader), 1):
                if count > skip:
                    yield event
        except yaml.MarkedYAMLError as error:
            if end is None and error.problem == _LIBYAML_TOO_DEEP and error.problem_mark:
                yield from self._parse_events(error.problem_mark.index, count)
            raise _ParseError(syntax_problem(error, self.text, self.path)) from None
        except yaml.YAMLError as error:
            raise _ParseError(self._problem(None, "SC003", str(error).splitlines()[0])) from None

    def _compose_node(self, event: ev.Event, depth: int) -> Node:
        """Return the node that begins with `event`. Raises _ParseError."""
        if isinstance(event, ev.AliasEvent):
            return self._compose_alias(event, depth)
        if depth > MAX_DEPTH:
            raise _ParseError(self._problem(event, "SC006", f"nested deeper than {MAX_DEPTH}"))
        assert isinstance(event, ev.NodeEvent)
        self._report_tag(event)
        self._count_values(event, 1)
        if event.anchor is not None:
            self._anchors[event.anchor] = None
        node: Node
        if isinstance(event, ev.ScalarEvent):
            node = ScalarNode(self._position_of(event), self._scalar_value(event))
        elif isinstance(event, ev.SequenceStartEvent):
            node = self._compose_sequence(event, depth)
        else:
            node = self._compose_mapping(event, depth)
        if event.anchor is not None:
            self._anchors[event.anchor] = node
        return node

    def _scalar_value(self, event: ev.ScalarEvent) -> str | int | float | bool | None:
        """Return the value of a scalar; for an integer that is too large, report a problem and return 0."""
        if not event.implicit[0]:
            return str(event.value)
        try:
            return parse_scalar(event.value)
        except ValueError as error:
            self.problems.append(self._problem(event, "SC008", str(error)))
            return 0

    def _compose_sequence(self, start: ev.Event, depth: int) -> SequenceNode:
        items = []
        while not isinstance(event := next(self._events), ev.SequenceEndEvent):
            items.append(self._compose_node(event, depth + 1))
        return SequenceNode(self._position_of(start), tuple(items))

    def _compose_mapping(self, start: ev.Event, depth: int) -> MappingNode:
        entries: dict[str, Entry] = {}
        merged: list[Node] = []
        while not isinstance(event := next(self._events), ev.MappingEndEvent):
            key = self._read_key(event)
            value = self._compose_node(next(self._events), depth + 1)
            if key == "<<" and isinstance(value, MappingNode | SequenceNode):
                merged.extend(value.items if isinstance(value, SequenceNode) else [value])
                continue
            if key in entries:
                self._report_duplicate(event, key, entries[key].key)
            if self.allow_duplicates or key not in entries:
                entries[key] = Entry(self._position_of(event), value)
        return MappingNode(self._position_of(start), self._apply_merge_keys(start, entries, merged))

    def _apply_merge_keys(self, start: ev.Event, entries: dict[str, Entry], merged: list[Node]) -> dict[str, Entry]:
        """Return `entries` with the keys of `merged`, the values of the key `<<`. The first of equal keys counts."""
        for other in merged:
            if not isinstance(other, MappingNode):
                self.problems.append(self._problem(start, "SC003", "`<<` expects a mapping or a list of mappings"))
                continue
            entries = {**other.entries, **entries} if other.entries.keys() - entries.keys() else entries
        return entries

    def _read_key(self, event: ev.Event) -> str:
        if not isinstance(event, ev.ScalarEvent):
            raise _ParseError(self._problem(event, "SC003", "a key must be text; it is a list, a mapping or an alias"))
        self._report_tag(event)
        self._count_values(event, 1)
        return str(event.value)

    def _compose_alias(self, event: ev.AliasEvent, depth: int) -> Node:
        """Return the node of an alias. The values of the node are counted again. Raises _ParseError without anchor."""
        if event.anchor not in self._anchors:
            raise _ParseError(self._problem(event, "SC006", f"alias `*{event.anchor}` has no anchor before it"))
        node = self._anchors[event.anchor]
        if node is None:
            raise _ParseError(self._problem(event, "SC006", f"alias `*{event.anchor}` contains itself"))
        keys_below = [keys for keys, _ in nodes_with_keys(node)]
        if depth + max(map(len, keys_below)) > MAX_DEPTH:
            raise _ParseError(self._problem(event, "SC006", f"nested deeper than {MAX_DEPTH}"))
        key_count = sum(isinstance(keys[-1], str) for keys in keys_below[1:])
        self._count_values(event, len(keys_below) + key_count)
        return node

    def _count_values(self, event: ev.Event, count: int) -> None:
        self._value_count += count
        if self._value_count > MAX_VALUES:
            subject = "aliases expand to" if isinstance(event, ev.AliasEvent) else "the file has"
            raise _ParseError(self._problem(event, "SC006", f"{subject} more than {MAX_VALUES} values"))

    def _report_tag(self, event: ev.Event) -> None:
        tag = getattr(event, "tag", None)
        if tag is not None:
            short = tag.replace("tag:yaml.org,2002:", "!!", 1)
            message, hint = f"tag `{short}` is not allowed", "remove it; a scenario is plain data"
            self.problems.append(self._problem(event, "SC005", message, hint))

    def _report_duplicate(self, event: ev.Event, key: str, first: Position) -> None:
        message = f"duplicate key `{key}` (first at {first.line}:{first.col})"
        if self.allow_duplicates:
            problem = self._problem(event, "SC007", message, "this one is used, as in ROS 2")
            self.problems.append(replace(problem, severity="warning"))
        else:
            self.problems.append(self._problem(event, "SC007", message, "remove one of them"))

    def _position_of(self, event: ev.Event) -> Position:
        mark = event.start_mark
        assert mark is not None
        return Position(self.path, mark.line + 1, mark.column + 1)

    def _problem(self, event: ev.Event | None, code: str, message: str, hint: str = "") -> Problem:
        position = self._position_of(event) if event is not None else Position(self.path, 0, 0)
        return Problem(*position, code=code, message=message, hint=hint)
