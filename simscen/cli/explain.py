"""`simscen explain`."""

import shutil
import textwrap
from typing import Annotated

import typer

from simscen.cli.catalogue import OPTIONAL, Field, Topic, topics
from simscen.cli.diagnostics import print_text
from simscen.cli.metrics import metric_topics
from simscen.cli.signals import signal_topics
from simscen.core.errors import UsageError
from simscen.loading.codes import CODES
from simscen.loading.messages import quoted, suggestion


def command(
    name: Annotated[str, typer.Argument(help="What to explain; nothing = list what there is.")] = "",
    page: Annotated[
        bool, typer.Option("--page", help="Print the reference of the language, with what is installed, as Markdown.")
    ] = False,
) -> None:
    """Explain a trigger, action, fault, criterion, signal, metric, component or error code.

    For example `simscen explain stopped_within`, `simscen explain amcl`, `simscen explain SC012`. Where a name means
    several things, all are explained; `simscen explain trigger.localization_error` picks one.
    """
    if page:
        from simscen.cli.reference import language_page

        print_text(language_page(installed=True).rstrip())
        return
    width = max(40, min(100, shutil.get_terminal_size().columns))
    if not name:
        print_text(_overview(width))
    elif name.upper() in CODES:
        print_text(f"{name.upper()}\n{_wrapped(CODES[name.upper()], width, '  ')}")
    else:
        print_text("\n\n".join(_explained(topic, width) for topic in _called(name)))


def _everything() -> list[Topic]:
    return [*topics(installed=True), *signal_topics(), *metric_topics(installed=True)]


def _called(name: str) -> list[Topic]:
    everything = _everything()
    found = [topic for topic in everything if name in (topic.name, f"{topic.group}.{topic.name}")]
    if not found:
        known = [*dict.fromkeys(topic.name for topic in everything), *CODES]
        hint = suggestion(name, known)
        raise UsageError(
            f"nothing is called {quoted(name)}; "
            + (hint if hint.startswith("did") else "`simscen explain` lists what there is")
        )
    return found


def _overview(width: int) -> str:
    groups: dict[str, list[str]] = {}
    for topic in _everything():
        groups.setdefault(topic.group, []).append(topic.name)
    lines = [f"{group}:\n{_wrapped(', '.join(names), width, '  ')}" for group, names in groups.items()]
    return "\n".join([*lines, "", "`simscen explain NAME` tells more; error codes such as SC012 are explained, too."])


def _explained(topic: Topic, width: int) -> str:
    of = f"{topic.group} of {topic.origin}" if topic.origin else topic.group
    parts = [f"{topic.name} ({of})", _paragraphs(topic.text, width)]
    if topic.value:
        parts.append(f"  Value: {topic.value}")
    if topic.fields:
        parts.append("\n".join(_field(field, width) for field in topic.fields))
    if topic.example:
        parts.append(f"  Example: {topic.example}")
    return "\n\n".join(part for part in parts if part)


def _field(field: Field, width: int) -> str:
    needed = "required" if not field.default else "" if field.default == OPTIONAL else f"default {field.default}"
    head = f"  {field.key}: {field.kind}" + (f" ({needed})" if needed else "")
    return "\n".join([head, _wrapped(field.text, width, "      ")]) if field.text else head


def _paragraphs(text: str, width: int) -> str:
    return "\n\n".join(_lines(paragraph, width) for paragraph in text.split("\n\n"))


def _lines(paragraph: str, width: int) -> str:
    """A paragraph; headings such as "When it fails:" begin a line of their own."""
    items: list[str] = []
    for line in paragraph.splitlines():
        if line.startswith(" ") and items:
            items[-1] += " " + line.strip()
        elif items and not _is_heading(line):
            items[-1] += " " + line
        else:
            items.append(line)
    return "\n".join(_wrapped(item, width, "  ") for item in items)


def _is_heading(line: str) -> bool:
    return line.startswith(("What is measured:", "When it fails:", "Why this:", "Source:"))


def _wrapped(text: str, width: int, indent: str) -> str:
    return textwrap.fill(" ".join(text.split()), width, initial_indent=indent, subsequent_indent=indent)
