"""Write long texts as YAML block scalars (`>` and `|`), in the style of the one that they replace."""

import textwrap

from simscen.loading.yaml.parser import parse_yaml

WIDTH = 120
"""Longest line of a folded text."""


def block_text(value: str, old: str, indent: int) -> str | None:
    """Return a text in the style of the block scalar `old`, or None if that style cannot hold it.

    `indent` is the number of spaces before its lines in the file.
    """
    header = old.split("\n", 1)[0].split("#", maxsplit=1)[0].strip()
    body = value.removesuffix("\n")
    if not body.strip() or header[1:] not in ("", "-"):
        return None
    header = header[0] if value.endswith("\n") else f"{header[0]}-"
    lines = body.split("\n") if header[0] == "|" else _folded_lines(body, WIDTH - indent)
    text = "\n".join([header, *(" " * indent + line if line else "" for line in lines)])
    tree, problems = parse_yaml(f"{' ' * (indent - 1)}? key\n{' ' * (indent - 1)}: {text}\n", "")
    is_same = not problems and tree is not None and tree.plain == {"key": value}
    return text if is_same else None


def _folded_lines(text: str, width: int) -> list[str]:
    """Return the lines of a folded text: an empty line stands for a line break."""
    lines: list[str] = []
    for number, paragraph in enumerate(text.split("\n")):
        lines += [""] if number else []
        lines += textwrap.wrap(paragraph, width, break_long_words=False, break_on_hyphens=False)
    return lines
