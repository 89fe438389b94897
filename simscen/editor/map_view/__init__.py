"""The map of the editor: the objects of a file on it, its background, and edits of the text by changes on the map."""
