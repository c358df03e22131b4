"""What the axes of a drives file exchange with their gateway."""

from drive_gateway.canopen.pdo_map import ProcessImage, process_image
from drive_gateway.config.settings import AxisSettings


def image_of(axis: AxisSettings) -> ProcessImage:
    """The process image of one axis."""
    profile = () if axis.profile_pdos is None else axis.profile_pdos.of(axis.node_id)
    return process_image(axis.node_id, velocity_offset=axis.velocity_offset, profile=profile)
