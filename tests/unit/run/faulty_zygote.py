"""A warm process whose runs go wrong the way the scenario's first tag says: the test-only hook for faults."""

import ctypes
import os
import signal
import subprocess
import sys
import time

from simscen.run.zygote import Zygote


def perform(job, tell):
    fault = job.scenario.spec.tags[0] if job.scenario.spec.tags else "fine"
    tell(1.5)
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
        case "hang":
            time.sleep(60)
        case "deaf":
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            time.sleep(60)
        case "memory":
            hoard = [bytearray(1 << 28) for _ in range(64)]
            return {"outcome": f"{len(hoard)}"}
        case "grandchild":
            subprocess.Popen(["sleep", "60"])
        case "flood":
            for _ in range(100):
                os.write(1, b"x" * 1_000_000)
        case "kill-parent":
            os.kill(os.getppid(), signal.SIGKILL)
            time.sleep(60)
        case "garbled":
            (job.folder / "result.json").write_text('{"outcome": "passed"}')
            return {"outcome": "passed"}
    (job.folder / "result.json").write_text(RESULT)
    return {"outcome": "passed"}


RESULT = """{"format": 1, "scenario": "x", "seed": 1, "variation": "", "path": "x", "outcome": "passed", "ended": "",
"simulated_seconds": 1.5, "tick_rate": 240, "again": "", "events": {}, "metrics": {}, "verdicts": [], "error": null}"""


if __name__ == "__main__":
    Zygote(sys.stdin.buffer, int(sys.argv[1]), lambda job: None, perform).serve()
