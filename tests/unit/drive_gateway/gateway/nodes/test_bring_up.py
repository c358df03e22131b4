"""The way of one node to Operational, where frames cross."""

from drive_gateway.canopen.sdo import SdoChannel, SdoDone
from drive_gateway.gateway.nodes.bring_up import BringUp, Phase
from drive_gateway.gateway.nodes.program import drive_program
from drive_gateway.gateway.playout.outputs import Outputs
from drive_gateway.gateway.reference.reference import Reference
from tests.unit.gateway_world import axis, gateway_settings


def test_a_boot_up_while_a_node_is_configured_begins_its_configuration_anew_without_a_complaint() -> None:
    settings = axis("J1", 1)
    sdo = SdoChannel(1)
    boot = drive_program([settings], gateway_settings(), [Reference(settings, None)], Outputs((), 0.004))
    way = BringUp("node 1", 1, gateway_settings(), sdo, boot)
    way.step(0.0, None, False)
    way.booted()  # that of the power-on, sent before the node heard the reset
    way.step(0.01, None, False)
    lost = sdo.poll()
    assert lost is not None
    way.booted()  # that of the reset: what was asked in between is lost
    assert sdo.poll() is None
    sdo.done(SdoDone(lost.request_id, b"", None, "no SDO response received"))
    again = sdo.poll()
    assert again is not None
    assert (again.index, again.sub) == (lost.index, lost.sub)
    assert way.phase is Phase.CONFIGURING
    assert not way.problem
