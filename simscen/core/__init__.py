"""The words every other part of simscen speaks: plain data, no pydantic, no files, no engine."""
