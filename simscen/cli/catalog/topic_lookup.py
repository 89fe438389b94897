"""Topics of `simscen explain`, their names, and their lookup by the path of a key, such as `goals.pose`."""

from collections.abc import Iterator, Sequence

from pydantic import BaseModel

from simscen.cli.catalog.code_topics import code_topics
from simscen.cli.catalog.fields import OPTIONAL, Field, fields_of
from simscen.cli.catalog.json_schema import MODELS
from simscen.cli.catalog.metric_topics import metric_topics
from simscen.cli.catalog.signal_topics import signal_topics
from simscen.cli.catalog.topics import Topic, topics
from simscen.loading.codes import CODES
from simscen.loading.schema.lookup import models_at
from simscen.spec.choice import Choice


def all_topics() -> list[Topic]:
    """Return all topics in the order of the overview. Problem codes, such as SC012, are no topics."""
    return [*topics(with_plugins=True), *signal_topics(), *metric_topics(with_plugins=True), *code_topics()]


def known_names(keys: bool = False) -> list[str]:
    """Return the names of all topics and problem codes; if `keys` is true, the paths of all keys instead."""
    found = all_topics()
    if keys:
        return [f"{topic.name}.{field.key}" for topic in found for field in topic.fields]
    return [*dict.fromkeys(topic.name for topic in found), *CODES]


def key_topics(path: str, known: Sequence[Topic]) -> list[Topic]:
    """Return a topic for each key with a path such as `goals.pose` or `stack.localizer.alpha1`.

    A path starts at one of the topics `known`, or at the top of a file. If `path` is a single key, it is searched in
    all topics.
    """
    parts = path.split(".")
    if len(parts) == 1:
        found = [
            _key_topic(f"{topic.name}.{path}", field, ())
            for topic in known
            for field in topic.fields
            if field.key == path
        ]
    else:
        found = [topic for model, keys in _path_starts(parts, known) for topic in _keys_below(model, keys, path)]
        name, _, key = path.rpartition(".")
        rows = [row for topic in known if topic.name == name for row in topic.rows if row.key == key]
        found += [_key_topic(path, row, ()) for row in rows]
    return list({(topic.name, topic.text): topic for topic in found}.values())


def _path_starts(parts: list[str], known: Sequence[Topic]) -> Iterator[tuple[type[BaseModel], list[str]]]:
    """Yield each model at which a path can start, and the remaining keys of the path."""
    for length in (1, 2):
        prefix, keys = ".".join(parts[:length]), parts[length:]
        for topic in known:
            if keys and topic.model is not None and prefix in (topic.name, f"{topic.group}.{topic.name}"):
                yield topic.model, keys
    for model in MODELS.values():
        yield model, parts


def _keys_below(model: type[BaseModel], keys: list[str], path: str) -> Iterator[Topic]:
    """Yield a topic for the value at the nested `keys` of a model. A topic for a mapping lists its keys."""
    *parents, key = keys
    for parent in models_at(model, _with_indices(model, parents)):
        for field in fields_of(parent):
            if field.key == key:
                children = models_at(parent, _with_indices(parent, [key]))
                rows = fields_of(children[0]) if len(children) == 1 and not issubclass(children[0], Choice) else []
                yield _key_topic(path, field, tuple(rows))


def _with_indices(model: type[BaseModel], keys: list[str]) -> list[str | int]:
    """Return the keys as a path in a file, with the index 0 after each key whose value is a list."""
    path: list[str | int] = []
    for key in keys:
        path.append(key)
        if not models_at(model, path) or models_at(model, [*path, 0]) != models_at(model, path):
            path.append(0)
    return path


def _key_topic(path: str, field: Field, rows: tuple[Field, ...]) -> Topic:
    default = (
        "required" if not field.default else "optional" if field.default == OPTIONAL else f"default {field.default}"
    )
    text = f"{field.text}\n\n{field.kind} ({default})" if field.text else f"{field.kind} ({default})"
    return Topic("key", path, None, text, rows=rows)
