"""The path of `cell estop`: a stop that is asked for goes out, whatever else is broken.

In goes a command line, out go emergency stops on every door of the cell, and only then words for people. Until the
first stop is out nothing here imports more than Zenoh and the standard library, and nothing raises because of a text,
a user, a terminal or a file. It knows neither the schema of the cell file nor the message classes: a test holds its
bytes against `cell.net.codec`.
"""
