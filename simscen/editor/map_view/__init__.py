"""What the map of the editor shows of a file, and what a change on the map means for its text."""
