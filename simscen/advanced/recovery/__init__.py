"""Recovery behaviors beyond Nav2."""
