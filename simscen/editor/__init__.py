"""The editor of scenario and world files: a local web page with the map and the text of a file side by side."""
