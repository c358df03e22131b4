"""The reasons for which a node refuses an access to its object dictionary (CiA 301, SDO abort codes)."""

from enum import IntEnum


class Abort(IntEnum):
    TOGGLE = 0x05030000
    UNKNOWN_COMMAND = 0x05040001
    BLOCK_SIZE = 0x05040002
    SEQUENCE = 0x05040003
    CRC = 0x05040004
    UNSUPPORTED_ACCESS = 0x06010000
    WRITE_ONLY = 0x06010001
    READ_ONLY = 0x06010002
    NO_OBJECT = 0x06020000
    NOT_MAPPABLE = 0x06040041
    PDO_TOO_LONG = 0x06040042
    INCOMPATIBLE = 0x06040043
    LENGTH = 0x06070010
    TOO_LONG = 0x06070012
    TOO_SHORT = 0x06070013
    NO_SUB_INDEX = 0x06090011
    RANGE = 0x06090030
    TOO_HIGH = 0x06090031
    TOO_LOW = 0x06090032
    MAXIMUM_BELOW_MINIMUM = 0x06090036
    CANNOT_STORE = 0x08000020
    DEVICE_STATE = 0x08000022
    NO_DATA = 0x08000024


class AccessRefused(Exception):
    """An object was not read or not written; `code` goes into the SDO abort."""

    def __init__(self, code: Abort) -> None:
        super().__init__(f"{code:08X}h {code.name.lower().replace('_', ' ')}")
        self.code = code
