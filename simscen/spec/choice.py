"""One key out of several: those that are shipped, and those that installed packages add.

What packages add is looked for when a file uses a key that is not shipped, or somebody asks for everything.
"""

import contextlib
from functools import cache
from typing import Annotated, Any, ClassVar, get_args

from pydantic import BaseModel, Field, ModelWrapValidatorHandler, ValidationError, model_validator
from pydantic.fields import FieldInfo
from pydantic_core import InitErrorDetails

from simscen.spec.base import Spec
from simscen.spec.lazy_spec import LazySpec


class Choice(Spec):
    """A mapping with exactly one key out of several, e.g. `spawn: {…}`, plus some modifiers.

    A subclass lists one optional field for each choice. Fields named in `modifiers` may stand beside the choice. An
    editor or a validator can then name the exact mistake, where a tagged union could only say that nothing matched.

    Where `group` names one of the registry, installed packages add choices: a mapping with such a key becomes an
    instance of the `widened` class, which has a field for each of them. A file that uses only what is shipped never
    looks for them.
    """

    modifiers: ClassVar[frozenset[str]] = frozenset()
    group: ClassVar[str] = ""
    narrow: ClassVar[type["Choice"] | None] = None
    """Of a widened class: the one that it widens."""

    @classmethod
    def choices(cls) -> dict[str, str]:
        """The keys to choose from, as they are written in YAML, and the fields that hold them."""
        return {f.alias or name: name for name, f in cls.model_fields.items() if name not in cls.modifiers}

    @classmethod
    @cache
    def known_keys(cls) -> frozenset[str]:
        """Every key that may be written there, modifiers included."""
        return frozenset(field.alias or name for name, field in cls.model_fields.items())

    @classmethod
    def addresses(cls) -> dict[str, str]:
        """The keys to choose from and where their specifications are, "module:Class"; not those without one."""
        marks = {key: _address(cls.model_fields[name]) for key, name in cls.choices().items()}
        return {key: address for key, address in marks.items() if address}

    @model_validator(mode="wrap")
    @classmethod
    def _or_installed(cls, value: Any, handler: ModelWrapValidatorHandler["Choice"]) -> "Choice":
        if cls.group and cls.narrow is None and isinstance(value, dict) and not cls.known_keys().issuperset(value):
            wider = with_installed_choices(cls)
            if not wider.known_keys().isdisjoint(value.keys() - cls.known_keys()):
                return wider.model_validate(value, by_alias=True, by_name=False)
        if isinstance(value, dict) and (named := cls._python_names().intersection(value)):
            # Inside of a wrapped model older pydantics forget that names of fields are no keys.
            errors = [InitErrorDetails(type="extra_forbidden", loc=(key,), input=value[key]) for key in sorted(named)]
            raise ValidationError.from_exception_data(cls.__name__, errors)
        return handler(value)

    @classmethod
    @cache
    def _python_names(cls) -> frozenset[str]:
        """Names of fields that are written otherwise, e.g. `for_`."""
        return frozenset(name for name, field in cls.model_fields.items() if field.alias not in (None, name))

    @model_validator(mode="after")
    def _exactly_one(self) -> "Choice":
        given = self._given()
        if not given:
            raise ValueError(f"expected one of: {', '.join(self.choices())}")
        if len(given) > 1:
            raise ValueError(f"only one of {', '.join(given)} may be given here")
        return self

    def _given(self) -> list[str]:
        return [key for key, name in self.choices().items() if getattr(self, name) is not None]

    @property
    def kind(self) -> str:
        """The key that was given."""
        return self._given()[0]

    @property
    def chosen(self) -> BaseModel:
        """The specification under that key."""
        spec = getattr(self, self.choices()[self.kind])
        assert isinstance(spec, BaseModel)
        return spec

    @property
    def added_by(self) -> str:
        """Whose it is, as a message ends: " (criterion `dwell` of yardwork 1.2)"; "" where simscen ships it."""
        if self.narrow is None:
            return ""
        from simscen.spec.registry import find

        found = find(self.group, self.kind)
        return f" ({self.group} `{self.kind}` of {found.origin})" if found is not None and not found.shipped else ""

    def __reduce_ex__(self, protocol: Any) -> Any:
        if self.narrow is None:
            return super().__reduce_ex__(protocol)
        return blank, (self.narrow,), self.__getstate__()


@cache
def with_installed_choices(choice: type[Choice]) -> type[Choice]:
    """The choice with a field for each name that installed packages add to its group; itself where there is none."""
    from pydantic import create_model

    from simscen.spec.extensible_union import PluginSpec
    from simscen.spec.registry import installed

    if choice.narrow is not None or not choice.group:
        return choice
    fields: dict[str, Any] = {
        f"plugin_{entry.name}": (
            Annotated[BaseModel | None, PluginSpec(*entry.value.partition(":")[::2], entry)],
            Field(default=None, alias=entry.name),
        )
        for entry in installed(choice.group)
        if entry.name not in choice.known_keys()
    }
    if not fields:
        return choice
    wider = create_model(
        choice.__name__, __base__=choice, __module__=choice.__module__, __doc__=choice.__doc__, **fields
    )
    wider.narrow = choice
    return wider


def installed_choices(choice: type[Choice]) -> dict[str, type[BaseModel]]:
    """The specifications that installed packages add to a choice, by key, without those that cannot be used."""
    from simscen.spec.registry import BrokenPlugin, installed

    found = {}
    for entry in installed(choice.group) if choice.group else ():
        if entry.name not in choice.known_keys():
            with contextlib.suppress(BrokenPlugin):
                found[entry.name] = entry.load()
    return found


def blank(narrow: type[Choice]) -> Choice:
    """What a widened choice is unpickled into: its class is made anew by each process."""
    wider = with_installed_choices(narrow)
    return wider.__new__(wider)


def _address(field: FieldInfo) -> str:
    """Where the specification under a key is; "" where there is none: a list, or the choice itself."""
    mark = next((mark for mark in field.metadata if isinstance(mark, LazySpec)), None)
    if mark is not None:
        return f"{mark.module}:{mark.name}"
    kinds = [kind for kind in get_args(field.annotation) if isinstance(kind, type) and issubclass(kind, Spec)]
    kinds = [kind for kind in kinds if not issubclass(kind, Choice)]
    return f"{kinds[0].__module__}:{kinds[0].__name__}" if kinds else ""
