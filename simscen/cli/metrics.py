"""The metrics of every run and of a session, for `simscen explain metrics` and the reference."""

from simscen.cli.catalogue import OPTIONAL, Field, Topic, added_topics
from simscen.criteria.measure import AnyMeasure
from simscen.judge.measure.table import METRICS, Metric

REPORTED = """\
Every run reports these numbers in result.json, whether a criterion asks for them or not; they are computed from the
trace, so that `simscen judge` of its log gives the same. They are of the truth unless they say otherwise. Where a
number is not defined (a robot that never moved has no smoothness) it is null, and `undefined` says why. Being carried
elsewhere (`kidnap`) is neither driving nor turning. What people feel when a robot comes near (`intrusion_*`) is left
out: there are no people to ask yet."""

CAVEATS = """\
SPARC and LDLJ are reported, and nothing is judged by them unless a `smoothness` criterion asks. SPARC hardly notices a
stop of 2 s but sees a slow wobble; LDLJ sees the stop; both drift with the duration of a drive. Compare them only
between drives of the same way. NEES of one run is a mean over correlated errors; the bounds of the chi-square
distribution hold for a mean over runs at a fixed time, as `simscen bench nav` takes it."""

SESSION = """\
A session reports in results.json under `suite`, and `simscen report DIR` prints: `runs`; `success_rate` with its 95 %
Wilson interval, of all runs, those with errors included; `spl` and `soft_spl`, means over the runs that have them
(`spl_runs` of them); `collisions_per_km` and `collisions_per_hour` over `kilometres` driven and `hours` simulated of
the `measured_runs` that came to their end. Each of several robots of a run drives, collides and has an SPL of its own;
the run succeeds where all do. With several stacks (`--stack`), `simscen report` prints these for each,
and `comparison` holds, for each stack against the first (`baseline`): `pairs` of the same scenario and seed, what was
`left_out`, `flips` (passed with one, failed with the other) with McNemar's exact `flips_p`, and `differences` of time,
way, clearance, jerk, standing, replans, recoveries, collisions (of each robot: `a/collisions`) and the metrics of
installed packages: `difference` is the mean over pairs, `interval` its 95 % bootstrap interval (from five pairs on),
`p` the sign test."""


def metric_topics(installed: bool = False) -> list[Topic]:
    """The list of all, then each; with those that `installed` packages add, if asked."""
    rows = tuple(Field(name, metric.unit or "number", OPTIONAL, metric.text) for name, metric in METRICS.items())
    every = [Topic("metric", name, None, _told(metric)) for name, metric in METRICS.items()]
    return [
        Topic("metric", "metrics", None, f"{REPORTED}\n\n{CAVEATS}\n\n{SESSION}", rows=rows),
        *every,
        *added_topics(AnyMeasure, installed),
    ]


def metrics_page() -> str:
    """The body of docs/reference/metrics.md."""
    rows = [
        f"| `{name}` | {metric.unit} | {metric.text.replace('|', chr(92) + '|')} | {metric.source} |"
        for name, metric in METRICS.items()
    ]
    head = "| metric | unit | definition | source |\n|---|---|---|---|"
    table = "\n".join([head, *rows])
    intro = "# Metrics\n\n`simscen explain metrics` tells the same."
    return f"{intro}\n\n{REPORTED}\n\n{table}\n\n{CAVEATS}\n\n## Of a session\n\n{SESSION}\n"


def _told(metric: Metric) -> str:
    unit = f"\n\nIts unit is {metric.unit}." if metric.unit else ""
    return metric.text + unit + (f"\n\nSource: {metric.source}." if metric.source else "")
