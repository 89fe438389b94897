"""Robot bodies: geometry, mass, wheels and casters. Needs no physics engine."""
