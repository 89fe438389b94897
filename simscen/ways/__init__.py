"""Ways over a grid and along points: what the truth about a world and the stack under test both search with."""
