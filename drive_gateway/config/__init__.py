"""The file that describes a bus and its drives."""
