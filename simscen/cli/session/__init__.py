"""Sessions of `simscen run`, `study`, `falsify`, and `shrink`, and the evaluation of recorded logs."""
