"""The SDO abort codes of CiA 301 by name, as the `canopen` library has them."""

from canopen import SdoAbortedError


def abort_text(code: int) -> str:
    """An abort code by its number and its name."""
    name = SdoAbortedError.CODES.get(code, "code not in CiA 301")
    return f"abort {code:08X}h, {name[0].lower() if name[1].islower() else name[0]}{name[1:]}"
