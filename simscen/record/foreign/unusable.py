"""Why a log of others cannot be used at all."""


class Unusable(ValueError):
    """A log that cannot be judged; the message says why, `hint` what helps."""

    def __init__(self, message: str, hint: str = "") -> None:
        self.hint = hint
        super().__init__(message)
