"""Generated documentation: `simscen explain`, reference pages, JSON Schemas."""
