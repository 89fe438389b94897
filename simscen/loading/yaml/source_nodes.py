"""Find where each value of a YAML text begins and ends, so that an editor can replace single values in the text."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import yaml
from yaml import events as ev

from simscen.loading.yaml.tree import Key

_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass(frozen=True)
class SourceNode:
    """Value in a text: `text[start:end]` is the value without its anchor and tag, and without comments after it.

    `flow` is true for collections in brackets or braces, and for values inside of them (YAML's flow style). `style` is
    the first character of a scalar that is quoted or a block (`"`, `'`, `|`, or `>`); "" for other values. Sequences
    have `items`, mappings have `entries`.
    """

    kind: Literal["scalar", "sequence", "mapping", "alias"]
    start: int
    end: int
    flow: bool
    style: str = ""
    items: tuple["SourceNode", ...] = ()
    entries: dict[str, "SourceEntry"] = field(default_factory=dict)


@dataclass(frozen=True)
class SourceEntry:
    """Key and value in a mapping; the key is `text[start:end]`."""

    start: int
    end: int
    value: SourceNode


def parse_source(text: str) -> SourceNode | None:
    """Return the root of the first document of a text; None if it cannot be parsed."""
    try:
        events = yaml.parse(text, Loader=_Loader)
        start = next(event for event in events if isinstance(event, ev.NodeEvent))
        return _Composer(text, events).node(start, flow=False)
    except (yaml.YAMLError, StopIteration, RecursionError):
        return None


def source_at(node: SourceNode, keys: Sequence[Key]) -> SourceNode | None:
    """Return the node at `keys`; None if there is none, or if it belongs to an alias, and so is written elsewhere."""
    for key in keys:
        if isinstance(key, int) and node.kind == "sequence" and 0 <= key < len(node.items):
            node = node.items[key]
        elif node.kind == "mapping" and str(key) in node.entries:
            node = node.entries[str(key)].value
        else:
            return None
    return node


class _Composer:
    """Builds source nodes from PyYAML's events."""

    def __init__(self, text: str, events: Iterator[ev.Event]) -> None:
        self._text, self._events = text, events

    def node(self, event: ev.Event, flow: bool) -> SourceNode:
        """Return the node that begins with `event`; `flow` means that it is inside of brackets or braces."""
        start, end = _index(event.start_mark), _index(event.end_mark)
        if isinstance(event, ev.AliasEvent):
            return SourceNode("alias", start, end, flow)
        assert isinstance(event, ev.NodeEvent)
        start = self._after_properties(event, start)
        if isinstance(event, ev.ScalarEvent):
            style = "" if event.style in (None, "") else str(event.style)
            end = start + len(self._text[start:end].rstrip())  # without the line breaks after a block
            return SourceNode("scalar", start, end, flow, style)
        flow = flow or self._text[start : start + 1] in ("[", "{")
        if isinstance(event, ev.SequenceStartEvent):
            return self._sequence(start, flow)
        return self._mapping(start, flow)

    def _sequence(self, start: int, flow: bool) -> SourceNode:
        items = []
        while not isinstance(event := next(self._events), ev.SequenceEndEvent):
            items.append(self.node(event, flow))
        end = _index(event.end_mark) if flow or not items else items[-1].end
        return SourceNode("sequence", start, end, flow, items=tuple(items))

    def _mapping(self, start: int, flow: bool) -> SourceNode:
        entries: dict[str, SourceEntry] = {}
        last = start
        while not isinstance(event := next(self._events), ev.MappingEndEvent):
            key = self.node(event, flow)
            name = event.value if isinstance(event, ev.ScalarEvent) else self._text[key.start : key.end]
            value = self.node(next(self._events), flow)
            last = max(value.end, key.end)
            entries.setdefault(str(name), SourceEntry(key.start, key.end, value))
        end = _index(event.end_mark) if flow else last
        return SourceNode("mapping", start, end, flow, entries=entries)

    def _after_properties(self, event: ev.NodeEvent, start: int) -> int:
        """Return the index after the anchor and the tag (YAML's node properties) of a node that begins at `start`."""
        for _ in range(2):
            if self._text[start : start + 1] in ("&", "!") and (event.anchor or getattr(event, "tag", None)):
                while start < len(self._text) and not self._text[start].isspace():
                    start += 1
                while start < len(self._text) and self._text[start].isspace():
                    start += 1
        return start


def _index(mark: Any) -> int:
    return int(mark.index)
