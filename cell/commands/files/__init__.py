"""The subcommands that look at files alone: `cell check`, `model`, `schema`, `format`, `import` and `plot`.

In go the files of a cell, a robot or a program; out come problems, numbers, schemas and curves. They know of no running
cell and open no session.
"""
