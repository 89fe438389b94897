"""Writes data as YAML 1.2 text: completely new text, or text that keeps the unchanged lines of an existing text."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import yaml

from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.scalars import parse_scalar
from simscen.loading.yaml.tree import MappingNode, SequenceNode

if TYPE_CHECKING:
    from simscen.model.world import WorldSpec

_TAGS = {str: "str", bool: "bool", int: "int", float: "float", type(None): "null"}
"""Names of YAML types, by Python type."""
# Characters that `read_text` rejects, and line breaks of YAML 1.1; strings with one of them are written with escapes.
_NEEDS_ESCAPES = re.compile("[\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff\ufffe\uffff]")


class Dumper(yaml.SafeDumper):
    """PyYAML dumper for YAML 1.2. It quotes text such as `1e3` (a number in YAML 1.2), but not `on` or `1:30`."""

    def resolve(self, kind: type[yaml.Node], value: Any, implicit: Any) -> Any:
        """Return the tag of a node. For a scalar without quotes, `parse_scalar` determines the tag."""
        if kind is yaml.ScalarNode and implicit[0]:
            try:
                return f"tag:yaml.org,2002:{_TAGS[type(parse_scalar(value))]}"
            except ValueError:  # an integer that parse_scalar rejects
                return "tag:yaml.org,2002:int"
        return super().resolve(kind, value, implicit)  # type: ignore[no-untyped-call]

    def ignore_aliases(self, data: Any) -> bool:
        """Return True, so that no aliases are written."""
        return True


def to_yaml(data: Any, dumper: type[Dumper] = Dumper) -> str:
    """Return data as YAML text, which `parse_yaml` reads back unchanged. Keys must be text, and keep their order."""
    text: str = yaml.dump(data, Dumper=dumper, sort_keys=False, allow_unicode=True, width=1000)
    if _NEEDS_ESCAPES.search(text):
        text = yaml.dump(data, Dumper=dumper, sort_keys=False, allow_unicode=False, width=1000)
    return text


class CompactDumper(Dumper):
    """YAML dumper that writes lists without mappings in brackets, and inner mappings with a scalar in braces."""


def _represent_list(dumper: yaml.SafeDumper, value: list[Any]) -> yaml.Node:
    is_flow = not any(isinstance(item, dict) for item in value)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", value, flow_style=is_flow)


def _represent_mapping(dumper: yaml.SafeDumper, value: dict[str, Any]) -> yaml.Node:
    """Return the YAML node of a mapping, in braces if it contains a scalar and is not the whole file."""
    is_flow = any(not isinstance(item, dict | list) for item in value.values()) and "simscen" not in value
    return dumper.represent_mapping("tag:yaml.org,2002:map", value, flow_style=is_flow)


CompactDumper.add_representer(list, _represent_list)
CompactDumper.add_representer(dict, _represent_mapping)


def world_text(spec: WorldSpec) -> str:
    """Return the text of a `*.world.yaml` file with this world, without default values."""
    data = spec.model_dump(mode="json", exclude_defaults=True)
    return to_yaml(_in_order(data), CompactDumper)


def _in_order(value: Any) -> Any:
    """Return the data with the keys `simscen` and `name` at the beginning of each mapping."""
    if isinstance(value, list):
        return [_in_order(item) for item in value]
    if not isinstance(value, dict):
        return value
    first = [key for key in ("simscen", "name") if key in value]
    return {key: _in_order(value[key]) for key in dict.fromkeys((*first, *value))}


LINE_WIDTH_CHARS = 100
"""Maximum length of a line. Longer new lists and mappings continue in the next line."""


def changed_text(text: str, path: str, content: Mapping[str, Any], comment: str = "") -> str:
    """Return `content` as YAML text with `comment` at the top. `path` is the path of `text` in messages.

    Top-level keys and list items with the same value in `text` keep their lines, and the comments directly above these
    lines. If the new text would not have the value `content`, for example because of YAML anchors, no lines are kept.
    """
    original, _ = parse_yaml(text, path)
    assert isinstance(original, MappingNode), "the text of a valid scenario is a mapping"
    lines = text.splitlines()
    known, segments = original.plain, _segments(original, lines)
    head = "".join(f"# {line}\n" for line in comment.splitlines())
    parts = [head]
    for key, value in content.items():
        if key in segments and known.get(key) == value:
            parts.append(_joined_lines(segments[key]))
        elif key in segments and isinstance(value, list):
            parts.append(_list_text(key, value, original, lines, segments[key]))
        else:
            parts.append(_entry_text(key, value))
    new_text = "".join(parts)
    tree, problems = parse_yaml(new_text, path)
    if problems or tree is None or tree.plain != content:
        return head + to_yaml(content)
    return new_text


def _segments(original: MappingNode, lines: Sequence[str]) -> dict[str, list[str]]:
    """Return the lines of each top-level key and of the comments directly above; {} for a mapping in braces."""
    keys = sorted(original.entries, key=lambda key: original.entries[key].key.line)
    if any(original.entries[key].key.col != 1 for key in keys):
        return {}
    starts = [_comment_start(original.entries[key].key.line - 1, lines) for key in keys]
    ends = [*starts[1:], len(lines)]
    return {key: list(lines[start:end]) for key, start, end in zip(keys, starts, ends, strict=True)}


def _comment_start(start: int, lines: Sequence[str]) -> int:
    """Return the index of the first comment line directly above the line `start`; `start` if there is no comment."""
    while start > 0 and lines[start - 1].lstrip().startswith("#"):
        start -= 1
    return start


def _list_text(key: str, value: list[Any], original: MappingNode, lines: Sequence[str], segment: Sequence[str]) -> str:
    """Return the text of a key with the list `value`, in which unchanged items keep their lines.

    `lines` are all lines of the original text, `segment` are the lines of this key.
    """
    node = original.entries[key].value
    start = original.entries[key].key.line - 1
    if not isinstance(node, SequenceNode) or not value or not node.items:
        return _entry_text(key, value)
    first_lines = [item.position.line - 1 for item in node.items]
    begin_lines = all(lines[line].lstrip().startswith("- ") for line in first_lines)
    if not begin_lines or len(set(first_lines)) < len(first_lines) or first_lines[0] == start:
        return _entry_text(key, value)
    starts = [_comment_start(line, lines) for line in first_lines]
    end = _comment_start(start, lines) + len(segment)
    ends = [*starts[1:], end]
    indent = len(lines[first_lines[0]]) - len(lines[first_lines[0]].lstrip())
    texts = [_joined_lines(lines[first:last]) for first, last in zip(starts, ends, strict=True)]
    head = _joined_lines(lines[_comment_start(start, lines) : starts[0]])
    parts, remaining = [], list(zip((item.plain for item in node.items), texts, strict=True))
    for item in value:
        same = next((index for index, (plain, _) in enumerate(remaining) if plain == item), None)
        if same is None:
            parts.append(textwrap.indent(_dump_innermost_flow([item]), " " * indent))
        else:
            parts.append(remaining[same][1])
            remaining = remaining[same + 1 :]
    return head + "".join(parts)


def _joined_lines(lines: Sequence[str]) -> str:
    """Return lines as text, without blank lines at the end."""
    trimmed = list(lines)
    while trimmed and not trimmed[-1].strip():
        trimmed.pop()
    return "".join(f"{line}\n" for line in trimmed)


def _entry_text(key: str, value: Any) -> str:
    """Return the YAML text of a top-level key and its value, without braces."""
    text = _dump_innermost_flow({key: value})
    is_braced = text.startswith("{")
    return f"{text.strip()[1:-1]}\n" if is_braced else text


def _dump_innermost_flow(data: Any) -> str:
    """Return YAML text in which only the innermost collections are in braces or brackets."""
    text: str = yaml.dump(
        data, Dumper=Dumper, sort_keys=False, allow_unicode=True, width=LINE_WIDTH_CHARS, default_flow_style=None
    )
    return text
