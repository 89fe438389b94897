"""Map of the editor: its objects, its background, and the conversion of changes on the map to edits of the text."""
