"""A gateway dies: its robot's drives stop by themselves, the others work on, and an operator brings it back."""

import signal

import can
import pytest
from live_cell import LiveCell, Recorder, wait_until
from shared_bus import SHARED_BUSES, move_left_bus_to

from cell.messages import GatewayState, Mode, RobotState
from drive_gateway.config import load_drives

EMCY = range(0x081, 0x100)
HEARTBEAT_ERROR = 0x8130


class Emergencies(can.Listener):
    """The emergency codes that are heard on a bus, by Node-ID."""

    def __init__(self) -> None:
        self.codes: dict[int, set[int]] = {}

    def on_message_received(self, msg: can.Message) -> None:
        if msg.arbitration_id in EMCY and len(msg.data) == 8:
            self.codes.setdefault(msg.arbitration_id - 0x080, set()).add(int.from_bytes(msg.data[:2], "little"))


@pytest.mark.parametrize("shared_bus", SHARED_BUSES)
def test_its_drives_stop_by_themselves_and_the_robot_comes_back_by_an_operators_word(
    live: LiveCell, shared_bus: str
) -> None:
    move_left_bus_to(shared_bus, live)
    live.file.write_text(f"{live.file.read_text()}separation: off\n")  # the right arm does not run
    bus = load_drives(live.file.parent / "left_drives.yaml", "left_bus").bus
    live.manager()
    drives = live.start("drive-gateway", "simulate", str(live.file), "left_bus", "--state-dir", str(live.state_dir))
    words = ("run", str(live.file), "left_bus", "--state-dir", str(live.state_dir))
    gateway = live.start("drive-gateway", *words)
    agent = live.agent("left")
    emergencies = Emergencies()
    with (
        can.Bus(interface=bus.interface, channel=bus.channel, bitrate=bus.bitrate, **bus.options) as listener,
        live.client() as session,
    ):
        notifier = can.Notifier(listener, [emergencies])
        states, gateways = Recorder(session, "robot/left/state"), Recorder(session, "gateway/left_bus/state")
        states.wait_for(RobotState, lambda state: state.mode is Mode.DISABLED, 60.0, "left claimed")
        live.obeyed("enable", "left")
        live.obeyed("run", "left")
        states.wait_for(RobotState, lambda state: (state.tcp_speed_m_s or 0.0) > 0.3, 30.0, "left moves")
        gateway.signal(signal.SIGKILL)
        fault = states.wait_for(RobotState, lambda state: state.mode is Mode.FAULT, 10.0, "left in fault")
        assert "no drive feedback" in fault.alarms[0]
        assert fault.tcp_speed_m_s is None
        wait_until(
            lambda: (
                [node for node, codes in sorted(emergencies.codes.items()) if HEARTBEAT_ERROR in codes]
                == [1, 2, 3, 4, 5, 6]
            ),
            10.0,
            "every drive misses its master",
        )
        notifier.stop()
        gateways.take()
        live.start("drive-gateway", *words)
        gateways.wait_for(GatewayState, lambda state: state.ready, 30.0, "the new gateway")
        # Its axes are not where they were when they were last switched off: nobody knows where the robot is.
        states.take()
        states.wait_for(RobotState, lambda state: state.tcp_position_m is None, 10.0, "left without a position")
        live.obeyed("accept", "left")
        states.wait_for(RobotState, lambda state: state.tcp_position_m is not None, 10.0, "left measured again")
        live.obeyed("reset", "left")
        states.wait_for(RobotState, lambda state: state.mode is Mode.DISABLED, 10.0, "left disabled")
        live.obeyed("enable", "left")
        states.wait_for(RobotState, lambda state: state.mode is Mode.READY, 10.0, "left ready")
    for process in (agent, drives):
        process.signal(signal.SIGINT)
        assert process.wait(20.0) == 0, process.output


def test_a_run_until_done_ends_in_order_when_a_gateway_and_an_agent_die(live: LiveCell) -> None:
    up = live.up("--until-done")
    up.wait_for_output("all robots enabled", 60.0)
    with live.client() as session:
        states = Recorder(session, "robot/left/state")
        states.wait_for(RobotState, lambda state: (state.tcp_speed_m_s or 0.0) > 0.3, 30.0, "left moves")
        gateway, agent = live.pid_of("drive_gateway", "left_bus"), live.pid_of("robot_agent", "right")
        live.kill(gateway)
        live.kill(agent)
    assert up.wait(40.0) == 1
    assert "gateway left_bus was killed by signal 9" in up.output
    assert "robot right was killed by signal 9" in up.output
    assert "start it again with: " in up.output
    assert "did not end within" not in up.output
