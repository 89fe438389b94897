"""Reports of sessions and runs: console output, JUnit, JSON, Parquet, pictures, and HTML pages."""
