"""What an error frame of SocketCAN says (linux/can/error.h): the state of this host's own CAN controller."""

import can

BUS_OFF = "bus-off: the CAN controller left the bus after too many errors"
_CONTROLLER, _ACKNOWLEDGE, _BUS_OFF = 0x004, 0x020, 0x040
_PASSIVE = 0x30
"""In the second data byte: the receiver or the transmitter is error passive."""


def meaning(message: can.Message) -> str:
    """The error that people should know of, for an error frame of `socketcan`; empty for all others.

    Single errors on the wire are repeated by the controller itself and say nothing; those that last lead to these.
    """
    classes = message.arbitration_id
    if classes & _BUS_OFF:
        return BUS_OFF
    if classes & _CONTROLLER and len(message.data) > 1 and message.data[1] & _PASSIVE:
        return "the CAN controller is error passive, most of its frames meet errors"
    if classes & _ACKNOWLEDGE:
        return "no node acknowledges the frames of this host"
    return ""
