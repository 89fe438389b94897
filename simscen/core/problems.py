"""A mistake in a file, told so that it can be mended."""

from dataclasses import dataclass


@dataclass(frozen=True, order=True)
class Problem:
    """What is wrong, where (`line` and `col` count from 1; 0 = the file as a whole), and how to mend it.

    `code` is stable (SC…); `severity` is "error" or "warning"; `source` is the text of the line for the caret.
    """

    path: str
    line: int
    col: int
    code: str
    message: str
    hint: str = ""
    severity: str = "error"
    source: str = ""

    @property
    def place(self) -> str:
        """path:line:col, or the path alone."""
        return f"{self.path}:{self.line}:{self.col}" if self.line else self.path
