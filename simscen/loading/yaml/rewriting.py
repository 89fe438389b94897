"""Rewriting of a YAML text with new content. Unchanged parts keep their lines and comments."""

import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import yaml

from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.tree import MappingNode, SequenceNode
from simscen.loading.yaml.writing import Dumper, to_yaml

LINE_WIDTH_CHARS = 100
"""Length of a line above which new lists and mappings continue in the next line."""


def changed_text(text: str, path: str, content: Mapping[str, Any], comment: str = "") -> str:
    """Return `content` as YAML text with `comment` at the top.

    Top-level keys and list items with the same value in `text` keep their lines, with the comments directly above.
    If the result would not be equal to `content`, for example because of YAML anchors, no lines are kept.
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
            parts.append(_entry(key, value))
    whole = "".join(parts)
    written, problems = parse_yaml(whole, path)
    if problems or written is None or written.plain != content:
        return head + to_yaml(content)
    return whole


def _segments(original: MappingNode, lines: Sequence[str]) -> dict[str, list[str]]:
    """Return the lines of each top-level key, with the comments directly above it; {} for a mapping in braces."""
    keys = sorted(original.entries, key=lambda key: original.entries[key].key.line)
    if any(original.entries[key].key.col != 1 for key in keys):
        return {}
    starts = [_with_comments(original.entries[key].key.line - 1, lines) for key in keys]
    ends = [*starts[1:], len(lines)]
    return {key: list(lines[start:end]) for key, start, end in zip(keys, starts, ends, strict=True)}


def _with_comments(start: int, lines: Sequence[str]) -> int:
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
        return _entry(key, value)
    first_lines = [item.position.line - 1 for item in node.items]
    begin_lines = all(lines[line].lstrip().startswith("- ") for line in first_lines)
    if not begin_lines or len(set(first_lines)) < len(first_lines) or first_lines[0] == start:
        return _entry(key, value)
    starts = [_with_comments(line, lines) for line in first_lines]
    end = _with_comments(start, lines) + len(segment)
    ends = [*starts[1:], end]
    indent = len(lines[first_lines[0]]) - len(lines[first_lines[0]].lstrip())
    texts = [_joined_lines(lines[first:last]) for first, last in zip(starts, ends, strict=True)]
    head = _joined_lines(lines[_with_comments(start, lines) : starts[0]])
    parts, rest = [], list(zip((item.plain for item in node.items), texts, strict=True))
    for item in value:
        same = next((index for index, (plain, _) in enumerate(rest) if plain == item), None)
        if same is None:
            parts.append(textwrap.indent(_dump_innermost_flow([item]), " " * indent))
        else:
            parts.append(rest[same][1])
            rest = rest[same + 1 :]
    return head + "".join(parts)


def _joined_lines(lines: Sequence[str]) -> str:
    """Return lines as text, without blank lines at the end."""
    trimmed = list(lines)
    while trimmed and not trimmed[-1].strip():
        trimmed.pop()
    return "".join(f"{line}\n" for line in trimmed)


def _entry(key: str, value: Any) -> str:
    """Return the YAML text of a top-level key and its value, without braces around them."""
    text = _dump_innermost_flow({key: value})
    is_braced = text.startswith("{")
    return f"{text.strip()[1:-1]}\n" if is_braced else text


def _dump_innermost_flow(data: Any) -> str:
    """Return YAML text in which only the innermost collections are in braces or brackets."""
    text: str = yaml.dump(
        data, Dumper=Dumper, sort_keys=False, allow_unicode=True, width=LINE_WIDTH_CHARS, default_flow_style=None
    )
    return text
