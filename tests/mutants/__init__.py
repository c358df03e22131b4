"""Faults planted in the product on purpose: does the simulation of the whole cell find them?

`python -m tests.mutants` plants each in a copy of the tree and searches it by seeds (`tests.sim.search`). A suite that
finds no planted fault proves nothing about a tree in which it finds none.
"""
