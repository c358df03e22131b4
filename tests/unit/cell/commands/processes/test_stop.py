"""A process ends by a signal or with its parent."""

import os
import signal
import threading
from collections.abc import Iterator

import pytest

from cell.commands.processes.stop import stop_event


@pytest.fixture(autouse=True)
def _handlers() -> Iterator[None]:
    """As a process begins that nobody started with nohup."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_asks_to_stop(number: signal.Signals) -> None:
    stop = stop_event()
    signal.raise_signal(number)
    assert stop.is_set()


def test_a_second_signal_asks_to_hurry() -> None:
    hurry = threading.Event()
    stop_event(hurry=hurry)
    signal.raise_signal(signal.SIGINT)
    assert not hurry.is_set()
    signal.raise_signal(signal.SIGINT)
    assert hurry.is_set()


def test_the_end_of_the_parent_asks_to_stop() -> None:
    ours, parents = os.pipe()
    stop = stop_event(parent_pipe=ours)
    assert not stop.is_set()
    os.close(parents)
    assert stop.wait(timeout=5.0)
    os.close(ours)


def test_a_hang_up_that_is_ignored_stays_ignored() -> None:
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    stop = stop_event()
    signal.raise_signal(signal.SIGHUP)
    assert not stop.is_set()
