"""Messages about errors in the syntax of YAML, instead of those of libyaml."""

import yaml

MISSING_COLON = "could not find expected ':'"
"""Message of libyaml for a line that must be a key but has no colon. Its context is the key."""
_UNCLOSED = {
    "while parsing a flow sequence": "flow sequence",
    "while parsing a flow mapping": "flow mapping",
    "while scanning a quoted scalar": "quoted scalar",
}
"""Contexts of libyaml that need a closing bracket or quote."""
_CONTAINERS = {
    "while parsing a block mapping": "mapping",
    "while parsing a flow mapping": "mapping",
    "while parsing a block collection": "list",
    "while parsing a flow sequence": "list",
}
_ALIGN_KEYS = "indent all keys of a mapping alike"
_MESSAGES = {
    MISSING_COLON: ("`:` is missing after this key", "write `key: value`, or `- value` for an item of a list"),
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


def syntax_message(error: yaml.MarkedYAMLError) -> tuple[str, str]:
    """Return the message and the hint for a syntax error. The message names the list or mapping that contains it."""
    problem = error.problem or "cannot be read as YAML"
    message, hint = _MESSAGES.get(problem, (problem, ""))
    start, mark = error.context_mark, error.problem_mark
    if start is None or not error.context or problem == MISSING_COLON or (mark and start.index == mark.index):
        return message, hint
    place = f"starts at {start.line + 1}:{start.column + 1}"
    container = _CONTAINERS.get(error.context)
    return (
        f"{message} in the {container} that {place}" if container else f"{message} ({error.context} that {place})",
        hint,
    )


def unclosed_part(error: yaml.MarkedYAMLError) -> str:
    """Return what needs a closing bracket or quote at an error at the end of a file; "" if it is something else."""
    return _UNCLOSED.get(error.context or "", "")
