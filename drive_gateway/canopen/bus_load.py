"""Bits that a frame takes on the wire, and the share of the wire that a cyclic exchange uses."""


def frame_bits(data_bytes: int) -> int:
    """Bits of a CAN 2.0A frame: 47 + 8n with the interframe space, + floor((34 + 8n - 1) / 4) worst-case stuffing."""
    return 47 + 8 * data_bytes + (33 + 8 * data_bytes) // 4


def cyclic_load(
    nodes: int, bitrate: int, cycle_s: float, heartbeat_s: float, pdo_bits: float, timed_bits_s: float = 0.0
) -> float:
    """Share of the wire (0 to 1) of one SYNC per cycle, `pdo_bits` of all PDOs in a cycle, and all heartbeats.

    `timed_bits_s`: PDOs that do not belong to the cycle [bit/s].
    """
    per_cycle = frame_bits(0) + pdo_bits
    per_heartbeat = (nodes + 1) * frame_bits(1)
    return (per_cycle / cycle_s + per_heartbeat / heartbeat_s + timed_bits_s) / bitrate
