"""Writer of junit.xml, with one testsuite per scenario file and one testcase per run."""

import re
from collections.abc import Collection, Iterator, Sequence
from itertools import islice
from typing import Literal
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, SubElement

from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished
from simscen.core.records.study import ClaimResult, ClaimStatus, Study
from simscen.core.records.verdict import unique_name
from simscen.judge.finding_text import disturbance_line, subject
from simscen.report.display_text import escape_control, one_line, shell_command_text
from simscen.report.results_json import in_order
from simscen.report.study import claim_text, claim_title
from simscen.report.violations import (
    error_details,
    failed_violations,
    first_violation,
    reason_without_failure,
    reported_violations,
    scenario_file,
    source_location,
)

Family = Literal["simscen", "xunit2"]
"""Dialect of the format. "xunit2" omits `file`, `line`, and `properties`, which junit-10.xsd of Jenkins forbids."""
_COUNTS = ("tests", "failures", "errors", "skipped", "time")
"""Attributes of a testsuite: numbers of runs, and the sum of their wall times in s."""
MAX_CLAIM_FAILURES = 100
"""Maximum number of failed runs in the testcase of a claim."""


def xml_parts(
    runs: Sequence[RunFinished], family: Family = "simscen", name: str = "simscen", study: Study | None = None
) -> Iterator[bytes]:
    """Yield the document in UTF-8 in consecutive parts, to save memory. Runs are sorted by file and key.

    `name` is the attribute `name` of the root element. For a `study` with a claim (a minimum pass rate to show), the
    document has one testcase for the claim, and one for each run that could not be completed.
    """
    root = Element("testsuites", {"name": escape_control(name)})
    ordered = in_order(runs)
    if study is not None and study.claim is not None and ordered:
        yield _claim_xml(root, study, study.claim, ordered, family)
        return
    counts: dict[str, dict[str, float]] = {}
    for run in ordered:
        _add_counts(counts.setdefault(run.result.path, dict.fromkeys(_COUNTS, 0)), run)
    _set_sums(root, counts.values())
    yield b"<?xml version='1.0' encoding='utf-8'?>\n"
    if not counts:
        yield ElementTree.tostring(root) + b"\n"
        return
    yield _opening_tag(root)
    path, used_names = None, set[str]()
    for run in ordered:
        if run.result.path != path:
            yield b"" if path is None else b"\n  </testsuite>"
            path, used_names = run.result.path, set()
            element = Element("testsuite", {"name": escape_control(scenario_file(run))})
            _set_sums(element, [counts[path]])
            element.set("skipped", str(counts[path]["skipped"]))
            yield b"\n  " + _opening_tag(element)
        parent = Element("testsuite")
        _add_case(parent, run, unique_name(_case_name(run), used_names, " #"), family)
        ElementTree.indent(parent[0], level=2)
        parent[0].tail = None
        yield b"\n    " + ElementTree.tostring(parent[0], encoding="utf-8")
    yield b"\n  </testsuite>\n</testsuites>\n"


def _add_counts(counts: dict[str, float], run: RunFinished) -> None:
    """Add a run to the attributes of its testsuite. `skipped` also counts runs that failed as expected."""
    counts["tests"] += 1
    counts["failures"] += run.outcome is Outcome.FAILED
    counts["errors"] += run.outcome is Outcome.ERROR
    counts["skipped"] += bool(reason_without_failure(run))
    counts["time"] += run.wall


def _set_sums(element: Element, counts: Collection[dict[str, float]]) -> None:
    """Set the attributes of an element to the sums of `counts`, except `skipped`, which the root element must not have.

    `counts` are the values of _COUNTS of several testsuites.
    """
    for name in ("tests", "failures", "errors"):
        element.set(name, str(sum(each[name] for each in counts)))
    element.set("time", f"{sum(each['time'] for each in counts):.3f}")


def _opening_tag(element: Element) -> bytes:
    """Return the start tag of an element that has no content yet."""
    text: bytes = ElementTree.tostring(element, encoding="utf-8")
    return text.removesuffix(b" />") + b">"


def _claim_xml(root: Element, study: Study, claim: ClaimResult, runs: Sequence[RunFinished], family: Family) -> bytes:
    """Return the document of a study with a claim. The testcase of the claim lists the failed runs.

    A claim that is undecided, or blocked by runs that were not completed, is an error.
    """
    incomplete = [run for run in runs if run.outcome is Outcome.ERROR]
    suite = SubElement(root, "testsuite", {"name": escape_control(scenario_file(runs[0]))})
    name = one_line(f"{study.scenario.rpartition('/')[2]} [{claim_title(claim)}]")
    seconds = f"{sum(run.wall for run in runs):.3f}"
    case = SubElement(suite, "testcase", {"classname": _classname(runs[0]), "name": name, "time": seconds})
    message = one_line(claim_text(claim))
    failed = islice((run for run in runs if run.outcome is Outcome.FAILED), MAX_CLAIM_FAILURES)
    failures = (f"{one_line(run.key.test)} seed {run.key.seed}: {first_violation(run)}" for run in failed)
    details = "\n".join([message, *failures])
    match claim.status:
        case ClaimStatus.REFUTED:
            SubElement(case, "failure", {"type": "simscen.pass-rate", "message": message}).text = details
        case ClaimStatus.UNDECIDED | ClaimStatus.BLOCKED:
            kind = f"simscen.{claim.status.value}"
            SubElement(case, "error", {"type": kind, "message": message}).text = details
        case ClaimStatus.HELD:
            SubElement(case, "system-out").text = details
    used_names = {name}
    for run in incomplete:
        _add_case(suite, run, unique_name(_case_name(run), used_names, " #"), family)
    is_refuted = claim.status is ClaimStatus.REFUTED
    is_error = claim.status in (ClaimStatus.UNDECIDED, ClaimStatus.BLOCKED)
    counts = {"tests": 1 + len(incomplete), "failures": int(is_refuted), "errors": is_error + len(incomplete)}
    for element in (root, suite):
        _set_sums(element, [{**counts, "time": sum(run.wall for run in runs)}])
    suite.set("skipped", "0")
    ElementTree.indent(root)
    body: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return body + b"\n"


def _add_case(suite: Element, run: RunFinished, name: str, family: Family) -> None:
    case = SubElement(suite, "testcase", {"classname": _classname(run), "name": name, "time": f"{run.wall:.3f}"})
    if family == "simscen":
        case.set("file", escape_control(scenario_file(run)))
        lines = (each.line for each in failed_violations(run) if each.line)
        case.set("line", str(next(lines, 1)))
        _add_properties(case, run)
    match run.outcome:
        case Outcome.FAILED:
            _add_failure(case, run)
        case Outcome.ERROR:
            _add_error(case, run)
        case Outcome.SKIPPED:
            SubElement(case, "skipped", {"type": "simscen.skip", "message": escape_control(run.result.reason)})
        case Outcome.FAILED_AS_EXPECTED:  # as pytest reports xfail
            SubElement(case, "skipped", {"type": "simscen.expected-failure", "message": reason_without_failure(run)})
        case Outcome.PASSED:
            pass
    if output := _system_out(run):
        SubElement(case, "system-out").text = output


def _add_properties(case: Element, run: RunFinished) -> None:
    properties = SubElement(case, "properties")
    values = {
        "seed": str(run.key.seed),
        "variation": run.key.variation,
        "simulated_seconds": f"{run.result.simulated:.3f}",
        "stack": run.result.stack,
        "ended": run.result.ended,
        "expected": run.result.reason if run.outcome is not Outcome.SKIPPED else "",
        "again": shell_command_text(run.again),
        "resumed": "true" if run.resumed else "",
    }
    for verdict in run.result.verdicts:
        values[f"status.{verdict.id}"] = verdict.status.value
        for finding in verdict.findings:
            if finding.margin is not None:
                name = subject(verdict, finding).replace(": ", ".")
                values[f"margin.{name}"] = f"{finding.margin:.6g} {finding.unit}".rstrip()
    for key, value in values.items():
        if value:
            SubElement(properties, "property", {"name": one_line(key), "value": escape_control(value)})


def _add_failure(case: Element, run: RunFinished) -> None:
    failures = failed_violations(run)
    element = SubElement(case, "failure")
    element.set("type", escape_control(failures[0].verdict.criterion) if failures else "criterion")
    element.set("message", first_violation(run) or "failed")
    element.text = _details(run)


def _add_error(case: Element, run: RunFinished) -> None:
    kind, message, tail = error_details(run)
    element = SubElement(case, "error", {"type": escape_control(kind), "message": message})
    parts = [f"{source_location(run)}: {message}", tail, _details(run)]
    element.text = "\n".join(part for part in parts if part)


def _details(run: RunFinished) -> str:
    """Return the violations and the command that repeats the run, one per line."""
    lines = []
    for violation in failed_violations(run):
        lines.append(f"{source_location(run, violation.line)}: {violation.message}")
        lines += [f"    {text}" for text in violation.detail]
    return "\n".join([*lines, *([f"again: {shell_command_text(run.again)}"] if run.again else [])])


def _system_out(run: RunFinished) -> str:
    """Return a line for each warning, disturbance, and artifact. Jenkins and GitLab attach the artifacts to the run."""
    warnings = [violation for violation in reported_violations(run) if violation.is_warning]
    lines = [f"{source_location(run, warning.line)}: warning: {warning.message}" for warning in warnings]
    files = (run.artifacts.picture, run.artifacts.replay, run.artifacts.mcap, run.artifacts.result)
    for each in run.result.disturbances:
        lines.append(one_line(f"{each.disturbance.kind} {disturbance_line(each, run.result.tick_rate)}"))
    escaped = [line.replace("[[ATTACHMENT|", "[ [ATTACHMENT|") for line in lines]  # user text must not attach files
    return "\n".join([*escaped, *(f"[[ATTACHMENT|{one_line(file)}]]" for file in files if file)])


def _classname(run: RunFinished) -> str:
    """Return the scenario ID with dots instead of slashes, for example "scenarios.faults.lidar_off"."""
    parts = [re.sub(r"[.\s]+", "_", part) for part in run.key.scenario.split("/") if part not in ("", ".", "..")]
    return escape_control(".".join(parts)) or "simscen"


def _case_name(run: RunFinished) -> str:
    """Return a name such as "lidar_off [seed 7]", with the variation and the stack if there are several."""
    parts = [run.key.variation, f"seed {run.key.seed}", run.key.stack_name]
    return one_line(f"{run.key.scenario.rpartition('/')[2]} [{', '.join(part for part in parts if part)}]")
