"""One contract for each role: its promises, tried on a component as if by a stranger."""
