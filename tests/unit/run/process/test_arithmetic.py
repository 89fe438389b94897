"""Workers and callers use the same CPU kernels, and processors with AVX2 compute the same last bits."""

import hashlib
import os
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest

from simscen.core.cpu_kernels import CPUINFO, kernel_variables

SHOWN = "from simscen.run.platform_fingerprint import arithmetic_fingerprints; print(arithmetic_fingerprints())"
PINNED = f"from simscen.core.cpu_kernels import pin_kernels; pin_kernels(); {SHOWN}"
BOTH = f"""
import subprocess, sys
from simscen.run.process.isolation import clean_environment
{PINNED}
print(subprocess.run([sys.executable, "-c", {SHOWN!r}], env=clean_environment(), capture_output=True, text=True).stdout)
"""
CHOSEN = {
    "OPENBLAS_CORETYPE": "Prescott",
    "NPY_DISABLE_CPU_FEATURES": "AVX2",
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-FMA",
}
"""A user's own choice of instructions."""
NONE_CHOSEN = {name: value for name, value in os.environ.items() if name not in CHOSEN}
FLAGS = set(CPUINFO.read_text().split()) if CPUINFO.exists() else set()
needs_avx2 = pytest.mark.skipif(not {"avx2", "fma"} <= FLAGS, reason="the processor has no AVX2")
needs_avx512 = pytest.mark.skipif("avx512f" not in FLAGS, reason="the processor has no AVX-512")

DEAD_END = Path(__file__).parents[4] / "scenarios" / "corner_cases" / "dead_end.scenario.yaml"
SCENARIO = DEAD_END.read_text().partition("pass:\n")[0] + "time_limit: 15 s\npass: [{collisions: {max: 0}}]\n"
"""Its logs differ between kernels within some seconds."""


def printed(code: str, environment: dict[str, str]) -> list[str]:
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.split("\n")


@pytest.mark.sample(1)
@pytest.mark.parametrize("chosen", [{}, CHOSEN], ids=["default", "the user's choice"])
def test_a_worker_has_the_fingerprint_of_its_caller(chosen: dict[str, str]) -> None:
    caller, worker, *_ = printed(BOTH, {**NONE_CHOSEN, **chosen, "SECRET": "x"})
    assert caller == worker != ""


def test_kernel_variables_of_the_user_change_the_fingerprint() -> None:
    assert printed(PINNED, {**NONE_CHOSEN, **CHOSEN}) != printed(PINNED, NONE_CHOSEN)


@pytest.mark.sample(1)
@needs_avx512
@pytest.mark.parametrize("chosen", [{"OPENBLAS_CORETYPE": "SkylakeX"}, {"NPY_DISABLE_CPU_FEATURES": ""}])
def test_kernels_for_avx512_have_another_fingerprint(chosen: dict[str, str]) -> None:
    """Otherwise the fingerprint would not show why two logs differ."""
    assert printed(PINNED, {**NONE_CHOSEN, **chosen}) != printed(PINNED, NONE_CHOSEN)


@pytest.fixture(scope="module")
def digest(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., str]:
    """Return a function that returns the digest of the scenario's log, with some variables set."""

    @cache
    def run(**variables: str) -> str:
        folder = tmp_path_factory.mktemp("run")
        (folder / "dead_end.scenario.yaml").write_text(SCENARIO)
        command = [str(Path(sys.executable).with_name("simscen")), "run", ".", "--out", "out"]
        environment = {**NONE_CHOSEN, **variables}
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr
        (log,) = folder.rglob("run.mcap")
        return hashlib.sha256(log.read_bytes()).hexdigest()

    return run


@pytest.mark.sample(1)
@needs_avx2
@pytest.mark.parametrize("core", ["Haswell", "Zen"])
def test_logs_of_processors_with_avx2_are_equal(digest: Callable[..., str], core: str) -> None:
    """The default equals what Intel's and AMD's processors without AVX-512 compute, also if this one has AVX-512."""
    assert digest() == digest(**{**kernel_variables(), "OPENBLAS_CORETYPE": core})


@pytest.mark.slow
@needs_avx512
def test_logs_with_kernels_for_avx512_differ(digest: Callable[..., str]) -> None:
    """This shows that the scenario above depends on the kernels."""
    assert digest() != digest(OPENBLAS_CORETYPE="SkylakeX")


def test_a_launched_stack_gets_the_environment_of_the_caller() -> None:
    code = (
        "from simscen.core.cpu_kernels import kernel_variables, pin_kernels, pinned_variables\n"
        "pin_kernels()\n"
        "from simscen.cli.process import caller_environment\n"
        "print(set(pinned_variables()) == set(kernel_variables()), set(kernel_variables()) & set(caller_environment()))"
    )
    assert printed(code, NONE_CHOSEN)[0] == "True set()"
