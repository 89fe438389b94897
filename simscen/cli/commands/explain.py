"""Command `simscen explain`, which prints the documentation of a name of the scenario language, or of a code."""

import shutil
import textwrap
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.catalog.fields import OPTIONAL, Field
from simscen.cli.catalog.topic_lookup import all_topics, key_topics, known_names
from simscen.cli.catalog.topics import HEADINGS, Topic
from simscen.cli.diagnostics import print_text
from simscen.core.errors import UsageError
from simscen.core.messages.navigation import error_code
from simscen.loading.codes import CODES
from simscen.loading.schema.messages import quoted, suggestion
from simscen.spec.registry import GROUPS, BrokenPlugin, plugin_types

_ITEM_STARTS = ("- ", *HEADINGS)
"""Beginnings of the first line of a list item, or of a paragraph with a heading."""


def command(
    name: Annotated[
        str, typer.Argument(help="The name to explain; default: list all names.", autocompletion=completions.topics)
    ] = "",
    page: Annotated[
        bool, typer.Option("--page", help="Print the language reference, including installed types, as Markdown.")
    ] = False,
) -> None:
    """Explain a key, criterion, fault, signal, metric, component, or code.

    Examples: `simscen explain stopped_within`, `explain amcl`, `explain amcl.update_min_a`, `explain goals.pose`,
    `explain GOAL_OCCUPIED` or its number 206, `explain crashed`, `explain "exit 3"`, `explain SC012`. If a name has
    several meanings, all are explained; `simscen explain trigger.localization_error` selects one.
    """
    if page:
        from simscen.cli.catalog.language_page import language_page

        print_text(language_page(with_plugins=True).rstrip())
        return
    width = max(40, min(100, shutil.get_terminal_size().columns))
    print_text(explanation(name, width) if name else _overview(width))


def explanation(name: str, width: int = 100) -> str:
    """Return the text about a problem code, or about all topics with this name, wrapped at `width` characters.

    Raises UsageError for an unknown name.
    """
    if name.upper() in CODES:
        return f"{name.upper()}\n{_wrapped(CODES[name.upper()], width, '  ')}"
    return "\n\n".join(_topic_text(topic, width) for topic in _topics_named(name))


def _topics_named(name: str) -> list[Topic]:
    """Return the topics with this name, ignoring case. If there are none, return a topic for each key with this path.

    Raises UsageError if nothing is found.
    """
    known = all_topics()
    # An error code of a …ThroughPoses action, such as 306, has the meaning of the code of the …ToPose action.
    lowered = str(int(error_code(int(name)))) if name.isdecimal() else name.lower()
    found = [
        topic
        for topic in known
        if lowered in (topic.name.lower(), f"{topic.group}.{topic.name}".lower(), topic.alias.lower())
    ]
    found = found or key_topics(name, known)
    if not found:
        _require_usable_type(name)
        keys = known_names(keys=True) if "." in name else [field.key for topic in known for field in topic.fields]
        hint = suggestion(name, [*known_names(), *keys])
        advice = hint if hint.startswith("did") else "run `simscen explain` for a list"
        raise UsageError(f"unknown name {quoted(name)}; {advice}")
    return found


def _require_usable_type(name: str) -> None:
    """Raise UsageError if an installed package adds a type with this name that cannot be used."""
    for entry in (entry for group in GROUPS for entry in plugin_types(group) if entry.name == name):
        try:
            entry.load()
        except BrokenPlugin as error:
            raise UsageError(f"{error}; {error.hint}") from None


def _overview(width: int) -> str:
    groups: dict[str, list[str]] = {}
    for topic in all_topics():
        groups.setdefault(topic.group, []).append(topic.name)
    lines = [f"{group}:\n{_wrapped(', '.join(names), width, '  ')}" for group, names in groups.items()]
    return "\n".join(
        [*lines, "", "Run `simscen explain NAME` for details, also for keys (`amcl.update_min_a`) and codes (SC012)."]
    )


def _topic_text(topic: Topic, width: int) -> str:
    kind = f"{topic.group} of {topic.origin}" if topic.origin else topic.group
    paragraphs = [_wrapped_paragraph(paragraph, width) for paragraph in topic.text.split("\n\n")]
    parts = [f"{topic.name} ({kind})", "\n\n".join(paragraphs)]
    if topic.value:
        parts.append(f"  Value: {topic.value}")
    if topic.fields:
        parts.append("\n".join(_field(field, width) for field in topic.fields))
    if topic.example:
        parts.append(f"  Example: {topic.example}")
    return "\n\n".join(part for part in parts if part)


def _field(field: Field, width: int) -> str:
    default = "required" if not field.default else "" if field.default == OPTIONAL else f"default {field.default}"
    head = f"  {field.key}: {field.kind}" + (f" ({default})" if default else "")
    return "\n".join([head, _wrapped(field.text, width, "      ")]) if field.text else head


def _wrapped_paragraph(paragraph: str, width: int) -> str:
    """Return a wrapped paragraph, with list items and headings such as "When it fails:" on new lines."""
    items: list[str] = []
    for line in paragraph.splitlines():
        if line.startswith(" ") and items:
            items[-1] += " " + line.strip()
        elif items and not line.startswith(_ITEM_STARTS):
            items[-1] += " " + line
        else:
            items.append(line)
    return "\n".join(_wrapped(item, width, "  ") for item in items)


def _wrapped(text: str, width: int, indent: str) -> str:
    return textwrap.fill(" ".join(text.split()), width, initial_indent=indent, subsequent_indent=indent)
