"""Generator of schemas and reference pages: `python -m simscen.cli.catalog.generate [--check]`."""

import sys
from itertools import groupby
from pathlib import Path

from simscen.cli.catalog.commands_page import commands_of, exits, section
from simscen.cli.catalog.json_schema import MODELS, as_text, schema_of
from simscen.cli.catalog.reference_topics import metrics_page, signals_page
from simscen.cli.catalog.topics import OPTIONAL, Field, Topic, added_topics, topics
from simscen.cli.main import COMMANDS
from simscen.criteria.plugin_metric import AnyMeasure
from simscen.loading.codes import CODES
from simscen.spec.quantities import UNITS

ROOT = Path(__file__).resolve().parents[3]


def generated() -> dict[str, str]:
    """Path in the repository → content."""
    schemas = {f"simscen/data/schemas/{name}.schema.json": as_text(schema_of(name)) for name in MODELS}
    return {
        **schemas,
        "docs/reference/language.md": language_page(),
        "docs/reference/problems.md": problems_page(),
        "docs/reference/commands.md": commands_page(),
        "docs/reference/metrics.md": metrics_reference(),
        "docs/reference/signals.md": signals_reference(),
    }


def outdated(root: Path = ROOT) -> list[str]:
    """The generated files that are not what the code says."""
    return [name for name, text in generated().items() if not (root / name).is_file() or _read(root / name) != text]


def main() -> None:
    """Write the files, or with --check exit with 1 if any is out of date."""
    if "--check" in sys.argv[1:]:
        if stale := outdated():
            sys.exit(f"out of date: {', '.join(stale)}; run `make docs`")
        return
    for name, text in generated().items():
        (ROOT / name).parent.mkdir(parents=True, exist_ok=True)
        (ROOT / name).write_text(text, encoding="utf-8")
        print(name)


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8")


# MERGED: The reference of the language as a page, made from the docstrings that `simscen explain` shows.
_MADE = "<!-- Made by `make docs` from the docstrings in simscen/. Do not edit. -->\n"
_GROUPS = {
    "trigger": ("Triggers", "What stands under `when`: exactly one of these, with modifiers beside it."),
    "action": ("Actions", "What stands under `do`: one of these, or a list of them in order."),
    "fault": ("Faults", "Entries of `faults`: exactly one of these, with `sensor` and modifiers beside it."),
    "criterion": ("Criteria", "Entries of `pass`: exactly one of these, with modifiers beside it."),
    "scenario": ("Scenario files", "`*.scenario.yaml`. `extends: FILE` takes what is not given from another file."),
    "stack": ("The stack", "Under `stack`; every key may be left out."),
    "stack file": (
        "Stacks from outside",
        "`*.stack.yaml`, given as `--stack NAME=FILE`; and the user's own configuration, which says what the names of "
        "external stacks run.",
    ),
    "localizer": ("Localizers", "Under `stack.localizer`, chosen by `type`, by default `amcl`."),
    "controller": ("Controllers", "Under `stack.controller`, told apart by `type`."),
    "behavior": (
        "Recovery behaviors",
        "Entries of `stack.recovery.behaviors`: a name, or a mapping with that name as its `type`; a parameter that is "
        "left out is the one of `stack.recovery`.",
    ),
    "world": ("World files", "`*.world.yaml`, or inline under `world`."),
    "robot": ("Robot files", "`*.robot.yaml`."),
    "drive": ("Drives", "Under `drive` of a robot, told apart by `type`."),
    "metric": ("Metrics", "Entries of `metrics`, besides what [every run reports](metrics.md)."),
    "sensor": ("Sensors", "Under `sensors` of a robot: a name of your choice, and exactly one of these."),
}
_HEADINGS = ("What is measured:", "When it fails:", "Why this:", "Source:")


def language_page(installed: bool = False) -> str:
    """docs/reference/language.md; with what `installed` packages add, if asked."""
    parts = [f"{_MADE}# The language\n", _units()]
    for group, members in groupby(_topics(installed), key=lambda topic: topic.group):
        title, text = _GROUPS[group]
        parts += [f"## {title}\n\n{text}\n", *(_section(topic) for topic in members)]
    return "\n".join(parts)


def _topics(installed: bool) -> list[Topic]:
    return [*topics(installed), *added_topics(AnyMeasure, installed)]


def problems_page() -> str:
    """docs/reference/problems.md."""
    rows = "\n".join(f"| {code} | {text} |" for code, text in CODES.items())
    intro = "# Codes of problems\n\n`simscen explain CODE` tells the same."
    return f"{_MADE}{intro}\n\n| code | meaning |\n|---|---|\n{rows}\n"


def commands_page() -> str:
    """docs/reference/commands.md."""
    rows = "\n".join(f"| `simscen {name}` | {text} |" for name, text in COMMANDS.items())
    intro = "# Commands\n\n`simscen COMMAND --help` tells the same."
    sections = [section(words, function) for name in COMMANDS for words, function in commands_of(name)]
    table = f"| command | what it does |\n|---|---|\n{rows}\n"
    return "\n".join([f"{_MADE}{intro}\n\n{table}", *sections, exits()])


def metrics_reference() -> str:
    """docs/reference/metrics.md."""
    return _MADE + metrics_page()


def signals_reference() -> str:
    """docs/reference/signals.md."""
    return _MADE + signals_page()


def _units() -> str:
    rows = "\n".join(f"| {name} | {', '.join(f'`{unit}`' for unit in units)} |" for name, units in UNITS.items())
    return (
        "## Quantities\n\nA bare number is SI (the first unit; a ratio is a plain number, 1 = 100 %). A text carries a "
        f"unit: `90 deg`, `30 cm`, `0.5 m/s`.\n\n| quantity | units |\n|---|---|\n{rows}\n"
    )


def _section(topic: Topic) -> str:
    parts = [f"### `{topic.name}`\n", *([f"Added by {topic.origin}.\n"] if topic.origin else []), _text(topic.text)]
    if topic.value:
        parts.append(f"\nValue: {topic.value}.")
    if topic.example:
        parts.append(f"\n```yaml\n{topic.example}\n```")
    if topic.fields:
        head = "\n| key | value | default | meaning |\n|---|---|---|---|"
        parts.append("\n".join([head, *(_row(field) for field in topic.fields)]))
    return "\n".join(parts) + "\n"


def _text(text: str) -> str:
    """A docstring as Markdown; its headings become a list."""
    lines: list[str] = []
    for line in text.splitlines():
        heading = next((h for h in _HEADINGS if line.startswith(h)), None)
        lines.append(f"- **{heading}**{line[len(heading) :]}" if heading else line.replace("    ", "  ", 1))
    return "\n".join(lines)


def _row(field: Field) -> str:
    default = (
        "**required**" if not field.default else field.default if field.default == OPTIONAL else f"`{field.default}`"
    )
    cells = (f"`{field.key}`", field.kind, default, " ".join(field.text.split()))
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


if __name__ == "__main__":
    main()
