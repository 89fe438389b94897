"""Fork server for tests, whose runs fail in the way that the first tag of the scenario names."""

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from simscen.run.process.fork_server import ForkServer


def prepare(job):
    match fault_of(job):
        case "prepare-segfault":
            ctypes.string_at(0)
        case "prepare-exit":
            sys.exit(0)
        case "prepare-hang":  # in C and holding the GIL, so that no Python signal handler can run
            signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGALRM})
            ctypes.PyDLL(None).sleep(60)
        case "prepare-memory":
            print("growing", file=sys.stderr, flush=True)
            bytearray(8 << 30)


def fault_of(job):
    return job.scenario.spec.tags[0] if job.scenario.spec.tags else "fine"


def daemon(seconds):
    """Start a process with its own session and without this process as its parent, as daemons do."""
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            for pipe in range(256):
                with contextlib.suppress(OSError):
                    os.close(pipe)
            os.execvp("sleep", ["sleep", seconds])
        os._exit(0)


def perform(job, report_progress):  # noqa: PLR0915 - a list of faults
    fault = fault_of(job)
    report_progress(1.5)
    match fault:
        case "segfault":
            ctypes.string_at(0)
        case "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        case "exit-0":
            os._exit(0)
        case "sys-exit":
            sys.exit(0)
        case "exception":
            raise ZeroDivisionError("the controller divided by zero")
        case "missing-file":
            Path("/nowhere/parameters.txt").read_text()
        case "hang":
            time.sleep(60)
        case "deaf":
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            time.sleep(60)
        case "memory":
            blocks = [bytes(1 << 28) for _ in range(64)]
            return {"outcome": f"{len(blocks)}"}
        case "grandchild":
            subprocess.Popen(["sleep", "60"])
        case "daemon":
            daemon(DAEMON_DURATION_S)
            time.sleep(0.2)
        case "daemon-crash":
            daemon(DAEMON_DURATION_S)
            time.sleep(0.2)
            ctypes.string_at(0)
        case "stray-bytes":
            for pipe in range(3, 256):
                with contextlib.suppress(OSError):
                    os.write(pipe, b"\xff[[[ stray {\n" + b"[" * 100_000 + b'\n[1]\n{"end": 1}\n')
        case "prepare-memory" | "prepare-exit":
            prepare(job)
        case "stop-parent":
            os.kill(os.getppid(), signal.SIGSTOP)
            time.sleep(60)
        case "busy":
            ctypes.PyDLL(None).sleep(60)
        case "long":
            time.sleep(1.0)
        case "flood":
            os.write(1, b"the beginning\n")
            for _ in range(100):
                os.write(1, b"x" * 1_000_000)
            os.write(1, b"\nthe end\n")
        case "kill-parent":
            os.kill(os.getppid(), signal.SIGKILL)
            time.sleep(60)
        case "garbled":
            (job.folder / "result.json").write_text('{"outcome": "passed"}')
            return {"outcome": "passed"}
    (job.folder / "result.json").write_text(RESULT)
    return {"outcome": "passed"}


DAEMON_DURATION_S = "61.25"

RESULT = """{"format": 2, "scenario": "x", "seed": 1, "variation": "", "path": "x", "outcome": "passed", "ended": "",
"simulated_seconds": 1.5, "tick_rate": 240, "again": "", "events": {}, "disturbances": [], "metrics": {},
"undefined": {},
"verdicts": [], "error": null}"""


if __name__ == "__main__":
    ForkServer(0, int(sys.argv[1]), prepare, perform).serve()
