"""An agent that was frozen does not obey what was said to it meanwhile."""

import os
import signal
import threading
from concurrent.futures import ThreadPoolExecutor

from live_cell import LiveCell, Recorder, ask, echo

from cell.messages import Mode, RobotState, Run

FROZEN_S = 0.3
"""Longer than what counts as a freeze; with the pause of keep-alives before it shorter than the lease of a link."""


def test_a_run_sent_to_a_frozen_agent_is_refused_as_old(live: LiveCell) -> None:
    live.up().wait_for_output("all robots enabled", 60.0)
    agent = live.pid_of("robot_agent", "left")
    with live.client() as session, ThreadPoolExecutor(1) as pool:
        states = Recorder(session, "robot/left/state")
        seen = states.wait_for(RobotState, lambda state: state.mode is Mode.READY, 10.0, "left ready")
        os.kill(agent, signal.SIGSTOP)
        try:
            answer = pool.submit(ask, session, "robot/left", Run(), echo(seen))
            threading.Event().wait(FROZEN_S)
        finally:
            os.kill(agent, signal.SIGCONT)
        reply = answer.result(10.0)
        assert not reply.ok
        assert "too old" in reply.text
        after = states.wait_for(RobotState, lambda state: state.sequence > seen.sequence, 10.0, "left after its freeze")
    assert after.mode is Mode.READY
