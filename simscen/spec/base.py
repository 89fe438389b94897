"""The base of everything a user writes in YAML."""

from typing import ClassVar

from pydantic import BaseModel, ConfigDict, model_validator


class Spec(BaseModel):
    """Strict, frozen, finite, and closed: an unknown key is an error."""

    model_config = ConfigDict(
        strict=True,
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        use_attribute_docstrings=True,
        populate_by_name=True,
    )


class Choice(Spec):
    """A mapping with exactly one key out of several, e.g. `spawn: {…}`, plus some modifiers.

    A subclass lists one optional field for each choice. Fields named in `modifiers` may stand beside the choice. An
    editor or a validator can then name the exact mistake, where a tagged union could only say that nothing matched.
    """

    modifiers: ClassVar[frozenset[str]] = frozenset()

    @classmethod
    def choices(cls) -> dict[str, str]:
        """The keys to choose from, as they are written in YAML, and the fields that hold them."""
        return {f.alias or name: name for name, f in cls.model_fields.items() if name not in cls.modifiers}

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
