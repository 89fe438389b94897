"""Topics of `simscen explain` and reference page about signals."""

from simscen.cli.catalog.fields import OPTIONAL, Field
from simscen.cli.catalog.topics import Topic
from simscen.criteria.trace_signals.catalog import SIGNALS, Signal

SIGNALS_TEXT = """\
- A signal has one value per sample of the truth (`physics: truth_rate`, 40 Hz by default). Its values are the same in
  the run and in its log.
- Data with a lower rate (belief, command, scans, plans) keeps its value until the next message. Unless the table states
  otherwise, the first value also holds before it. The first belief holds for at most 1 s before it; earlier, the
  signals `localization_error`, `localization_yaw_error`, `position_std`, `yaw_std`, `nees`, and `distance_remaining`
  are unknown. A condition is undecided if it depends on an unknown value.
- An event that is shorter than a sample counts at the next sample.
- Derivatives are differences between two samples, divided by the time between them.
- A jump by `kidnap` does not count as motion.
- If a value is not a number, the verdict is an error that names the signal and the time. If the signal was not
  recorded, the verdict is inconclusive."""


def signal_topics() -> list[Topic]:
    """Return a topic that lists all signals, then a topic for each signal."""
    rows = tuple(Field(name, _signal_kind(signal), OPTIONAL, signal.text) for name, signal in SIGNALS.items())
    single = [
        Topic("signal", name, None, _signal_description(signal), _signal_example(name, signal))
        for name, signal in SIGNALS.items()
    ]
    return [Topic("signal", "signals", None, SIGNALS_TEXT, rows=rows), *single]


def _signal_kind(signal: Signal) -> str:
    """Return the kind of the values of a signal, such as "length in m", "number", or "yes or no"."""
    return f"{signal.dimension} in {signal.unit}" if signal.unit else signal.dimension


def _signal_description(signal: Signal) -> str:
    """Return the description of a signal, with its unit and arguments."""
    text = signal.text if signal.is_boolean else f"{signal.text}\n\nIt is a {_signal_kind(signal)}."
    if signal.alternative_arguments:
        text += f" Needs {' or '.join(f'`{key}`' for key in signal.alternative_arguments)}."
    return text + "".join(f" Optional argument: `{key}`." for key in signal.optional_arguments)


def _signal_example(name: str, signal: Signal) -> str:
    """Return a YAML example of a condition with this signal."""
    keys = (*signal.alternative_arguments[:1], *signal.optional_arguments)
    arguments = "".join(f", {key}: {_EXAMPLE_ARGUMENTS[key]}" for key in keys)
    bound = "" if signal.is_boolean else f', op: "<=", value: 1.5 {signal.unit}'.rstrip()
    return f"{{signal: {name}{arguments}{bound}}}"


_EXAMPLE_ARGUMENTS = {
    "object": "cart",
    "region": "dock",
    "fault": "lidar.off",
    "event": "cart appears",
    "goal": "shelf",
    "recovery": "spin",
    "with": "cart",
}


_SIGNALS_INTRO = """\
A signal is a quantity of a run over time, such as the speed of the robot. This page lists all signals; `simscen explain
signals` prints the same. Use them in [temporal criteria](../guides/temporal-criteria.md):

```yaml
pass:
  - always: {signal: distance_to, object: cart, op: ">=", value: 0.5 m}
```

Arguments in parentheses are optional. *True* values are those of the simulator, not the estimates of the stack.
"""


def signals_page() -> str:
    """Return the text of docs/reference/signals.md."""
    head = "| signal | meaning | unit | arguments |\n|---|---|---|---|"
    rows = []
    for name, signal in SIGNALS.items():
        arguments = [f"`{key}`" for key in signal.alternative_arguments]
        arguments += [f"(`{key}`)" for key in signal.optional_arguments]
        unit = signal.unit or signal.dimension
        rows.append(f"| `{name}` | {signal.text} | {unit} | {' or '.join(arguments)} |")
    sampling = f"\n## Values of a signal\n\n{SIGNALS_TEXT}\n"
    return "\n".join([f"# Signals\n\n{_SIGNALS_INTRO}\n{head}", *rows, sampling])
