"""Tests of the fork server that `simscen run` starts before it imports the modules of a session."""

import os

import pytest

from simscen.cli.session import fork_server_start
from simscen.cli.session.fork_server_start import early_fork_server


def has_child():
    try:
        return os.waitid(os.P_ALL, 0, os.WEXITED | os.WNOHANG | os.WNOWAIT) is None
    except ChildProcessError:
        return False


def test_fork_server_is_killed_if_the_session_does_not_begin(monkeypatch):
    """The server is killed at once, although it does not read from its pipe yet."""
    monkeypatch.setattr(fork_server_start, "FORK_SERVER", ("-c", "import time; time.sleep(600)"))
    with pytest.raises(ZeroDivisionError), early_fork_server(is_needed=True):
        assert has_child()
        1 / 0  # noqa: B018
    assert not has_child()


def test_no_fork_server_is_started_if_none_is_needed():
    with early_fork_server(is_needed=False) as server:
        assert server is None
        assert not has_child()
