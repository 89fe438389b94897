"""Feeds damaged files to every loader: `python tests/fuzz/fuzz.py [--mutants N] [--seed N] [--only TARGET[:NUMBER]]`.

A mutant must be accepted and ready to run, or be refused with InvalidInput. Other exceptions, crashes, more than 5 s of
CPU time, and more than 1 GiB of memory are findings. A mutant depends only on seed, target, and number. The
exit code is 1 if there are findings, each of which is printed with the option that repeats it.
"""

import argparse
import json
import os
import random
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

from targets import Target, check_problems, targets

import simscen
from simscen.core.errors import InvalidInput

CHUNK = 100
CPU_SECONDS = 5.0
MEMORY = 1 << 30
QUICK = """\
simscen: 1
world: {simscen: 1, walls: [{points: [[0, 0], [6, 0], [6, 4], [0, 4], [0, 0]]}]}
robot: {pose: {x: 1, y: 1}}
goals: [{pose: {x: 1.4, y: 1}}]
time_limit: 2 s
pass:
  - {collisions: {max: 0}}
  - {always: {signal: clearance, op: ">=", value: 0.1}}
  - {goals_reached: {}}
  - {path_length: {max: 3}}
"""


def examine(target: Target, name: str, folder: Path) -> dict[str, Any]:
    """Build one mutant in `folder`, read it, and return the result."""
    try:
        mutated = target.build(folder, random.Random(name))
        try:
            problems = target.read(mutated)
        except InvalidInput as error:
            problems = error.problems
        check_problems(problems, mutated)
        errors = [problem for problem in problems if problem.severity == "error"]
        return {"mutant": name, "how": "refused" if errors else "accepted"}
    except BaseException as error:
        frames = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in frames if "simscen" in frame.filename and "fuzz" not in frame.filename] or frames
        where = f"{Path(own[-1].filename).name}:{own[-1].lineno}"
        what = f"{type(error).__name__} in {where}" if own is not frames else f"{type(error).__name__}: {error}"[:150]
        return {"mutant": name, "how": what, "traceback": traceback.format_exc()[-1500:]}


def chunk(target: Target, names: list[str]) -> Iterator[dict[str, Any]]:
    """Examine mutants in a child process; if it dies on one, yield a finding and continue in another child."""
    while names:
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(reading)
            _be_child(target, names, writing)
        os.close(writing)
        with os.fdopen(reading) as lines:
            for line in lines:
                yield json.loads(line)
                names = names[1:]
        _, status = os.waitpid(child, 0)
        if os.WIFSIGNALED(status):
            number = os.WTERMSIG(status)
            hung = number in (signal.SIGPROF, signal.SIGXCPU)
            how = f"more than {CPU_SECONDS:g} s of CPU" if hung else f"crash: {signal.Signals(number).name}"
            yield {"mutant": names[0], "how": how}
            names = names[1:]
        elif names:
            yield {"mutant": names[0], "how": f"exit {os.WEXITSTATUS(status)}"}
            names = names[1:]


def _be_child(target: Target, names: list[str], report: int) -> None:
    """Examine mutants, and exit. The default action of SIGPROF ends also loops in C, which handle no signals."""
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + MEMORY, used + MEMORY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    null = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2):
        os.dup2(null, descriptor)
    try:
        for name in names:
            folder = Path(tempfile.mkdtemp(prefix="fuzz-"))
            signal.setitimer(signal.ITIMER_PROF, CPU_SECONDS)
            result = examine(target, name, folder)
            signal.setitimer(signal.ITIMER_PROF, 0)
            shutil.rmtree(folder, ignore_errors=True)
            os.write(report, json.dumps(result).encode() + b"\n")
    finally:
        os._exit(0)


def invalid_corpus_files(known: dict[str, Target]) -> list[str]:
    """Return the files of the corpus that are refused without damage: all their mutants would fail in the same line."""
    found = []
    for name, target in known.items():
        for index, file in enumerate(target.files):
            with tempfile.TemporaryDirectory() as folder:
                whole = replace(target, damage=lambda corpus, _, index=index: (index, corpus[index]))
                how = examine(whole, name, Path(folder))["how"]
                found += [f"{name}/{file}: {how}"] if how != "accepted" else []
    return found


def log_of_short_run() -> bytes:
    """Return the log of a short run."""
    with tempfile.TemporaryDirectory() as name:
        scenario, log = Path(name) / "a.scenario.yaml", Path(name) / "run.mcap"
        scenario.write_text(QUICK)
        simscen.simulate(scenario, log=log)
        return log.read_bytes()


def all_results(chosen: dict[str, Target], each: int, seed: int, jobs: int) -> Iterator[dict[str, Any]]:
    """Yield the results of all mutants, from several children at a time."""
    work = [
        (target, [f"{seed}:{name}:{number}" for number in range(start, min(start + CHUNK, each))])
        for start in range(0, each, CHUNK)
        for name, target in chosen.items()
    ]
    running: dict[int, tuple[int, bytes]] = {}
    while work or running:
        while work and len(running) < jobs:
            reading, writing = os.pipe()
            target, names = work.pop(0)
            child = os.fork()
            if child == 0:
                with os.fdopen(writing, "w") as out:
                    for result in chunk(target, names):
                        out.write(json.dumps(result) + "\n")
                os._exit(0)
            os.close(writing)
            running[reading] = (child, b"")
        for reading in select.select(list(running), [], [])[0]:
            child, before = running[reading]
            data = os.read(reading, 1 << 16)
            if data:
                running[reading] = (child, before + data)
                continue
            os.close(reading)
            os.waitpid(child, 0)
            del running[reading]
            yield from map(json.loads, before.splitlines())


def main() -> int:
    """Examine all mutants, and print each kind of finding once."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mutants", type=int, default=20_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="target, or SEED:TARGET:NUMBER to repeat one, whose files stay")
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)))
    options = parser.parse_args()
    known = targets(log_of_short_run())
    if options.only.count(":") == 2:
        folder = Path(tempfile.mkdtemp(prefix="mutant-"))
        result = examine(known[options.only.split(":")[1]], options.only, folder)
        print(folder, result["how"], result.get("traceback", ""), sep="\n")
        return int("traceback" in result)
    if bad := invalid_corpus_files(known):
        print("invalid files in the corpus:", *bad, sep="\n  ")
        return 1
    chosen = {name: target for name, target in known.items() if options.only in ("", name)}
    start_s, each = time.monotonic(), -(-options.mutants // len(chosen))
    counts: dict[str, Counter[str]] = {name: Counter() for name in chosen}
    findings: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for result in all_results(chosen, each, options.seed, options.jobs):
        name, how = result["mutant"].split(":")[1], result["how"]
        counts[name][how if how in ("accepted", "refused") else "finding"] += 1
        if how not in ("accepted", "refused"):
            findings.setdefault((name, how), []).append(result)
    for name, count in counts.items():
        print(f"{name:9} {count.total():6} mutants  " + "  ".join(f"{n} {how}" for how, n in sorted(count.items())))
    for (name, how), found in findings.items():
        print(f"\n{name}: {how}, {len(found)} times, e.g. --only {found[0]['mutant']}\n{found[0].get('traceback', '')}")
    total, wrong = sum(count.total() for count in counts.values()), sum(map(len, findings.values()))
    print(f"{total} mutants in {time.monotonic() - start_s:.0f} s, {wrong} findings of {len(findings)} kinds")
    return int(bool(findings) or total < options.mutants)


if __name__ == "__main__":
    sys.exit(main())
