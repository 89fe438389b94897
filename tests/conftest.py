"""Settings of all tests, and fixtures that install plugin packages."""

import gc
import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import settings

from simscen.core.cpu_kernels import pin_kernels

pin_kernels()  # before NumPy is imported, so that runs in this process are the same as on the command line
Install = Callable[..., Path]
QUICK_EXAMPLES = 25
"""Examples of each property in `make test`; `make test-all` tries 100."""

# Tests that run in the background ignore Ctrl-C, and every program that they start would inherit that.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


# Tests neither write to the user's cache nor find results in it.
os.environ["SIMSCEN_CACHE_DIR"] = "off"

# A deadline for each example depends on how busy the machine is.
settings.register_profile("simscen", parent=settings.default, deadline=None)
settings.register_profile("quick", parent=settings.get_profile("simscen"), max_examples=QUICK_EXAMPLES)
settings.load_profile("simscen")

# Workers write the test modules that pytest rewrites to __pycache__, so that the next start need not rewrite them.
sys.dont_write_bytecode = False
# Modules and tests live until the end: collecting garbage while they are made finds nothing.
gc.disable()

LONG = ("tests/scenarios/test_shipped.py", "tests/ros/", "tests/conformance/")
"""Tests that start first because they take longest, so that the other workers do not wait for them at the end."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int | None:
    """Return one worker more than there are usable cores, because tests that wait for a process leave a core idle."""
    return None if "PYTEST_XDIST_AUTO_NUM_WORKERS" in os.environ else len(os.sched_getaffinity(0)) + 1


def pytest_configure(config: pytest.Config) -> None:
    """Try fewer examples of properties where the slow tests are skipped."""
    if config.option.markexpr == "not slow" and settings.get_current_profile_name() == "simscen":
        settings.load_profile("quick")


def pytest_collection_finish() -> None:
    """Collect garbage again, but do not scan the modules and tests each time."""
    gc.freeze()
    gc.enable()


def pytest_sessionfinish() -> None:
    """Let the garbage collector see everything at exit, as libraries report what it does not free as leaks."""
    gc.unfreeze()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the parameter sets that `sample(n)` leaves out as slow, and sort the longest tests first."""
    for tests in _by_function(items).values():
        marker = tests[0].get_closest_marker("sample")
        if marker is not None:
            kept = {index * len(tests) // marker.args[0] for index in range(marker.args[0])}
            for index, item in enumerate(tests):
                if index not in kept:
                    item.add_marker(pytest.mark.slow)
    root = Path(__file__).parents[1]

    def rank(item: pytest.Item) -> int:
        path = item.path.relative_to(root).as_posix()
        return next((k for k, start in enumerate(LONG) if path.startswith(start)), len(LONG))

    items.sort(key=rank)


def _by_function(items: list[pytest.Item]) -> dict[str, list[pytest.Item]]:
    functions: dict[str, list[pytest.Item]] = {}
    for item in items:
        functions.setdefault(item.nodeid.partition("[")[0], []).append(item)
    return functions


def install(site: Path, name: str, version: str, points: Mapping[str, Mapping[str, str]], **modules: str) -> Path:
    """Install modules and a dist-info into the folder `site`; `points` are entry points by kind, then by name."""
    site.mkdir(parents=True, exist_ok=True)
    info = site / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    groups = [
        f"[simscen.{kind}]\n" + "".join(f"{key} = {value}\n" for key, value in those.items())
        for kind, those in points.items()
    ]
    (info / "entry_points.txt").write_text("\n".join(groups))
    for module, text in modules.items():
        (site / f"{module}.py").write_text(text)
    return site


def install_folder(folder: Path, site: Path) -> Path:
    """Install a package from its folder, as `pip install --target` would: its modules, and what pyproject.toml says."""
    text = (folder / "pyproject.toml").read_text()
    name, version = (re.findall(rf'^{key} = "(.*)"$', text, re.MULTILINE)[0] for key in ("name", "version"))
    points = {
        kind: dict(re.findall(r'^(\w+) = "(.*)"$', rows, re.MULTILINE))
        for kind, rows in re.findall(r'^\[project.entry-points."simscen.(\w+)"\]\n((?:.+\n)*)', text, re.MULTILINE)
    }
    install(site, name, version, points)
    module = name.replace("-", "_")
    shutil.copytree(folder / module, site / module, ignore=shutil.ignore_patterns("__pycache__"))
    return site


def clear_package_caches() -> None:
    """Clear the caches of installed packages."""
    from simscen.loading.schema import common_mistakes
    from simscen.spec import choice, registry

    cached = (registry._all_installed_types, registry._load, choice.with_installed_choices)
    for known in (*cached, common_mistakes._mappings_below):
        known.cache_clear()


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Return `packages(name, version, points, module="…")`, which installs a package for this test."""
    site, before = tmp_path / "site", set(sys.modules)
    site.mkdir()
    monkeypatch.syspath_prepend(str(site))
    clear_package_caches()

    def add(name: str, version: str, points: Mapping[str, Mapping[str, str]], **modules: str) -> Path:
        clear_package_caches()
        return install(site, name, version, points, **modules)

    add.site, add.install = site, install  # type: ignore[attr-defined]
    yield add
    for module in set(sys.modules) - before:
        if str(getattr(sys.modules[module], "__file__", "")).startswith(str(site)):
            del sys.modules[module]
    clear_package_caches()


@pytest.fixture(scope="session", autouse=True)
def preloaded_fork_server() -> Iterator[None]:
    """Fork the fork servers of sessions in this process from one process that has imported their modules."""
    from simscen.run.process import fork_server_process
    from tests.preloaded_fork_server import PreloadedForkServer

    server = PreloadedForkServer()
    with pytest.MonkeyPatch.context() as patch, closing(server):
        stand_in = SimpleNamespace(Popen=server.popen, TimeoutExpired=subprocess.TimeoutExpired)
        patch.setattr(fork_server_process, "subprocess", stand_in)
        yield


@pytest.fixture(scope="session")
def is_quick(request: pytest.FixtureRequest) -> bool:
    """Whether the slow tests are skipped, as by `make test`: statistical tests then draw fewer samples."""
    return request.config.option.markexpr == "not slow"


@pytest.fixture
def yardwork(packages: Install) -> Path:
    """Install the package tests/plugins/yardwork for this test; return its folder."""
    return install_folder(Path(__file__).parent / "plugins" / "yardwork", packages.site)  # type: ignore[attr-defined]


@pytest.fixture(scope="session", name="install_folder")
def install_folder_fixture() -> Callable[[Path, Path], Path]:
    """Return `install_folder(folder, site)`, for tests that start commands."""
    return install_folder


@pytest.fixture(name="install")
def install_fixture() -> Install:
    """Return `install(site, name, version, points, module="…")`, for tests that start commands."""
    return install
