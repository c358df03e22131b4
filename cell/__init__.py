"""A multi-robot cell controller: what all processes share, the cell manager and the commands."""
