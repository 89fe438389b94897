"""Editor of scenario and world files, `simscen edit`: a local web page that shows a file as text and on a map."""
