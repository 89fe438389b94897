"""A process that imports the modules of the fork server once, and forks a fork server for each session of the tests.

The imports take longer than most runs of the tests. Tests that start `simscen` in a process of its own start the fork
server as users do.
"""

import os
import selectors
import socket
import subprocess
import sys
import traceback
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from simscen.cli.session.fork_server_start import FORK_SERVER
from simscen.run.process.isolation import clean_environment

MESSAGE_BYTES = 4096


class PreloadedForkServer:
    """Starts fork servers from a process that has imported their modules. The process starts when it is needed."""

    def __init__(self) -> None:
        self._is_started = False
        self._owner, self._environment = os.getpid(), clean_environment()
        self._requests, self._received_requests = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)

    def popen(self, arguments: Sequence[str], env: dict[str, str], **options: Any) -> "subprocess.Popen | Forked":
        """Start a program as `subprocess.Popen` would: the fork server in the usual environment, or a new process."""
        is_fork_server = tuple(arguments[1:-1]) == ("-I", *FORK_SERVER)
        if not is_fork_server or env != self._environment or os.getpid() != self._owner:
            return subprocess.Popen(arguments, env=env, **options)
        if not self._is_started:
            descriptor = self._received_requests.fileno()
            command, null = [sys.executable, "-I", __file__, str(descriptor)], subprocess.DEVNULL
            subprocess.run(command, env=env, pass_fds=[descriptor], stdin=null, stdout=null, check=True)
            self._received_requests.close()
            self._is_started = True
        return Forked(self._requests, options["stdin"], options["stdout"].fileno(), options["pass_fds"][0])

    def close(self) -> None:
        """Let the process exit."""
        self._requests.close()
        self._received_requests.close()


class Forked:
    """A fork server that another process has forked, with the methods of `subprocess.Popen` that simscen uses."""

    def __init__(self, requests: socket.socket, jobs: int, output: int, replies: int) -> None:
        self.returncode: int | None = None
        self._messages, sent = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with sent:
            socket.send_fds(requests, [str(Path.cwd()).encode()], [jobs, output, replies, sent.fileno()])
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
    """Fork a fork server for each request, and send its process id and its exit code, until no requests can come."""
    from simscen.cli.session import fork_server_main

    selector = selectors.DefaultSelector()
    selector.register(requests, selectors.EVENT_READ)
    while True:
        for key, _ in selector.select():
            if key.data is not None:
                pid, messages = key.data
                selector.unregister(key.fileobj)
                os.close(key.fd)
                with messages, suppress(BrokenPipeError):  # the session has ended
                    messages.send(str(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])).encode())
                continue
            folder, descriptors, _, _ = socket.recv_fds(requests, MESSAGE_BYTES, 4)
            if not folder:
                return
            *given, sent = descriptors
            messages = socket.socket(fileno=sent)
            if (pid := os.fork()) == 0:
                try:
                    selector.close()
                    requests.close()
                    become_fork_server(folder.decode(), *given, messages)
                    fork_server_main.main()
                except BaseException:
                    traceback.print_exc()
                os._exit(1)
            for descriptor in given:
                os.close(descriptor)
            selector.register(os.pidfd_open(pid), selectors.EVENT_READ, (pid, messages))


def become_fork_server(folder: str, jobs: int, output: int, replies: int, messages: socket.socket) -> None:
    """Use the folder and file descriptors of a request in this process, as a new process would."""
    os.setsid()
    for descriptor, target in ((jobs, 0), (output, 1), (output, 2)):
        os.dup2(descriptor, target)
    os.close(jobs)
    os.close(output)
    os.chdir(folder)
    sys.argv = ["fork server", str(replies)]
    messages.send(str(os.getpid()).encode())
    messages.close()


if __name__ == "__main__":
    if os.fork() == 0:  # not a child of the tests, which look for their own children
        os.setsid()
        serve(socket.socket(fileno=int(sys.argv[1])))
    os._exit(0)
