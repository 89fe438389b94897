"""What is well-formed and means nothing: found in the text, without building a world."""
