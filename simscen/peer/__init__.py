"""Client of the stack protocol, for a navigation stack that runs in its own process.

The client needs only the standard library of Python 3.8 or later. A minimal stack:

    from simscen.peer import Peer

    peer = Peer("my stack", "1.0", topics=["/scan", "/odom"])
    for step in peer:
        goal = peer.goals.accept()
        scan = step.get("/scan")
        ...
        step.drive(0.2, 0.0)

If simscen is not installed in the stack's environment, use `sys.path.append(os.environ["SIMSCEN_PEER_PATH"])` and
`import simscen_peer` instead; simscen sets this variable. docs/reference/stack-protocol.md defines the protocol.
"""

from .client import Message, Peer, Step
from .goals import Goal, Goals
from .wire import Connection, Disconnected, Refused

__all__ = ["Connection", "Disconnected", "Goal", "Goals", "Message", "Peer", "Refused", "Step"]
