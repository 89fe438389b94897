"""Generator of the JSON Schemas and of the pages in docs/reference, from models, commands, and their docstrings.

Usage: `python -m simscen.cli.catalog.generate [--check]`.
"""

import sys
from pathlib import Path

from simscen.cli.catalog.commands_page import commands_page
from simscen.cli.catalog.json_schema import MODELS, as_text, schema_of
from simscen.cli.catalog.language_page import GENERATED_NOTE, language_page
from simscen.cli.catalog.metric_topics import metrics_page
from simscen.cli.catalog.signal_topics import signals_page
from simscen.loading.codes import CODES

ROOT = Path(__file__).resolve().parents[3]
"""Folder of the repository."""
_PROBLEMS_INTRO = """\
Find the meaning of a code here, such as SC012 in `aisle.scenario.yaml:8:5: error[SC012] unknown key`.
`simscen explain SC012` prints the same in a terminal. [`simscen validate`](../guides/validate.md) checks files without
running anything."""
_PROBLEM_GROUPS = {
    "SC001": "Files and YAML",
    "SC010": "Keys and values",
    "SC020": "Paths and referenced files",
    "SC030": "Names, times, and robots",
    "SC050": "Entries without effect",
    "SC060": "Stacks",
    "SC301": "Positions and routes",
    "SC310": "Worlds and maps",
    "SC340": "Nav2 parameter files",
    "SC400": "Robots",
    "SC800": "Logs and output folders",
}
"""Headings of docs/reference/problems.md, by the first code below each."""


def generated_files() -> dict[str, str]:
    """Return the texts of all generated files by path in the repository."""
    return {
        **{f"simscen/data/schemas/{name}.schema.json": as_text(schema_of(name)) for name in MODELS},
        "docs/reference/language.md": language_page(),
        "docs/reference/problems.md": GENERATED_NOTE + _problems_page(),
        "docs/reference/commands.md": GENERATED_NOTE + commands_page(),
        "docs/reference/metrics.md": GENERATED_NOTE + metrics_page(),
        "docs/reference/signals.md": GENERATED_NOTE + signals_page(),
    }


def outdated_files(root: Path = ROOT) -> list[str]:
    """Return the paths in the repository of the generated files that are missing or out of date."""
    return [
        name
        for name, text in generated_files().items()
        if not (root / name).is_file() or (root / name).read_text(encoding="utf-8") != text
    ]


def main() -> None:
    """Write the generated files. With --check, exit with 1 if one of them is out of date."""
    if "--check" in sys.argv[1:]:
        if stale := outdated_files():
            sys.exit(f"out of date: {', '.join(stale)}; run `make docs`")
        return
    for name, text in generated_files().items():
        (ROOT / name).parent.mkdir(parents=True, exist_ok=True)
        (ROOT / name).write_text(text, encoding="utf-8")
        print(name)


def _problems_page() -> str:
    parts = ["# Problem codes\n", _PROBLEMS_INTRO]
    for code, text in CODES.items():
        if code in _PROBLEM_GROUPS:
            parts += [f"\n## {_PROBLEM_GROUPS[code]}\n", "| code | meaning |", "|---|---|"]
        parts.append(f"| {code} | {text} |")
    return "\n".join(parts) + "\n"


if __name__ == "__main__":
    main()
