"""A process that imports the modules of the fork server once, and forks a fork server for each session of the tests.

The imports take longer than most runs of the tests. This does not affect tests that start `simscen` in a process of its
own, and fork servers that start with `python -c`.
"""

import json
import os
import runpy
import selectors
import socket
import subprocess
import sys
import traceback
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from simscen.run.process.isolation import clean_environment

MESSAGE_BYTES = 4096


class PreloadedForkServer:
    """Starts fork servers from a process that has imported their modules. The process starts when it is needed."""

    def __init__(self) -> None:
        self._is_started = False
        self._owner, self._environment = os.getpid(), clean_environment()
        self._requests, self._received_requests = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)

    def popen(self, arguments: Sequence[str], env: dict[str, str], **options: Any) -> "subprocess.Popen | Forked":
        """Start a fork server as `subprocess.Popen` would. Other environments than usual get a process of their own."""
        _, isolated, *entry, replies = arguments
        is_python_file = isolated == "-I" and (entry[0] == "-m" or entry[0].endswith(".py"))
        if not is_python_file or env != self._environment or os.getpid() != self._owner:
            return subprocess.Popen(arguments, env=env, **options)
        if not self._is_started:
            descriptor = self._received_requests.fileno()
            command, null = [sys.executable, "-I", __file__, str(descriptor)], subprocess.DEVNULL
            subprocess.run(command, env=env, pass_fds=[descriptor], stdin=null, stdout=null, check=True)
            self._received_requests.close()
            self._is_started = True
        request = json.dumps([str(Path.cwd()), entry])
        return Forked(self._requests, request, options["stdin"], options["stdout"].fileno(), int(replies))

    def close(self) -> None:
        """Let the process exit."""
        self._requests.close()
        self._received_requests.close()


class Forked:
    """A fork server that another process has forked, with the methods of `subprocess.Popen` that simscen uses."""

    def __init__(self, requests: socket.socket, request: str, jobs: int, output: int, replies: int) -> None:
        self.returncode: int | None = None
        self._messages, sent = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with sent:
            socket.send_fds(requests, [request.encode()], [jobs, output, replies, sent.fileno()])
        self.pid = int(self._messages.recv(MESSAGE_BYTES))

    def wait(self, timeout: float | None = None) -> int:
        """Return the exit code. Raises TimeoutExpired after `timeout` seconds."""
        if self.returncode is None:
            self._messages.settimeout(timeout or (None if timeout is None else 1e-6))
            try:
                self.returncode = int(self._messages.recv(MESSAGE_BYTES))
            except TimeoutError:
                raise subprocess.TimeoutExpired("fork server", timeout or 0.0) from None
            self._messages.close()
        return self.returncode

    def send_signal(self, number: int) -> None:
        """Send a signal, if the process still runs."""
        if self.returncode is None:
            os.kill(self.pid, number)


def serve(requests: socket.socket) -> None:
    """Fork a fork server for each request, and send its process id and its exit code, until no requests can come.

    As with `subprocess.Popen`, an ended process can be sent signals until `wait` has returned its exit code.
    """
    import simscen.cli.session.fork_server_main  # noqa: F401 - for the forks

    selector = selectors.DefaultSelector()
    selector.register(requests, selectors.EVENT_READ)
    while True:
        for key, _ in selector.select():
            if key.data is not None:
                selector.unregister(key.fileobj)
                os.close(key.fd)
                pid, messages = key.data
                if messages is None:  # `wait` has closed its end of the socket
                    os.waitpid(pid, 0)
                    continue
                ended = os.waitid(os.P_PID, pid, os.WEXITED | os.WNOWAIT)
                code = ended.si_status if ended.si_code == os.CLD_EXITED else -ended.si_status
                with suppress(BrokenPipeError):  # the session has ended
                    messages.send(str(code).encode())
                selector.register(messages.detach(), selectors.EVENT_READ, (pid, None))
                continue
            request, descriptors, _, _ = socket.recv_fds(requests, MESSAGE_BYTES, 4)
            if not request:
                return
            *given, sent = descriptors
            messages = socket.socket(fileno=sent)
            if (pid := os.fork()) == 0:
                try:
                    selector.close()
                    requests.close()
                    run_fork_server(*json.loads(request), *given, messages)
                except BaseException:
                    traceback.print_exc()
                os._exit(1)
            for descriptor in given:
                os.close(descriptor)
            selector.register(os.pidfd_open(pid), selectors.EVENT_READ, (pid, messages))


def run_fork_server(
    folder: str, entry: list[str], jobs: int, output: int, replies: int, messages: socket.socket
) -> None:
    """Run a fork server in this process: in a folder, from a module or script, with the given file descriptors."""
    os.setsid()
    for descriptor, target in ((jobs, 0), (output, 1), (output, 2)):
        os.dup2(descriptor, target)
    os.close(jobs)
    os.close(output)
    os.chdir(folder)
    sys.argv = ["fork server", str(replies)]
    messages.send(str(os.getpid()).encode())
    messages.close()
    if entry[0] == "-m":
        del sys.modules[entry[1]]  # it is only executed as `__main__`
        runpy.run_module(entry[1], run_name="__main__", alter_sys=True)
    else:
        runpy.run_path(entry[0], run_name="__main__")


if __name__ == "__main__":
    if os.fork() == 0:  # not a child of the tests, which look for their own children
        os.setsid()
        serve(socket.socket(fileno=int(sys.argv[1])))
    os._exit(0)
