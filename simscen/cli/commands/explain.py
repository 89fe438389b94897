"""Command `simscen explain`, which prints the documentation of a name of the scenario language, or of a code."""

import shutil
import textwrap
from typing import Annotated

import typer

from simscen.cli import completions
from simscen.cli.catalog.fields import OPTIONAL, Field
from simscen.cli.catalog.topic_lookup import all_topics, key_topics, known_names
from simscen.cli.catalog.topics import Topic
from simscen.cli.diagnostics import print_text
from simscen.core.errors import UsageError
from simscen.loading.codes import CODES
from simscen.loading.schema.messages import quoted, suggestion


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
        from simscen.cli.catalog.generate import language_page

        print_text(language_page(installed=True).rstrip())
        return
    width = max(40, min(100, shutil.get_terminal_size().columns))
    if not name:
        print_text(_overview(width))
    else:
        print_text(explanation(name, width))


def explanation(name: str, width: int = 100) -> str:
    """Return the text about a problem code, or about all topics with this name, wrapped at `width` characters.

    Raises UsageError for an unknown name.
    """
    if name.upper() in CODES:
        return f"{name.upper()}\n{_wrapped(CODES[name.upper()], width, '  ')}"
    return "\n\n".join(_topic_text(topic, width) for topic in _topics_named(name))


def _topics_named(name: str) -> list[Topic]:
    """Return the topics with this name, ignoring case, or else of the keys with this path. Raises UsageError."""
    known = all_topics()
    lowered = name.lower()
    found = [topic for topic in known if lowered in (name.lower() for name in _names(topic))]
    found = found or key_topics(name, known)
    if not found:
        hint = suggestion(name, [*known_names(), *(known_names(keys=True) if "." in name else _key_names(known))])
        raise UsageError(
            f"unknown name {quoted(name)}; " + (hint if hint.startswith("did") else "run `simscen explain` for a list")
        )
    return found


def _names(topic: Topic) -> tuple[str, ...]:
    """Return all names of a topic: name, `group.name`, and alias."""
    return (topic.name, f"{topic.group}.{topic.name}", *((topic.alias,) if topic.alias else ()))


def _key_names(topics: list[Topic]) -> list[str]:
    return [field.key for topic in topics for field in topic.fields]


def _overview(width: int) -> str:
    """Return the text for a call without a name: all names by group."""
    groups: dict[str, list[str]] = {}
    for topic in all_topics():
        groups.setdefault(topic.group, []).append(topic.name)
    lines = [f"{group}:\n{_wrapped(', '.join(names), width, '  ')}" for group, names in groups.items()]
    return "\n".join(
        [*lines, "", "Run `simscen explain NAME` for details, also for keys (`amcl.update_min_a`) and codes (SC012)."]
    )


def _topic_text(topic: Topic, width: int) -> str:
    """Return the text about one topic."""
    kind = f"{topic.group} of {topic.origin}" if topic.origin else topic.group
    parts = [f"{topic.name} ({kind})", _paragraphs(topic.text, width)]
    if topic.value:
        parts.append(f"  Value: {topic.value}")
    if topic.fields:
        parts.append("\n".join(_field(field, width) for field in topic.fields))
    if topic.example:
        parts.append(f"  Example: {topic.example}")
    return "\n\n".join(part for part in parts if part)


def _field(field: Field, width: int) -> str:
    """Return the lines about one key."""
    needed = "required" if not field.default else "" if field.default == OPTIONAL else f"default {field.default}"
    head = f"  {field.key}: {field.kind}" + (f" ({needed})" if needed else "")
    return "\n".join([head, _wrapped(field.text, width, "      ")]) if field.text else head


def _paragraphs(text: str, width: int) -> str:
    return "\n\n".join(_lines(paragraph, width) for paragraph in text.split("\n\n"))


def _lines(paragraph: str, width: int) -> str:
    """Return a wrapped paragraph, with list items and headings such as "When it fails:" on new lines."""
    items: list[str] = []
    for line in paragraph.splitlines():
        if line.startswith(" ") and items:
            items[-1] += " " + line.strip()
        elif items and not _begins_item(line):
            items[-1] += " " + line
        else:
            items.append(line)
    return "\n".join(_wrapped(item, width, "  ") for item in items)


def _begins_item(line: str) -> bool:
    """Return whether a line begins a list item or a headed paragraph."""
    return line.startswith(("- ", "What is measured:", "When it fails:", "Why this:", "Source:"))


def _wrapped(text: str, width: int, indent: str) -> str:
    return textwrap.fill(" ".join(text.split()), width, initial_indent=indent, subsequent_indent=indent)
