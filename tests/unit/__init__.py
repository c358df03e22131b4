"""Tests of parts. The folders are those of the code; `across/` is for several packages together, `project/` for the
repository itself: documents, layers, `make`. The files beside this one are helpers, imported as `tests.unit.<name>`."""
