"""Keeps robots apart: who has which space, and what more is cleared.

In go what agents report of their robots' ways, out come clearances. It knows pieces of space and who may use them; it
knows neither kinematics nor programs, nor how reports and clearances travel.
"""
