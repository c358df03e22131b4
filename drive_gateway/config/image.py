"""What the axes of a drives file exchange with their gateway."""

from drive_gateway.canopen.pdo_map import ProcessImage, process_image
from drive_gateway.config.settings import AxisSettings

INPUTS_EVERY = 2
"""SYNCs from one message of an axis' inputs to the next."""


def image_of(axis: AxisSettings) -> ProcessImage:
    """The process image of one axis."""
    return process_image(
        axis.node_id,
        axis=axis.number,
        interpolated=axis.interpolated,
        velocity_offset=axis.velocity_offset,
        inputs_every=0 if axis.inputs is None else INPUTS_EVERY,
        profile=() if axis.profile_pdos is None else axis.profile_pdos.of(axis.node_id, axis.number),
    )
