"""The gateway as it runs: its own thread, a python-can bus, simulated drives and Zenoh."""

from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from cell.messages import Claim, EnableDrives, Fault, FaultDrive, ReadObject, RecordBus
from drive_gateway.config.settings import BusSettings, TemperatureSettings
from drive_gateway.gateway.bus.opening import BusError, open_bus
from tests.unit.gateway_thread import running_gateway
from tests.unit.gateway_world import axis, block, gateway_settings, s_motion


@pytest.mark.parametrize(
    ("interface", "channel", "found"),
    [("no_such_bus", "x", "allowed are"), ("socketcan", "no_such_can9", "ip -details link show no_such_can9")],
)
def test_a_bus_that_is_not_there_says_what_to_do(interface: str, channel: str, found: str) -> None:
    with pytest.raises(BusError, match=found) as caught:
        open_bus(BusSettings(interface, channel, 500_000, {}))
    assert f"{interface}:{channel}" in str(caught.value)


def test_the_eds_that_a_node_keeps_and_a_fault_on_command_go_over_bus_and_zenoh() -> None:
    with running_gateway() as (client, _stop, _codes):
        client.until(lambda: client.state is not None and client.state.ready)
        reply = client.ask(ReadObject(1, 0x1021, 0))
        assert client.ask(FaultDrive(2, 1, Fault.EMERGENCY, 0x5112)).ok
        client.until(lambda: [node.emergency_code for node in client.state.nodes] == [None, 0x5112])
    assert reply.ok, reply.text
    assert bytes.fromhex(reply.data) == (files("drive_gateway.sim") / "cia402_drive.eds").read_bytes()


def test_what_is_read_beside_the_dialogues_comes_over_the_bus_while_an_operator_reads_too() -> None:
    """2003h of a simulated drive is the temperature of its motor in tenths of a degree."""
    shown = TemperatureSettings((0x2003, 0), 2, True, 0.1)
    settings = gateway_settings((axis("J1", 1, temperature=shown), axis("J2", 2)))
    with running_gateway(settings) as (client, _stop, _codes):
        client.until(lambda: client.state is not None and client.state.ready)
        for _ in range(20):
            reply = client.ask(ReadObject(1, 0x6041, 0))
            assert reply.ok, reply.text
        client.until(lambda: client.state.nodes[0].temperature_c is not None)
        assert [node.temperature_c for node in client.state.nodes] == [20.0, None]
        assert client.ask(FaultDrive(1, 1, Fault.HOT_MOTOR)).ok
        client.until(lambda: client.state.nodes[0].temperature_c == 141.0)


def test_a_block_sent_over_zenoh_moves_a_simulated_drive_and_a_stop_switches_it_off() -> None:
    with running_gateway() as (client, stop, codes):
        client.until(lambda: client.state is not None and client.state.ready)
        claim = client.ask(Claim("left", "a1", "d")).claim
        assert claim is not None
        enabled = client.ask(EnableDrives("left", claim.owner))
        assert enabled.ok, enabled.text
        client.until(lambda: client.feedback is not None and client.feedback.enabled)
        start = client.feedback.commanded
        position, velocity = s_motion(0.5, 0.1)
        client.session.publish(block(claim.owner, 1, client.feedback.tick + 25, start + position, velocity))
        client.until(lambda: bool(np.all(np.abs(client.feedback.position - start - 0.1) < 1e-3)))
        stop.set()
        client.until(lambda: bool(codes))
        assert codes == [0]


def test_a_recording_is_a_file_in_the_state_folder_wherever_its_name_leads(tmp_path: Path) -> None:
    (tmp_path / "kept.log").write_text("not to be lost")
    with running_gateway(state_folder=tmp_path / "state") as (client, _stop, _codes):
        for name in ("../kept.log", "../../kept.log", str(tmp_path / "kept.log"), "x/y.log", "..", ".log", ""):
            refused = client.ask(RecordBus(name, 0.1))
            assert not refused.ok
            assert "is no name for a recording: allowed are names of files without a folder" in refused.text
        reply = client.ask(RecordBus("bus.log", 0.1))
    assert reply.ok, reply.text
    assert str(tmp_path / "state" / "recordings" / "bus.log") in reply.text
    assert (tmp_path / "state" / "recordings" / "bus.log").exists()
    assert (tmp_path / "kept.log").read_text() == "not to be lost"


def test_a_gateway_without_a_state_folder_records_nothing() -> None:
    with running_gateway() as (client, _stop, _codes):
        assert "without a state folder" in client.ask(RecordBus("bus.log", 0.1)).text
