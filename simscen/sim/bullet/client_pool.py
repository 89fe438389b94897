"""Clients of PyBullet with nothing in them but the ground: made once for all forks of a process, or used again.

To make one takes 20 ms, for it touches 37 MB; to empty one and lay its ground anew takes 3.
"""

import pybullet

from simscen.sim.bullet import engine

MAX_FREE_CLIENTS = 2
"""Clients that a run of one robot on even ground has."""


class ClientPool:
    """Hands out clients and takes them back."""

    def __init__(self) -> None:
        self._free: list[int] = []
        self._once = False

    def make_ahead(self) -> None:
        """Make now what a run asks for, in a process whose forks have one run each."""
        self._once = True
        while len(self._free) < MAX_FREE_CLIENTS:
            self._free.append(_grounded(_connected()))

    def take(self) -> int:
        """Return a client that contains only the plane z = 0; its parameters are undefined."""
        return self._free.pop() if self._free else _grounded(_connected())

    def give_back(self, client: int) -> None:
        """Nobody uses it any more. Of what was in it nothing is left: its world and solver are made anew."""
        if self._once or len(self._free) == MAX_FREE_CLIENTS:
            pybullet.disconnect(client)
        else:
            pybullet.resetSimulation(physicsClientId=client)
            self._free.append(_grounded(client))


CLIENT_POOL = ClientPool()
"""Those of this process."""


def _connected() -> int:
    client: int = pybullet.connect(pybullet.DIRECT)
    if client < 0:
        raise RuntimeError("PyBullet has no free client left")
    return client


def _grounded(client: int) -> int:
    ground = engine.create_ground_plane(client, engine.invisible_shape(client))
    engine.set_collision_filter(client, ground, -1, engine.GROUND, engine.EVERYTHING)
    return client
