"""The cell as people see it in a browser: a model of what is shown, made from messages, and the page that shows it.

In go the settings of a cell and its messages with their times, from a `Source`: a running cell, or a recording of one.
Out come bodies, lines and words, and what an operator has asked for, through `Desk`. It must not know how a process
works inside, nor how an order travels; `viser` is imported by the modules below `page` alone, which are imported when a
page is asked for.
"""
