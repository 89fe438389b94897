"""Nodes with the start and end of each value in a YAML text, so that the editor can replace single values."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import yaml
from yaml import events as ev

from simscen.loading.yaml.tree import Key

_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass(frozen=True)
class SourceNode:
    """Value in a YAML text. `text[start:end]` is the value without its anchor, its tag, and comments after it."""

    kind: Literal["scalar", "sequence", "mapping", "alias"]
    start: int
    end: int
    is_flow: bool
    """Whether the value is in YAML's flow style: a collection in brackets or braces, or a value inside one."""
    style: str = ""
    """First character of a quoted scalar or block scalar: `"`, `'`, `|`, or `>`; "" for other values."""
    items: tuple["SourceNode", ...] = ()
    entries: dict[str, "SourceEntry"] = field(default_factory=dict)


@dataclass(frozen=True)
class SourceEntry:
    """Key and value in a mapping; the key is `text[start:end]`."""

    start: int
    end: int
    value: SourceNode


def parse_source(text: str) -> SourceNode | None:
    """Return the root of the first YAML document in a text; None if it cannot be parsed."""
    try:
        events = yaml.parse(text, Loader=_Loader)
        start = next(event for event in events if isinstance(event, ev.NodeEvent))
        return _Composer(text, events).compose_node(start, is_flow=False)
    except (yaml.YAMLError, StopIteration, RecursionError):
        return None


def source_at(node: SourceNode, keys: Sequence[Key]) -> SourceNode | None:
    """Return the node at `keys`; None if there is none, or if an alias contains it."""
    for key in keys:
        if isinstance(key, int) and node.kind == "sequence" and 0 <= key < len(node.items):
            node = node.items[key]
        elif node.kind == "mapping" and str(key) in node.entries:
            node = node.entries[str(key)].value
        else:
            return None
    return node


class _Composer:
    """Builds the nodes of a text from PyYAML's events."""

    def __init__(self, text: str, events: Iterator[ev.Event]) -> None:
        self._text, self._events = text, events

    def compose_node(self, event: ev.Event, is_flow: bool) -> SourceNode:
        """Return the node that begins with `event`. `is_flow` is true inside brackets or braces."""
        start, end = _index(event.start_mark), _index(event.end_mark)
        if isinstance(event, ev.AliasEvent):
            return SourceNode("alias", start, end, is_flow)
        assert isinstance(event, ev.NodeEvent)
        start = self._after_properties(event, start)
        if isinstance(event, ev.ScalarEvent):
            style = "" if event.style in (None, "") else str(event.style)
            end = start + len(self._text[start:end].rstrip())  # without the line breaks after a block
            return SourceNode("scalar", start, end, is_flow, style)
        is_flow = is_flow or self._text[start : start + 1] in ("[", "{")
        if isinstance(event, ev.SequenceStartEvent):
            return self._compose_sequence(start, is_flow)
        return self._compose_mapping(start, is_flow)

    def _compose_sequence(self, start: int, is_flow: bool) -> SourceNode:
        items = []
        while not isinstance(event := next(self._events), ev.SequenceEndEvent):
            items.append(self.compose_node(event, is_flow))
        end = _index(event.end_mark) if is_flow or not items else items[-1].end
        return SourceNode("sequence", start, end, is_flow, items=tuple(items))

    def _compose_mapping(self, start: int, is_flow: bool) -> SourceNode:
        entries: dict[str, SourceEntry] = {}
        last = start
        while not isinstance(event := next(self._events), ev.MappingEndEvent):
            key = self.compose_node(event, is_flow)
            name = event.value if isinstance(event, ev.ScalarEvent) else self._text[key.start : key.end]
            value = self.compose_node(next(self._events), is_flow)
            last = max(value.end, key.end)
            entries.setdefault(str(name), SourceEntry(key.start, key.end, value))
        end = _index(event.end_mark) if is_flow else last
        return SourceNode("mapping", start, end, is_flow, entries=entries)

    def _after_properties(self, event: ev.NodeEvent, start: int) -> int:
        """Return the index of a value after its anchor and its tag, which begin at the index `start`."""
        for _ in range(2):
            if self._text[start : start + 1] in ("&", "!") and (event.anchor or getattr(event, "tag", None)):
                while start < len(self._text) and not self._text[start].isspace():
                    start += 1
                while start < len(self._text) and self._text[start].isspace():
                    start += 1
        return start


def _index(mark: Any) -> int:
    return int(mark.index)
