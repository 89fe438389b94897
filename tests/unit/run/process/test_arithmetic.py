"""A run has the last bits of the process that asked for it: the fingerprint that a session notes is its runs'."""

import os
import subprocess
import sys

SHOWN = "from simscen.run.reproducibility.environment import arithmetic_fingerprints; print(arithmetic_fingerprints())"
BOTH = f"""
import subprocess, sys
from simscen.run.process.isolation import clean_environment
{SHOWN}
print(subprocess.run([sys.executable, "-c", {SHOWN!r}], env=clean_environment(), capture_output=True, text=True).stdout)
"""
CHOSEN = {
    "OPENBLAS_CORETYPE": "Prescott",
    "NPY_DISABLE_CPU_FEATURES": "AVX2",
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA",
}
"""What numpy's wheels and the C library may be told of the instructions they use; another processor's is as good."""


def test_a_worker_computes_as_its_caller_was_told_to() -> None:
    environment = {**os.environ, **CHOSEN, "SECRET": "x"}
    done = subprocess.run([sys.executable, "-c", BOTH], env=environment, capture_output=True, text=True, check=False)
    caller, worker = done.stdout.split("\n", 1)
    assert caller == worker.strip() != "", done.stderr
    usual = subprocess.run([sys.executable, "-c", SHOWN], capture_output=True, text=True, check=True).stdout
    assert caller != usual.strip()
