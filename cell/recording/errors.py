"""What goes wrong with a recording."""


class RecordingError(Exception):
    """A recording that cannot be written or read; the text says which, why, and what to do."""
