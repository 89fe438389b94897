"""Selection of scenarios by tag, and by keyword expression as with pytest's -k."""

import re
from collections.abc import Callable, Iterable, Sequence

from simscen.core.errors import NothingSelected, UsageError
from simscen.loading.loaded import LoadedScenario
from simscen.loading.schema.messages import quoted, suggestion

_TOKEN_PATTERN = re.compile(r"[()]|[^\s()]+")
MAX_DEPTH = 50
"""Maximum nesting depth of `not` and parentheses."""

Matcher = Callable[[str], bool]
"""Function that returns whether the title of a scenario matches an expression."""


def select(scenarios: Iterable[LoadedScenario], keyword: str, tags: Sequence[str]) -> list[LoadedScenario]:
    """Return the scenarios whose title matches `keyword`, and that have one of `tags` unless `tags` is empty.

    `keyword` is an expression of parts of titles, `and`, `or`, `not`, and parentheses; "" matches all titles.
    Raises UsageError for an invalid expression, and NothingSelected if nothing matches.
    """
    candidates = list(scenarios)
    matches = keyword_matcher(keyword) if keyword.strip() else lambda _: True
    chosen = [s for s in candidates if matches(s.title) and (not tags or not set(tags).isdisjoint(s.spec.tags))]
    if not chosen:
        raise NothingSelected(_no_match_message(candidates, keyword, tags))
    return chosen


def keyword_matcher(expression: str) -> Matcher:
    """Return the matcher for an expression such as `aisle and not slow`. Raises UsageError if it is invalid."""
    parser = _Parser(_TOKEN_PATTERN.findall(expression), expression)
    matcher = parser.parse_or(0)
    if parser.tokens:
        raise parser.error(f"unexpected {quoted(parser.tokens[0])}")
    return matcher


class _Parser:
    """Recursive descent parser of keyword expressions. `tokens` are the tokens that are not parsed yet."""

    def __init__(self, tokens: list[str], expression: str) -> None:
        self.tokens, self._expression = tokens, expression

    def parse_or(self, depth: int) -> Matcher:
        """Parse parts joined by `or`, inside `depth` levels of nesting."""
        options = [self._parse_and(depth)]
        while self._take("or"):
            options.append(self._parse_and(depth))
        return lambda text: any(option(text) for option in options)

    def _parse_and(self, depth: int) -> Matcher:
        parts = [self._parse_term(depth)]
        while self._take("and"):
            parts.append(self._parse_term(depth))
        return lambda text: all(part(text) for part in parts)

    def _parse_term(self, depth: int) -> Matcher:
        if depth > MAX_DEPTH:
            raise self.error(f"it is nested deeper than {MAX_DEPTH}")
        if self._take("not"):
            inner = self._parse_term(depth + 1)
            return lambda text: not inner(text)
        if self._take("("):
            inner = self.parse_or(depth + 1)
            if not self._take(")"):
                raise self.error("a parenthesis is not closed")
            return inner
        if not self.tokens or self.tokens[0] in ("and", "or", ")"):
            raise self.error("a part of a title is missing")
        word = self.tokens.pop(0).casefold()
        return lambda text: word in text.casefold()

    def _take(self, token: str) -> bool:
        """Return whether the next token is `token`, and remove the token if so."""
        if self.tokens and self.tokens[0] == token:
            self.tokens.pop(0)
            return True
        return False

    def error(self, reason: str) -> UsageError:
        """Return the error that the expression is invalid for this reason."""
        return UsageError(f"cannot read -k {quoted(self._expression)}: {reason}")


def _no_match_message(candidates: Sequence[LoadedScenario], keyword: str, tags: Sequence[str]) -> str:
    """Return the message that no scenario is selected, with a hint for an unknown tag."""
    known = sorted({tag for scenario in candidates for tag in scenario.spec.tags})
    unknown = [tag for tag in tags if tag not in known]
    if unknown:
        return f"no scenario has the tag {quoted(unknown[0])}; {suggestion(unknown[0], known) or 'there are no tags'}"
    tag_filter = " or ".join(f"--tag {tag}" for tag in tags)
    filters = " and ".join(filter(None, (f"-k {quoted(keyword)}" if keyword.strip() else "", tag_filter)))
    return f"none of {len(candidates)} scenarios matches {filters}"
