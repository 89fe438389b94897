"""Characters that look like those of YAML and are none: they come with text that was copied from a page or a chat."""

_SPACE = "a plain space"
ODD = {
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
"""Character → what it is called, and what is meant."""


def odd_character(text: str) -> int | None:
    """Where the first of them is in a text; None for none."""
    return next((index for index, character in enumerate(text) if character in ODD), None)


def described(character: str) -> str:
    """What it is: "no-break space (U+00A0)"."""
    return f"{ODD[character][0]} (U+{ord(character):04X})"


def mended(text: str) -> str:
    """What to write instead of the first one of a text; "" where there is none."""
    index = odd_character(text)
    if index is None:
        return ""
    article = "an" if ODD[text[index]][0][0] in "aeiou" else "a"
    return f"there is {article} {described(text[index])} in it: write {ODD[text[index]][1]}"
