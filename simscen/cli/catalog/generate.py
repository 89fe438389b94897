"""Generator of schemas and reference pages: `python -m simscen.cli.catalog.generate [--check]`."""

import sys
from pathlib import Path

from simscen.cli.catalog.json_schema import MODELS, as_text, schema_of
from simscen.cli.catalog.language_page import (
    commands_page,
    language_page,
    metrics_reference,
    problems_page,
    signals_reference,
)

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


if __name__ == "__main__":
    main()
