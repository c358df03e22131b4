"""Operators: their calls, judged and answered, and the jog key that they hold.

In go calls with the mode and the situation in which they are judged; out come the mode that follows, an answer in
words, and orders to program, pace and jog. Which call is allowed in which mode stands in `decisions`.
"""
