"""`cell up`: all processes of a cell on this host, started, shown and ended in order.

In go the settings of a checked cell; out come child processes, their orders to begin, and a live table. It sees the
processes only from outside: by their messages, their output and their end.
"""
