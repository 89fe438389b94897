"""Topics of `simscen explain` and reference page about metrics."""

from simscen.cli.catalog.fields import OPTIONAL, Field
from simscen.cli.catalog.topics import Topic, entry_point_topics
from simscen.criteria.base import AnyMeasure
from simscen.judge.metrics.catalog import METRICS, Metric

METRICS_TEXT = """\
- Metrics do not depend on the criteria. They are computed from the trace, the recorded data of the run, so
  `simscen judge` returns the same numbers for its log.
- Metrics refer to the true state of the robot unless noted otherwise.
- A number that is not defined is null, for example the smoothness of a robot that never moved; `undefined` contains
  the reason.
- A jump by `kidnap` counts neither as driving nor as turning.
- `intrusion_*` are computed from distances alone. They do not measure how safe people feel near a robot."""

METRICS_CAVEATS = """\
- SPARC and LDLJ affect the verdict only with a `smoothness` criterion. SPARC shows a slow wobble, but hardly a
  stop of 2 s; LDLJ shows the stop. Both depend on the duration: compare them only between drives on the same route.
- The errors within a run are correlated, so the bounds of the chi-square distribution do not apply to its NEES.
  They apply to a mean over runs at a fixed time, as computed by `simscen bench nav`."""

SESSION_METRICS_TEXT = """\
A session reports these numbers in results.json under `suite`, and `simscen report DIR` prints most of them. With
several `--stack`, `suites` contains them for each stack:

- `runs`: number of runs, without the second runs of `--check-determinism`, and without runs that were skipped,
  interrupted, or not started.
- `success_rate`: share of successful runs in the `judged_runs`, with its 95 % Wilson interval. The `judged_runs` are
  the runs with a known `success`, and the runs with an error, which count as unsuccessful.
- `spl`, `soft_spl`: means over all robots that have these metrics. `spl_runs` is the number of values of `spl`.
- `collisions_per_km`, `collisions_per_hour`: collisions per driven kilometer and per simulated hour, over the robots
  whose `collisions` are known. `measured_runs` is the number of runs with such robots; `kilometres` and `hours` are the
  distance driven and the simulated time of these robots.

In a run with several robots, each robot has its own distance, collisions, and SPL. The run succeeds if all robots do.

With several `--stack`, `comparison.against` has an entry for each stack that is compared with the first one
(`comparison.baseline`):

- `pairs`: number of pairs of runs with the same scenario and seed. `left_out` counts the `broken_pairs`, in which a run
  was not completed, and the `runs_without_partner`.
- `flips`: pairs that passed with one stack and failed with the other; `flips_p` is from McNemar's exact test.
- `differences`: for each metric, the mean `difference` over the pairs in which the same robots reach their last goals
  (for collisions, over all pairs), its 95 % bootstrap `interval` (from five pairs on), and `p` from Wilcoxon's
  signed-rank test.

The compared metrics are `time_to_goal`, `path_length`, `min_clearance`, `mean_jerk`, `time_not_moving`, `replans`,
`recoveries`, and `collisions` (of each robot: `a/collisions`), and those of installed packages."""


def metric_topics(with_plugins: bool = False) -> list[Topic]:
    """Return a topic that lists all metrics, then a topic for each metric.

    `with_plugins` adds the metrics of installed packages.
    """
    rows = tuple(Field(name, metric.unit or "number", OPTIONAL, metric.text) for name, metric in METRICS.items())
    single = [Topic("metric", name, None, _metric_text(metric)) for name, metric in METRICS.items()]
    return [
        Topic("metric", "metrics", None, f"{METRICS_TEXT}\n\n{METRICS_CAVEATS}\n\n{SESSION_METRICS_TEXT}", rows=rows),
        *single,
        *entry_point_topics(AnyMeasure.group, with_plugins),
    ]


def metrics_page() -> str:
    """Return the text of docs/reference/metrics.md."""
    lines = []
    for name, metric in METRICS.items():
        if name in _METRIC_GROUPS:
            lines += [f"\n## {_METRIC_GROUPS[name]}\n", "| metric | unit | definition | source |", "|---|---|---|---|"]
        definition = metric.text.replace("|", chr(92) + "|")
        lines.append(f"| `{name}` | {metric.unit} | {definition} | {metric.source} |")
    tables = "\n".join(lines)
    statistics = "[Statistics](statistics.md) explains the intervals and tests."
    session = f"## Metrics of a session\n\n{SESSION_METRICS_TEXT}\n\n{statistics}\n"
    notes = f"## Notes on single metrics\n\n{METRICS_CAVEATS}\n"
    return f"# Metrics\n\n{_METRICS_INTRO}\n\n{METRICS_TEXT}\n{tables}\n\n{notes}\n{session}"


_METRICS_INTRO = """\
A metric is one number of a run, such as the length of its path. This page defines the metrics that every run reports in
`result.json`, and the [metrics of a session](#metrics-of-a-session). `simscen explain metrics` prints the same."""
_METRIC_GROUPS = {
    "success": "Success and time",
    "path_length": "Path",
    "max_speed": "Motion",
    "min_clearance": "Clearance, pedestrians, and collisions",
    "replans": "Replans and recoveries",
    "ape_trans_rmse": "Localization",
}
"""Headings of docs/reference/metrics.md, by the first metric below each."""


def _metric_text(metric: Metric) -> str:
    unit = f"\n\nIts unit is {metric.unit}." if metric.unit else ""
    return metric.text + unit + (f"\n\nSource: {metric.source}." if metric.source else "")
