"""What the runs are filtered and sorted with; hidden where the page's script does not run."""

from collections import Counter
from collections.abc import Sequence

from simscen.core.records.run_result import Outcome
from simscen.core.records.session_events import RunFinished
from simscen.report.suite.bits import SIGNS, text
from simscen.report.suite.history import Past, changes
from simscen.report.suite.run import theme

_SORTS = {
    "": "failed first",
    "name": "by name",
    "simulated": "longest first",
    "wall": "slowest to run first",
    "margin": "least margin first",
}


def controls(runs: Sequence[RunFinished], past: Sequence[Past]) -> str:
    """The search field, the statuses, and a list for whatever there is more than one of."""
    number = Counter(run.outcome for run in runs)
    statuses = "".join(
        f'<label class="{outcome.value}"><input type="checkbox" name="status" value="{outcome.value}" checked> '
        f"{SIGNS[outcome]} {number[outcome]} {outcome.value.replace('-', ' ')}</label>"
        for outcome in Outcome
        if number[outcome]
    )
    changed = sum(changes(run, past) != "" for run in runs)
    if changed:
        statuses += f'<label><input type="checkbox" name="changed"> only the {changed} that changed</label>'
    lists = [
        _list("theme", Counter(theme(run.key) for run in runs)),
        _list("tag", Counter(tag for run in runs for tag in set(run.tags))),
        _list("stack", Counter(run.key.stack_name for run in runs)),
        _list("variation", Counter(run.key.variation for run in runs)),
    ]
    sorts = "".join(f'<option value="{value}">{label}</option>' for value, label in _SORTS.items())
    return (
        '<form id="controls" role="search" hidden>'
        '<label class="find">search <input type="search" name="find" autocomplete="off" '
        'placeholder="name, tag, criterion, reason …"></label>'
        f"<fieldset><legend>show</legend>{statuses}</fieldset>{''.join(lists)}"
        f'<label>order <select name="order">{sorts}</select></label>'
        '<span id="shown" role="status" class="quiet"></span>'
        '<span class="keys quiet">keys: <kbd>/</kbd> search, <kbd>j</kbd> <kbd>k</kbd> next and previous run, '
        "<kbd>f</kbd> next failure</span></form>"
    )


def _list(name: str, found: Counter[str]) -> str:
    named = sorted(value for value in found if value)
    if not named or len(found) < 2:
        return ""
    options = "".join(f'<option value="{text(value)}">{text(value)} ({found[value]})</option>' for value in named)
    return f'<label>{name} <select name="{name}"><option value="">all</option>{options}</select></label>'
