"""Editor of scenario and world files, `simscen edit`: a local web page with the map and the text of a file."""
