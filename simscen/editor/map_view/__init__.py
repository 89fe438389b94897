"""Map of the editor: objects, background, and edits of the text by changes on the map."""
