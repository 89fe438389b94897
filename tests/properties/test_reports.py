"""Property tests of the reports of a session: all of them contain each run once, with the same outcome."""

import json
import string
from collections import Counter
from dataclasses import replace
from types import SimpleNamespace
from xml.etree import ElementTree

from hypothesis import given, settings
from hypothesis import strategies as st

from simscen.cli.session.exit_codes import exit_code
from simscen.cli.session.pending_runs import divide_runs, previous_session, reusable_results, write_reused
from simscen.core.errors import Exit
from simscen.core.records.disturbances import Disturbance, DisturbanceOutcome
from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.session_events import RunFinished, RunStarted, SessionFinished
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.result_json import from_json, to_json
from simscen.report.journal import Journal
from simscen.report.journal_reader import JOURNAL_FILE, PlannedRun, read_journal
from simscen.report.junit import xml_parts
from simscen.report.merge import merge_shards, read_shards
from simscen.report.results_json import json_parts

GOOD = (Outcome.PASSED, Outcome.SKIPPED, Outcome.FAILED_AS_EXPECTED)
TEXTS = st.text(st.sampled_from(string.ascii_letters + "<>&\"'[]#%é☃\t\n\x1b\u202e\x85 "), max_size=12)
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
MAYBE = st.none() | NUMBERS

FINDINGS = st.builds(
    Finding,
    st.sampled_from(Status),
    *(TEXTS, TEXTS, TEXTS),
    margin=MAYBE,
    unit=TEXTS,
    value=MAYBE,
    tick=st.none() | st.integers(0, 10**6),
    place=st.none() | st.tuples(NUMBERS, NUMBERS),
    detail=st.lists(TEXTS, max_size=2).map(tuple),
)
VERDICTS = st.builds(
    Verdict, TEXTS, TEXTS, st.sampled_from(["fail", "warn"]), st.lists(FINDINGS, max_size=2).map(tuple)
)
TICKS = st.integers(0, 10**6)
DISTURBANCES = st.builds(
    DisturbanceOutcome,
    st.builds(
        Disturbance,
        TEXTS,
        st.sampled_from(["event", "fault"]),
        TEXTS,
        st.booleans(),
        TICKS,
        st.none() | st.integers(0, 9),
    ),
    st.lists(TICKS, max_size=3).map(tuple),
    st.booleans(),
    TEXTS,
    st.none() | TICKS,
)
KEYS = st.builds(
    RunKey,
    st.sampled_from(["faults/lidar_off", "goal", "go.al", "a b"]),
    st.integers(0, 2),
    st.sampled_from(["", "std=5cm", "seed 1"]),
    st.sampled_from(["", "mine", "again", "mine.again"]),
)


@st.composite
def results(draw, keys=KEYS):
    key, outcome = draw(keys), draw(st.sampled_from(Outcome))
    verdicts = tuple(draw(st.lists(VERDICTS, max_size=2)))
    return RunResult(
        key=key,
        path=f"scenarios/{key.scenario}.scenario.yaml",
        outcome=outcome,
        verdicts=verdicts,
        lines=tuple(draw(st.integers(1, 99)) for _ in verdicts),
        metrics=draw(st.dictionaries(st.sampled_from(["success", "path_length", "own"]), MAYBE)),
        undefined=draw(st.dictionaries(TEXTS, TEXTS, max_size=2)),
        events=draw(st.dictionaries(st.sampled_from(["goal.reached", "run.ended"]), st.integers(1, 9))),
        disturbances=tuple(draw(st.lists(DISTURBANCES, max_size=2))),
        ended=draw(TEXTS),
        simulated=draw(st.floats(0, 1e6)),
        tick_rate=draw(st.sampled_from([240, 1000])),
        error=RunFailure(draw(TEXTS), draw(TEXTS), draw(TEXTS), draw(st.booleans()))
        if outcome is Outcome.ERROR
        else None,
        stack=draw(st.sampled_from(["", "mine=nav.yaml"])),
        reason=draw(TEXTS),
    )


@st.composite
def sessions(draw):
    """Return the finished runs of a session in any order, with different keys."""
    keys = draw(st.lists(KEYS, unique=True, max_size=6))
    return [
        RunFinished(draw(results(st.just(key))), wall=draw(st.floats(0, 99)), again=draw(TEXTS), tags=("a",))
        for key in keys
    ]


def outcome_in_junit(case):
    """Return the outcome of a testcase by its elements, as CI servers read it."""
    found = [element for element in case if element.tag in ("failure", "error", "skipped")]
    if not found:
        return Outcome.PASSED
    (element,) = found
    if element.tag == "skipped":
        return Outcome.SKIPPED if element.get("type") == "simscen.skip" else Outcome.FAILED_AS_EXPECTED
    return Outcome.FAILED if element.tag == "failure" else Outcome.ERROR


def junit_summary(case):
    """Return the outcome, seed, and variation of a testcase."""
    properties = {each.get("name"): each.get("value") for each in case.iter("property")}
    return outcome_in_junit(case).value, properties["seed"], properties.get("variation", "")


@given(results())
@settings(deadline=None)
def test_result_is_read_back_equal(result):
    assert from_json(to_json(result)) == result


@given(sessions())
@settings(deadline=None)
def test_junit_and_results_contain_each_run_once_with_its_outcome(runs):
    document = json.loads("".join(json_parts(runs)))
    root = ElementTree.fromstring(b"".join(xml_parts(runs)))
    read = [(RunKey(r["scenario"], r["seed"], r["variation"], r["stack_name"]), r["outcome"]) for r in document["runs"]]
    assert dict(read) == {run.key: run.outcome.value for run in runs}
    assert len(read) == document["total"] == len(runs)
    assert [junit_summary(case) for case in root.iter("testcase")] == [
        (outcome, str(key.seed), key.variation) for key, outcome in read
    ]
    assert len({suite.get("name") for suite in root}) == len(root)
    assert all(len({case.get("name") for case in suite}) == len(suite) for suite in root)


@given(sessions())
@settings(deadline=None)
def test_counts_of_junit_results_and_exit_code_agree(runs):
    document = json.loads("".join(json_parts(runs)))
    root = ElementTree.fromstring(b"".join(xml_parts(runs)))
    counts = Counter(run.outcome for run in runs)
    assert {outcome: document[outcome.value] for outcome in Outcome} == {
        outcome: counts[outcome] for outcome in Outcome
    }
    for element, part in [(root, runs), *((suite, _runs_of(suite, runs)) for suite in root)]:
        part_counts = Counter(run.outcome for run in part)
        assert [int(element.get(key)) for key in ("tests", "failures", "errors")] == [
            len(part),
            part_counts[Outcome.FAILED],
            part_counts[Outcome.ERROR],
        ]
        if element is not root:
            assert int(element.get("skipped")) == part_counts[Outcome.SKIPPED] + part_counts[Outcome.FAILED_AS_EXPECTED]
    is_good = exit_code(runs) in (Exit.PASSED, Exit.NOTHING_SELECTED)
    assert is_good == all(run.outcome in GOOD for run in runs)


def _runs_of(suite, runs):
    return [run for run in runs if run.result.path == suite.get("name")]


def planned_runs(runs):
    return [PlannedRun(run.key, run.result.path, "digest", run.again, stack=run.result.stack) for run in runs]


def write_session(folder, runs, finished):
    """Write a session that plans all `runs` and ends after those in `finished`."""
    folder.mkdir(exist_ok=True)
    journal = Journal(folder, sync=False)
    journal.plan(planned_runs(runs), "1", 2)
    for run in finished:
        journal(RunStarted(run.key, run.result.path))
        journal(run)
    journal(SessionFinished(0, 0, 0, 0.0, 1.0))
    journal.close()
    assert journal.error is None


@given(sessions(), st.randoms(use_true_random=False))
@settings(deadline=None)
def test_merged_shards_give_the_reports_of_one_session(tmp_path_factory, runs, random):
    parts = [[run for k, run in enumerate(runs) if k % 2 == number] for number in range(2)]
    shards = []
    for number, part in enumerate(parts, start=1):
        folder = tmp_path_factory.mktemp("session")
        journal = Journal(folder, sync=False)
        journal.plan(planned_runs(part), "1", 2, (number, 2))
        for run in random.sample(part, len(part)):
            journal(run)
        journal.close()
        shards.append(folder)
    merged = tmp_path_factory.mktemp("session")
    merge_shards(read_shards(shards, allow_missing=False), merged, "runs")
    found = read_journal(merged).runs
    assert "".join(json_parts(found)) == "".join(json_parts(runs))
    assert b"".join(xml_parts(found)) == b"".join(xml_parts(runs))


@given(sessions(), st.data())
@settings(deadline=None)
def test_resumed_session_runs_each_planned_run_that_has_no_result(tmp_path_factory, runs, data):
    """The journal is cut at any byte, as if the machine had crashed. Errors and changed scenarios run again."""
    folder = tmp_path_factory.mktemp("session")
    write_session(folder, runs, runs)
    file = folder / JOURNAL_FILE
    content = file.read_bytes()
    first_line = content.index(b"\n") + 1
    share = data.draw(st.floats(0, 1))  # the times in the journal have different lengths
    file.write_bytes(content[: first_line + round(share * (len(content) - first_line))])
    kept_runs = [run for run in runs if run.key in read_journal(folder).finished]
    changed = data.draw(st.sets(st.sampled_from([run.key for run in runs]))) if runs else set()
    plan = [replace(run, digest="new") if run.key in changed else run for run in planned_runs(runs)]
    jobs = [SimpleNamespace(key=run.key) for run in runs]
    journal = Journal(folder, resume=True, sync=False)
    remaining, reused = divide_runs(jobs, plan, reusable_results(previous_session(journal)))
    journal.plan(plan, "1", 2)
    write_reused(journal, reused)
    new_runs = [replace(run, wall=7.0) for run in runs if run.key in {job.key for job in remaining}]
    for run in new_runs:
        journal(run)
    journal.close()
    assert Counter(run.key for run in (*reused, *new_runs)) == Counter(run.key for run in runs)
    assert all(run.resumed and run.outcome is not Outcome.ERROR for run in reused)
    assert {run.key for run in reused}.isdisjoint(changed)
    assert {run.key for run in reused} <= {run.key for run in kept_runs}
    session = read_journal(folder)
    assert not session.interrupted
    assert [(run.key, run.result) for run in session.runs] == [(run.key, run.result) for run in runs]
