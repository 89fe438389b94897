"""Forms for editing the values of a file, made from the JSON Schema of this kind of file.

`keys` are the path to a value in the file: keys of mappings and indices of lists. A field is an input of a form for one
value.
"""

import math
import re
from typing import Any

from simscen.editor.value_schemas import Schema, child_schema, resolve_schema, schema_at, schema_of_kind, value_at
from simscen.loading.yaml.source_nodes import SourceNode, parse_source, source_at
from simscen.loading.yaml.tree import Key

MAX_DEPTH = 4
"""Maximum number of levels of nested fields in a form."""
MAX_ITEMS = 12
"""Maximum number of items of a list with fields. A longer list has no fields."""
MAX_TEXT_FIELD_CHARACTERS = 60
"""Maximum length of a string in a single-line field."""
FIRST_VALUE_OF_KEY = {
    "name": "new",
    "description": "description",
    "keyframes": [[0, 0, 0, 0]],
    "through": [[0, 0]],
    "points": [[0, 0], [1, 0]],
}
"""Initial values of new keys, by key. These values have priority over the schema."""

Keys = tuple[Key, ...]
_EXAMPLE_OF_QUANTITY = re.compile(r"\s*\((?:[a-z ]+), e\.g\. ([^)]*)\)$")


def form_data(kind: str, text: str, data: Any, keys: Keys) -> dict[str, Any]:
    """Return the form of the value at `keys` as JSON data: help, fields, and the keys that can be added.

    `data` is the content of the `text`, including content that the text inherits from other files. The form of the
    complete file (`keys` are empty) has no nested fields.
    """
    root = schema_of_kind(kind)
    schema = schema_at(root, keys, data)
    value = value_at(data, keys)
    form = _Form(root, text, parse_source(text), 1 if not keys else MAX_DEPTH)
    return form.field(keys, schema, value, required=True, depth=0)


class _Form:
    """Makes the fields of a form with at most `max_depth` levels. `source` is the syntax tree of the text."""

    def __init__(self, root: Schema, text: str, source: SourceNode | None, max_depth: int) -> None:
        self._root, self._text, self._source, self._max_depth = root, text, source, max_depth

    def field(self, keys: Keys, schema: Schema, value: Any, required: bool, depth: int) -> dict[str, Any]:
        """Return the field of the value at `keys`, including nested fields. `depth` is 0 for the top-level field."""
        help_, example = _help_and_example(schema)
        node = None if self._source is None or not keys else source_at(self._source, keys)
        base = {
            "key": str(keys[-1]) if keys else "",
            "keys": list(keys),
            "help": help_,
            "example": example,
            "required": required,
            "written": node is not None or not keys,
        }
        if isinstance(value, dict):
            return {**base, "type": "group", **self._group(keys, schema, value, depth)}
        if isinstance(value, list):
            return {**base, "type": "list", **self._list(keys, schema, value, depth)}
        return {**base, **self._scalar(schema, value, node)}

    def _group(self, keys: Keys, schema: Schema, value: dict[str, Any], depth: int) -> dict[str, Any]:
        """Return the part of a field that describes a mapping: nested fields, and keys that can be added."""
        required_keys = set(schema.get("required", []))
        shown_keys = [] if depth >= self._max_depth else list(value)
        if depth == 0 and not keys:
            shown_keys = [key for key in value if not isinstance(value[key], dict | list)]
        fields = []
        for key in shown_keys:
            child = resolve_schema(self._root, child_schema(schema, key), value[key])
            fields.append(self.field((*keys, key), child, value[key], key in required_keys, depth + 1))
        return {"fields": fields, "addable": self._addable(keys, schema, value)}

    def _addable(self, keys: Keys, schema: Schema, value: dict[str, Any]) -> list[dict[str, Any]]:
        """Return the keys that can be added to a mapping, with their help and initial value."""
        # Keys that exclude each other, such as kinds of triggers, are alternatives with one required key.
        alternatives = [each.get("required", []) for each in schema.get("oneOf", []) if isinstance(each, dict)]
        choices = [required[0] for required in alternatives if len(required) == 1]
        has_choice = any(choice in value for choice in choices)
        addable = []
        for key, key_schema in schema.get("properties", {}).items():
            if key in value or key.endswith("+") or (key in choices and has_choice):
                continue
            child = resolve_schema(self._root, key_schema, None)
            initial = _first_value(self._root, child, key)
            if initial is None or (not keys and isinstance(initial, dict | list)):
                continue
            addable.append({"key": key, "help": _help_and_example(child)[0], "value": initial})
        return addable

    def _list(self, keys: Keys, schema: Schema, value: list[Any], depth: int) -> dict[str, Any]:
        """Return the part of a field that describes a list: a nested field for each item."""
        if len(value) > MAX_ITEMS or depth >= self._max_depth:
            return {"fields": [], "addable": [], "omitted": len(value)}
        fields = []
        for index, item in enumerate(value):
            child = resolve_schema(self._root, child_schema(schema, index), item)
            fields.append(self.field((*keys, index), child, item, required=False, depth=depth + 1))
        return {"fields": fields, "addable": []}

    def _scalar(self, schema: Schema, value: Any, node: SourceNode | None) -> dict[str, Any]:
        """Return the part of a field that describes a scalar.

        `node` is the syntax node of the scalar; None if the file inherits the scalar.
        """
        if isinstance(value, float) and not math.isfinite(value):
            value = str(value)  # JSON has no such numbers
        if "enum" in schema:
            return {"type": "choice", "choices": schema["enum"], "value": value}
        if isinstance(value, bool) or schema.get("type") == "boolean":
            return {"type": "choice", "choices": [True, False], "value": value}
        if schema.get("type") == "string" or (isinstance(value, str) and "type" not in schema):
            text = "" if value is None else str(value)
            is_long = "\n" in text.strip() or len(text) > MAX_TEXT_FIELD_CHARACTERS
            return {"type": "long text" if is_long else "text", "value": text}
        raw = "" if value is None else str(value)
        if node is not None and node.kind == "scalar" and not node.style:
            raw = self._text[node.start : node.end]
        return {"type": "number", "value": raw}


def _first_value(root: Schema, schema: Schema, key: str = "", depth: int = 0) -> Any:
    """Return a valid initial value for a new key or item; None if no simple value is valid.

    `depth` is the number of mappings and lists around the value, at most MAX_DEPTH.
    """
    if key in FIRST_VALUE_OF_KEY:
        return FIRST_VALUE_OF_KEY[key]
    if "default" in schema and schema["default"] not in (None, "", [], {}):
        return schema["default"]
    if "const" in schema:
        return schema["const"]
    if "enum" in schema:
        return schema["enum"][0]
    kinds = schema.get("type", "")
    match kinds[0] if isinstance(kinds, list) and kinds else kinds:
        case "boolean":
            return True
        case "number" | "integer":
            return _first_number(schema)
        case "string":
            return "new"
        case "array":
            item = resolve_schema(root, child_schema(schema, 0), None)
            first = _first_value(root, item, "", depth + 1) if depth < MAX_DEPTH else None
            return None if first is None else [first] * max(1, schema.get("minItems", 1))
        case "object":
            return _first_mapping(root, schema, depth)
    return None


def _first_mapping(root: Schema, schema: Schema, depth: int) -> dict[str, Any] | None:
    """Return a mapping with the required keys; None if a required key has no simple value."""
    if depth >= MAX_DEPTH:
        return None
    properties, mapping = schema.get("properties", {}), dict[str, Any]()
    for key in schema.get("required", []):
        mapping[key] = _first_value(root, resolve_schema(root, properties.get(key, {}), {}), key, depth + 1)
        if mapping[key] is None:
            return None
    return mapping


def _first_number(schema: Schema) -> float:
    """Return 0, 1, or another number within the limits of the schema."""
    above, below = schema.get("exclusiveMinimum", -math.inf), schema.get("exclusiveMaximum", math.inf)
    low, high = max(schema.get("minimum", -math.inf), above), min(schema.get("maximum", math.inf), below)
    numbers: tuple[float, ...] = (0, 1.0, low, low + 1.0, (low + high) / 2, high, high - 1.0)
    return next(n for n in numbers if math.isfinite(n) and low <= n <= high and above < n < below)


def _help_and_example(schema: Schema) -> tuple[str, str]:
    """Return (description of a value without the example, example such as "0.5 m"), each "" if missing."""
    paragraphs = str(schema.get("description", "")).split("\n\n")
    text = "\n\n".join(" ".join(part.split()) for part in paragraphs).strip()
    match = _EXAMPLE_OF_QUANTITY.search(text)
    if match is None:
        plain = re.fullmatch(r"[a-z ]+, e\.g\. (.*)", text)
        return ("", plain[1]) if plain else (text, "")
    return text[: match.start()].strip(), match[1]
