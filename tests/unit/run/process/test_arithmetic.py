"""Tests of the CPU kernels: workers use the kernels of their caller, and logs of processors with AVX2 are equal."""

import hashlib
import os
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from simscen.core.cpu_kernels import CPUINFO, kernel_variables

PRINT_FINGERPRINT = (
    "from simscen.run.platform_fingerprint import arithmetic_fingerprints; print(arithmetic_fingerprints())"
)
PRINT_PINNED_FINGERPRINT = f"from simscen.core.cpu_kernels import pin_kernels; pin_kernels(); {PRINT_FINGERPRINT}"
PRINT_BOTH_FINGERPRINTS = f"""
import subprocess, sys
from simscen.run.process.isolation import clean_environment
{PRINT_PINNED_FINGERPRINT}
command = [sys.executable, "-c", {PRINT_FINGERPRINT!r}]
print(subprocess.run(command, env=clean_environment(), capture_output=True, text=True).stdout)
"""
USER_VARIABLES = {
    "OPENBLAS_CORETYPE": "Prescott",
    "NPY_DISABLE_CPU_FEATURES": "AVX2",
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA",
}
"""Variables with which a user selects other CPU instructions."""
ENVIRONMENT = {name: value for name, value in os.environ.items() if name not in USER_VARIABLES}
FLAGS = set(CPUINFO.read_text().split()) if CPUINFO.exists() else set()
needs_avx2 = pytest.mark.skipif(not {"avx2", "fma"} <= FLAGS, reason="the processor has no AVX2")
needs_avx512 = pytest.mark.skipif("avx512f" not in FLAGS, reason="the processor has no AVX-512")

DEAD_END = Path(__file__).parents[4] / "scenarios" / "corner_cases" / "dead_end.scenario.yaml"
SCENARIO = DEAD_END.read_text().partition("pass:\n")[0] + "time_limit: 15 s\npass: [{collisions: {max: 0}}]\n"
"""A scenario whose logs differ between CPU kernels after some seconds."""


def output_lines(code: str, environment: dict[str, str]) -> list[str]:
    """Return the lines that a Python program prints."""
    completed = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
    )
    assert completed.returncode == 0, completed.stderr
    return completed.stdout.split("\n")


@pytest.mark.sample(1)
@pytest.mark.parametrize("variables", [{}, USER_VARIABLES], ids=["default", "the user's variables"])
def test_a_worker_has_the_fingerprint_of_its_caller(variables: dict[str, str]) -> None:
    caller, worker, *_ = output_lines(PRINT_BOTH_FINGERPRINTS, {**ENVIRONMENT, **variables, "SECRET": "x"})
    assert caller == worker != ""


def test_kernel_variables_of_the_user_change_the_fingerprint() -> None:
    assert output_lines(PRINT_PINNED_FINGERPRINT, {**ENVIRONMENT, **USER_VARIABLES}) != output_lines(
        PRINT_PINNED_FINGERPRINT, ENVIRONMENT
    )


@pytest.mark.sample(1)
@needs_avx512
@pytest.mark.parametrize("variables", [{"OPENBLAS_CORETYPE": "SkylakeX"}, {"NPY_DISABLE_CPU_FEATURES": ""}])
def test_kernels_for_avx512_have_another_fingerprint(variables: dict[str, str]) -> None:
    """Otherwise, equal fingerprints would hide why two logs differ."""
    assert output_lines(PRINT_PINNED_FINGERPRINT, {**ENVIRONMENT, **variables}) != output_lines(
        PRINT_PINNED_FINGERPRINT, ENVIRONMENT
    )


@pytest.fixture(scope="module")
def digest(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., str]:
    """Return a function that returns the digest of the scenario's log, with some variables set."""

    @cache
    def run(**variables: str) -> str:
        folder = tmp_path_factory.mktemp("run")
        (folder / "dead_end.scenario.yaml").write_text(SCENARIO)
        command = [str(Path(sys.executable).with_name("simscen")), "run", ".", "--out", "out"]
        environment = {**ENVIRONMENT, **variables}
        completed = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        assert completed.returncode == 0, completed.stdout + completed.stderr
        (log,) = folder.rglob("run.mcap")
        return hashlib.sha256(log.read_bytes()).hexdigest()

    return run


@pytest.mark.sample(1)
@needs_avx2
@pytest.mark.parametrize("core", ["Haswell", "Zen"])
def test_logs_of_processors_with_avx2_are_equal(digest: Callable[..., str], core: str) -> None:
    """The default kernels compute the log of Intel and AMD processors without AVX-512, on any processor with AVX2."""
    assert digest() == digest(**{**kernel_variables(), "OPENBLAS_CORETYPE": core})


@pytest.mark.slow
@needs_avx512
def test_logs_with_kernels_for_avx512_differ(digest: Callable[..., str]) -> None:
    """Without this difference, the equality of logs would prove nothing."""
    assert digest() != digest(OPENBLAS_CORETYPE="SkylakeX")


def test_a_launched_stack_gets_the_environment_of_the_caller() -> None:
    code = (
        "from simscen.core.cpu_kernels import kernel_variables, pin_kernels, pinned_variables\n"
        "pin_kernels()\n"
        "from simscen.cli.process import caller_environment\n"
        "print(set(pinned_variables()) == set(kernel_variables()), set(kernel_variables()) & set(caller_environment()))"
    )
    assert output_lines(code, ENVIRONMENT)[0] == "True set()"
