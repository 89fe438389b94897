"""Pool of PyBullet clients that contain only the ground plane. Creating a client takes longer than resetting one."""

from simscen.sim.bullet import engine, pybullet

MAX_FREE_CLIENTS = 2
"""Largest number of clients in the pool. A run with one robot on flat ground uses two clients."""


class ClientPool:
    """Pool of clients for one process."""

    def __init__(self) -> None:
        self._free: list[int] = []
        self._is_single_use = False

    def create_in_advance(self) -> None:
        """Fill the pool in a process that forks for each run. From then on, released clients are disconnected."""
        self._is_single_use = True
        while len(self._free) < MAX_FREE_CLIENTS:
            self._free.append(_new_client())

    def take(self) -> int:
        """Return a client that contains only the plane z = 0, without physics parameters."""
        return self._free.pop() if self._free else _new_client()

    def release(self, client: int) -> None:
        """Reset a client and put it back into the pool, or disconnect it."""
        if self._is_single_use or len(self._free) == MAX_FREE_CLIENTS:
            pybullet.disconnect(client)
        else:
            pybullet.resetSimulation(physicsClientId=client)
            self._free.append(_add_ground(client))


CLIENT_POOL = ClientPool()
"""Client pool of this process."""


def _new_client() -> int:
    client: int = pybullet.connect(pybullet.DIRECT)
    if client < 0:
        raise RuntimeError("PyBullet has no free client left")
    return _add_ground(client)


def _add_ground(client: int) -> int:
    ground = engine.create_ground_plane(client, engine.create_invisible_shape(client))
    pybullet.setCollisionFilterGroupMask(ground, -1, engine.GROUND, engine.EVERYTHING, physicsClientId=client)
    return client
