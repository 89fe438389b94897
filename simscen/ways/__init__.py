"""Ways over a grid: what the truth about a world and the stack under test both search with."""
