"""Reports of a session: console lines, JUnit, JSON, Parquet, pictures, and HTML pages."""
