"""The subcommands with which an operator watches a running cell and gives it orders.

In go words of the command line; out go calls to manager, agents and gateways, and their answers as text. An order is
judged by the process that gets it: here nothing decides whether a robot may move.
"""
