"""Contract of each plug-in role: the promises of its protocol, as checks of a component."""
