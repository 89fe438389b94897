"""Characters that look like ASCII characters of YAML, and messages about them."""

from simscen.spec.quantities import with_article

_SPACE = "a plain space"
LOOKALIKES = {
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
"""Names and replacements of lookalike characters."""


def find_lookalike(text: str) -> int | None:
    """Return the index of the first lookalike character in a text; None if there is none."""
    return next((index for index, character in enumerate(text) if character in LOOKALIKES), None)


def describe_lookalike(character: str) -> str:
    """Return the name of a lookalike character, e.g. "no-break space (U+00A0)"."""
    return f"{LOOKALIKES[character][0]} (U+{ord(character):04X})"


def lookalike_hint(text: str) -> str:
    """Return a hint on how to replace the first lookalike character in a text; "" if there is none."""
    index = find_lookalike(text)
    if index is None:
        return ""
    character = text[index]
    return f"it contains {with_article(describe_lookalike(character))}; write {LOOKALIKES[character][1]} instead"
