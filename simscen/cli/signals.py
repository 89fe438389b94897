"""The named signals, for `simscen explain signals` and the reference."""

from simscen.cli.catalogue import OPTIONAL, Field, Topic
from simscen.criteria.signal_table import SIGNALS, Signal

CLOCK = """\
A signal has one value for each sample of the truth (`physics: truth_rate`, 40 Hz by default), and it is the same from
the run and from its log. What comes more rarely (belief, command, scans, plans) is held from when it came until the
next one comes; its first value holds before it. What lasts for less than a sample counts at the sample that follows it.
A signal that is not a number makes the verdict an error that names signal and time; one that was not recorded leaves it
inconclusive. Derivatives are differences over the time between two samples; being carried elsewhere (`kidnap`) is no
motion."""


def signal_topics() -> list[Topic]:
    """The list of all, then each."""
    rows = tuple(Field(name, kind(signal), OPTIONAL, signal.text) for name, signal in SIGNALS.items())
    every = [Topic("signal", name, None, text_of(signal), example(name, signal)) for name, signal in SIGNALS.items()]
    return [Topic("signal", "signals", None, CLOCK, rows=rows), *every]


def kind(signal: Signal) -> str:
    """What its values are: "length in m", "number", "yes or no"."""
    return f"{signal.dimension} in {signal.unit}" if signal.unit else signal.dimension


def text_of(signal: Signal) -> str:
    """What it is, its unit, and what it is about."""
    return (
        f"{signal.text}\n\nIt is a {kind(signal)}.{_keys(signal)}" if not signal.asks else signal.text + _keys(signal)
    )


def example(name: str, signal: Signal) -> str:
    """A condition that uses it."""
    about = "".join(f", {key}: {_EXAMPLES[key]}" for key in (*signal.about[:1], *signal.perhaps))
    bound = "" if signal.asks else f', op: "<=", value: 1.5 {signal.unit}'.rstrip()
    return f"{{signal: {name}{about}{bound}}}"


_EXAMPLES = {
    "object": "cart",
    "region": "dock",
    "fault": "lidar.off",
    "event": "cart appears",
    "goal": "shelf",
    "recovery": "spin",
    "with": "cart",
}


def _keys(signal: Signal) -> str:
    needed = f" Needs {' or '.join(f'`{key}`' for key in signal.about)}." if signal.about else ""
    return needed + "".join(f" May name one: `{key}`." for key in signal.perhaps)


def signals_page() -> str:
    """The body of docs/reference/signals.md."""
    head = "| signal | what | unit | about |\n|---|---|---|---|"
    rows = [
        f"| `{name}` | {signal.text} | {signal.unit or signal.dimension} | {_cell(signal)} |"
        for name, signal in SIGNALS.items()
    ]
    intro = "# Signals\n\nWhat [temporal criteria](../guides/temporal-criteria.md) speak of."
    return "\n".join([f"{intro} `simscen explain signals` tells the same.\n\n{CLOCK}\n\n{head}", *rows]) + "\n"


def _cell(signal: Signal) -> str:
    names = [f"`{key}`" for key in signal.about] + [f"(`{key}`)" for key in signal.perhaps]
    return " or ".join(names)
