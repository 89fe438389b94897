"""Documentation that is generated from the models: `simscen explain`, reference pages, and JSON Schemas."""
