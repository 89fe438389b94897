"""What one expansion may cost, counted and not timed: it ends alike on every machine."""

MOST_STEPS = 300_000
"""Elements, macros (ten each), characters / 16 and parts of expressions; a TurtleBot 4 needs 10 000."""
DEEPEST = 150
"""Elements, macros, includes, properties and expressions within each other; Python's own stack holds 900."""
LONGEST = 1 << 16
"""Characters of a text, values in a list."""


class Refused(Exception):
    """Why a text or an expression is not expanded: a sentence without its place, and what helps."""

    def __init__(self, message: str, hint: str = "") -> None:
        self.message, self.hint = message, hint
        super().__init__(message)


class Missing(Refused):
    """A file or a package is not there; what else there is can still be looked at."""


class Budget:
    """Counts steps, and, as a context manager, how deep they are within each other. Raises Refused."""

    def __init__(self) -> None:
        self._steps, self._depth = 0, 0

    def spend(self, steps: int = 1) -> None:
        """So many steps more."""
        self._steps += steps
        if self._steps > MOST_STEPS:
            raise Refused(f"expanding takes more than {MOST_STEPS} steps")

    def __enter__(self) -> None:
        self._depth += 1
        if self._depth > DEEPEST:
            self._depth -= 1
            raise Refused(f"macros, properties and elements are nested deeper than {DEEPEST}")

    def __exit__(self, *_: object) -> None:
        self._depth -= 1
