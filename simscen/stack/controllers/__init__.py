"""Controllers: velocity commands that follow a path, as in Nav2's controller server."""
