"""What the axes and I/O nodes of a drives file exchange with their gateway."""

from drive_gateway.canopen.io_map import IoImage, io_image
from drive_gateway.canopen.pdo_map import EVERY_SYNC, ProcessImage, process_image
from drive_gateway.config.settings import AxisSettings, GatewaySettings, IoSettings

INPUTS_EVERY = 2
"""SYNCs from one message of an axis' or I/O node's inputs to the next; limit switches come with every SYNC."""


def image_of(axis: AxisSettings) -> ProcessImage:
    """The process image of one axis."""
    return process_image(
        axis.node_id,
        axis=axis.number,
        interpolated=axis.interpolated,
        velocity_offset=axis.velocity_offset,
        torque_offset=axis.torque_offset,
        torques=axis.torque is not None,
        inputs_every=_inputs_every(axis),
        outputs=axis.output_mask != 0,
        profile=() if axis.profile_pdos is None else axis.profile_pdos.of(axis.node_id, axis.number),
        own=axis.own_pdos,
    )


def io_image_of(io: IoSettings) -> IoImage:
    """The process image of an I/O node."""
    return io_image(io.node_id, io.input_bytes, io.output_bytes, INPUTS_EVERY)


def images_of(gateway: GatewaySettings) -> list[ProcessImage | IoImage]:
    """Those of all axes and I/O nodes of a bus."""
    axes = [image_of(axis) for robot in gateway.robots.values() for axis in robot.axes]
    return [*axes, *map(io_image_of, gateway.io_nodes)]


def _inputs_every(axis: AxisSettings) -> int:
    """A limit switch is told with the statusword of the same SYNC, so that it is known why a drive stopped."""
    if axis.limit_switches is not None:
        return EVERY_SYNC
    return 0 if axis.inputs is None and not axis.input_mask else INPUTS_EVERY
