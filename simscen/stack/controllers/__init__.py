"""Controllers, which compute velocity commands that follow a path: RPP, DWB, and MPPI."""
