"""The identifiers of the predefined connection set (CiA 301): 4-bit function code, 7-bit Node-ID."""

NMT = 0x000
SYNC = 0x080
EMCY = 0x080
TPDO1 = 0x180
RPDO1 = 0x200
SDO_FROM_NODE = 0x580
SDO_TO_NODE = 0x600
ERROR_CONTROL = 0x700
"""Boot-up, heartbeat and node guarding."""

HIGHEST_NODE_ID = 127
MASTER_NODE_ID = 127
"""A gateway's own Node-ID, under which it sends its heartbeat, unless its drives file says another one."""


def function_code(cob_id: int) -> int:
    """The identifier without its Node-ID (bits 10 to 7)."""
    return cob_id & 0x780


def node_id(cob_id: int) -> int:
    """The Node-ID of an identifier (bits 6 to 0)."""
    return cob_id & 0x07F
