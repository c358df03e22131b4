"""The calls of a gateway: judged, carried out, and answered once each, however often they are asked.

In go requests of agents and operators; out go their replies. What an order does is the business of the robot or node
that it is for: here is only whose turn it is, and how the answer gets back.
"""
