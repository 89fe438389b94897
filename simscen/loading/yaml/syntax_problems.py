"""Problems of texts that are not YAML, with clearer messages than libyaml, and hints for lookalike characters."""

from typing import NamedTuple

import yaml

from simscen.core.errors import Problem
from simscen.spec.quantities import with_article

_MISSING_COLON = "could not find expected ':'"
"""Message of libyaml for a line that must be a key but has no colon. The context of the error is the key."""
_UNCLOSED = {
    "while parsing a flow sequence": "list in brackets",
    "while parsing a flow mapping": "mapping in braces",
    "while scanning a quoted scalar": "text in quotes",
}
"""Words for a list, mapping, or text that must be closed, by context of the error in libyaml."""
_CONTAINERS = {
    "while parsing a block mapping": "mapping",
    "while parsing a flow mapping": "mapping",
    "while parsing a block collection": "list",
    "while parsing a flow sequence": "list",
}
"""Words for a list or mapping, by context of the error in libyaml."""
_ALIGN_KEYS = "indent all keys of a mapping alike"
_MESSAGES = {
    _MISSING_COLON: ("`:` is missing after this key", "write `key: value`, or `- value` for an item of a list"),
    "mapping values are not allowed in this context": (
        "unexpected `:`",
        f"{_ALIGN_KEYS}, write a space after each `:`, and quote texts that contain `: `",
    ),
    "did not find expected key": (
        "expected a key",
        f"{_ALIGN_KEYS}, and write nothing after a closing quote or bracket",
    ),
    "did not find expected '-' indicator": (
        "expected an item that begins with `- `",
        "indent all items of a list alike",
    ),
    "block sequence entries are not allowed in this context": (
        "unexpected `- `",
        "begin each item of a list on a line of its own",
    ),
    "did not find expected node content": ("expected a value", ""),
    "did not find expected ',' or '}'": ("expected `,` or `}`", ""),
    "did not find expected ',' or ']'": ("expected `,` or `]`", ""),
    "found character that cannot start any token": (
        "a value cannot begin with this character",
        "put the value in quotes",
    ),
}
"""Message and hint for each frequent message of libyaml."""
_SPACE = "a plain space"
_LOOKALIKES = {
    "\u00a0": ("no-break space", _SPACE),
    "\u2007": ("figure space", _SPACE),
    "\u202f": ("narrow no-break space", _SPACE),
    "\u3000": ("ideographic space", _SPACE),
    "\u201c": ("typographic quote", '`"`'),
    "\u201d": ("typographic quote", '`"`'),
    "\u201e": ("typographic quote", '`"`'),
    "\u2018": ("typographic quote", "`'`"),
    "\u2019": ("typographic quote", "`'`"),
    "\uff1a": ("full-width colon", "`:`"),
    "\uff0c": ("full-width comma", "`,`"),
    "\u2013": ("dash", "`-`"),
    "\u2014": ("dash", "`-`"),
    "\u2212": ("minus sign", "`-`"),
}
"""(name, replacement) by character that looks like an ASCII character of YAML."""


def syntax_problem(error: yaml.MarkedYAMLError, text: str, path: str) -> Problem:
    """Return the problem for an error of libyaml in a text. `path` is its path in messages."""
    mark, start = error.problem_mark or error.context_mark, error.context_mark
    if mark is None:
        return Problem(path, 0, 0, "SC003", error.problem or "cannot be read as YAML")
    lines = text.split("\n")
    line = lines[mark.line] if mark.line < len(lines) else ""
    if line[mark.column : mark.column + 1] == "\t" or "\t" in line[: len(line) - len(line.lstrip())]:
        return Problem(path, mark.line + 1, line.find("\t") + 1, "SC003", "tab character", "indent with spaces")
    for number in range(start.line if start else mark.line, min(mark.line + 1, len(lines))):
        if (found := _first_lookalike(lines[number].partition(" #")[0])) is not None:
            return Problem(path, number + 1, found.column + 1, "SC003", found.name, f"write {found.replacement}")
    is_at_end = mark.index >= len(text.rstrip())
    unclosed = _UNCLOSED.get(error.context or "", "")
    if start is not None and is_at_end and start.index < mark.index and unclosed:
        return Problem(path, start.line + 1, start.column + 1, "SC003", f"this {unclosed} is not closed")
    message, hint = _message(error)
    if start is not None and error.problem == _MISSING_COLON:
        mark = start
    if mark.line < len(lines):
        return Problem(path, mark.line + 1, mark.column + 1, "SC003", message, hint)
    return Problem(path, len(lines), len(lines[-1]) + 1, "SC003", message, hint)


def _message(error: yaml.MarkedYAMLError) -> tuple[str, str]:
    """Return the message and the hint for a syntax error. The message names the list or mapping with the error."""
    problem = error.problem or "cannot be read as YAML"
    message, hint = _MESSAGES.get(problem, (problem, ""))
    start, mark = error.context_mark, error.problem_mark
    if start is None or not error.context or problem == _MISSING_COLON or (mark and start.index == mark.index):
        return message, hint
    place = f"starts at {start.line + 1}:{start.column + 1}"
    container = _CONTAINERS.get(error.context)
    return (
        f"{message} in the {container} that {place}" if container else f"{message} ({error.context} that {place})",
        hint,
    )


class _Lookalike(NamedTuple):
    """Lookalike character at a column (from 0), with a name such as "no-break space (U+00A0)", and a replacement."""

    column: int
    name: str
    replacement: str


def _first_lookalike(text: str) -> _Lookalike | None:
    """Return the first lookalike character in a text; None if there is none."""
    for index, character in enumerate(text):
        if character in _LOOKALIKES:
            name, replacement = _LOOKALIKES[character]
            return _Lookalike(index, f"{name} (U+{ord(character):04X})", replacement)
    return None


def lookalike_hint(text: str) -> str:
    """Return a hint on how to replace the first lookalike character in a text; "" if there is none."""
    found = _first_lookalike(text)
    return "" if found is None else f"it contains {with_article(found.name)}; write {found.replacement} instead"
