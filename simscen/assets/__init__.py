"""The files that worlds and robots are made of: one reader of XML, one way to find what they name, one fence."""
