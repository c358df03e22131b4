"""Curves for people: a page with SVG charts, or text for a terminal.

In go titles, numbers and marks; out comes HTML or lines of text. Nothing here knows what the curves are of.
"""
