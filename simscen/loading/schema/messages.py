"""Messages for validation errors of pydantic, and formatting of values and suggestions in messages."""

import difflib
import re
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from simscen.loading.yaml.syntax_problems import lookalike_hint
from simscen.loading.yaml.tree import MappingNode, Node, ScalarNode, SequenceNode
from simscen.spec.places import ROS_NAMESPACE_PATTERN
from simscen.spec.quantities import exact_text, possible_units

_EXPECTED_TYPES = {
    "model_type": "a mapping",
    "model_attributes_type": "a mapping",
    "dict_type": "a mapping",
    "list_type": "a list",
    "tuple_type": "a list",
    "string_type": "text",
    "int_type": "an integer",
    "int_from_float": "an integer",
    "float_type": "a number",
    "bool_type": "true or false",
}
"""Description of the expected value, by error type of pydantic."""
_BOUNDS = {
    "greater_than": ("greater than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
}
"""(words for a bound, key of the bound in the context of the error), by error type of pydantic."""
MAX_LISTED_CHOICES = 40
"""Maximum number of choices in a message."""
_NUMBER = re.compile(r"[-+]?[0-9]+(\.[0-9]*)?")
_LEADING_ZERO = re.compile(r"[-+]?0[0-9]")
_TEMPLATES = {
    "finite_number": ("SC013", "must be a finite number"),
    "too_short": ("SC017", "expected {min_length} or more values, got {actual_length}"),
    "too_long": ("SC017", "expected no more than {max_length} values"),
    "string_too_short": ("SC017", "must not be empty"),
    "path_name": ("SC017", "a name must not be a path"),
    "string_too_long": ("SC017", "longer than {max_length} characters"),
}
"""(error code, message with placeholders for values from the context of the error), by error type of pydantic."""


class Message(NamedTuple):
    """Error code (SC…), text, and hint of a problem without a position."""

    code: str
    text: str
    hint: str = ""


def describe_node(node: Node) -> str:
    """Return a description of a node for messages, e.g. "the text `abc`"."""
    if isinstance(node, MappingNode):
        return "a mapping"
    if isinstance(node, SequenceNode):
        return "a list"
    value = node.value
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return f"the boolean {str(value).lower()}"
    if isinstance(value, str):
        return f"the text {quoted(value)}"
    return f"the {'integer' if isinstance(value, int) else 'number'} {value}"


def quoted(text: str, max_chars: int = 60) -> str:
    """Return a text of the user for messages: in backquotes, printable, and shortened to `max_chars` characters."""
    printable = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)
    return f"`{printable if len(printable) <= max_chars else printable[: max_chars - 1] + '…'}`"


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return "did you mean …?" if a known word is similar; else ""."""
    lowered = {choice.lower(): choice for choice in reversed(list(known))}
    matches = difflib.get_close_matches(word.lower(), lowered, n=1, cutoff=0.6)
    return f"did you mean `{lowered[matches[0]]}`?" if matches else ""


def suggestion(word: str, known: Iterable[str]) -> str:
    """Return "did you mean …?" if a known word is similar, else "expected one of: …"; "" if no word is known."""
    choices = list(known)
    if similar := did_you_mean(word, choices):
        return similar
    more = len(choices) - MAX_LISTED_CHOICES
    listed = f"{', '.join(choices[:MAX_LISTED_CHOICES])}, and {more} more" if more > 1 else ", ".join(choices)
    return f"expected one of: {listed}" if choices else ""


def translate_error(error_type: str, context: Mapping[str, Any], node: Node, text: str) -> Message:
    """Return the message for an error of pydantic in the value `node`.

    `error_type`, `context`, and `text` are the fields `type`, `ctx`, and `msg` of the error.
    """
    if error_type in _EXPECTED_TYPES:
        text = f"expected {_EXPECTED_TYPES[error_type]}, got {describe_node(node)}"
        return Message("SC011", text, _type_hint(error_type, node))
    if error_type in _BOUNDS:
        words, key = _BOUNDS[error_type]
        known_units = possible_units(str(node.value)) if isinstance(node, ScalarNode) else {}
        bound = exact_text(context[key], known_units or {"": 1.0})
        return Message("SC013", f"must be {words} {bound}, got {short_value(node)}")
    if error_type in _TEMPLATES:
        code, template = _TEMPLATES[error_type]
        return Message(code, template.format_map(context))
    if error_type == "literal_error":
        word = str(node.value) if isinstance(node, ScalarNode) else ""
        choices = str(context["expected"]).replace(" or ", ", ").split(",")  # pydantic writes "'a', 'b' or 'c'"
        known = [choice.strip().strip("'") for choice in choices]
        hint = "remove the quotes" if word in known else suggestion(word, known)  # the text "1" is not the number 1
        return Message("SC014", f"{short_value(node)} is not one of the choices", hint)
    if error_type == "value_error":
        reason = str(context["error"])
        is_empty_choice = reason.startswith("expected one of")
        return Message("SC016", "a key is missing here", reason) if is_empty_choice else Message("SC016", reason)
    if error_type == "plugin":
        return Message("SC019", str(context["problem"]), str(context["hint"]))
    if error_type == "quantity":
        units = f"units: {context['units']}; a number without a unit is in SI units"
        written = str(node.value) if isinstance(node, ScalarNode) else ""
        return Message("SC015", str(context["problem"]), lookalike_hint(written) or _quoted_number_hint(node) or units)
    if "names" in context:
        hint = suggestion(str(context["value"]), str(context["names"]).split(", "))
        return Message("SC014", f"{short_value(node)} is not one of the choices", hint)
    if error_type == "string_pattern_mismatch":
        return _invalid_name_message(node, str(context["pattern"]))
    return Message("SC011", text[:1].lower() + text[1:])


def _type_hint(error_type: str, node: Node) -> str:
    """Return a hint on how to correct a value of the wrong type; "" if unknown."""
    if error_type == "string_type" and isinstance(node, ScalarNode) and node.value is not None:
        return "put it in quotes"
    if not isinstance(node, ScalarNode) or not isinstance(node.value, str):
        return ""
    if error_type in ("int_type", "float_type"):
        return _quoted_number_hint(node)
    if hint := lookalike_hint(node.value):
        return hint
    if error_type == "bool_type" and node.value.lower() in ("true", "false"):
        return "remove the quotes"
    if error_type == "bool_type" and node.value.lower() in ("yes", "no", "on", "off", "y", "n"):
        return f"write {'true' if node.value.lower() in ('yes', 'on', 'y') else 'false'}"
    return ""


def _quoted_number_hint(node: Node) -> str:
    """Return a hint on how to correct a number in quotes or with a leading zero; "" for other values."""
    if not isinstance(node, ScalarNode) or not isinstance(node.value, str) or not _NUMBER.fullmatch(node.value):
        return ""
    return "remove the leading zero" if _LEADING_ZERO.match(node.value) else "remove the quotes"


def short_value(node: Node) -> str:
    """Return a scalar in backquotes, shortened; for other nodes a description such as "a list"."""
    if isinstance(node, ScalarNode) and node.value is not None:
        return quoted(str(node.value).lower() if isinstance(node.value, bool) else str(node.value))
    return describe_node(node)


def _invalid_name_message(node: Node, pattern: str) -> Message:
    value = node.value if isinstance(node, ScalarNode) and isinstance(node.value, str) else ""
    control = next((c for c in value if not c.isprintable()), None)
    if control is not None:
        return Message("SC017", f"control character U+{ord(control):04X} in {quoted(value)}", "remove it")
    hint = "start with a letter or `_`, then use letters, digits, spaces, `_`, `.` and `-`"
    if pattern == ROS_NAMESPACE_PATTERN:
        hint = "it is also a ROS namespace: start with a letter, then use letters, digits, and single `_` between them"
    return Message("SC017", f"{quoted(value)} is not a valid name", hint)
