"""An EDS or DCF file as `canopen` reads it, with what is wrong in it said for people (CiA 306)."""

import configparser
import logging
import re
import warnings
from io import StringIO
from pathlib import Path

import canopen
from canopen.objectdictionary import eds as reader

from drive_gateway.errors import GatewayError

_ENCODINGS = ("utf-8-sig", "cp1252")
"""Files of today, and those that makers' tools write on Windows."""
_ALLOWED = "an EDS or DCF file as CiA 306 describes it"
# Sections that a file lacks are the reader's business here, not the log's.
logging.getLogger("canopen").setLevel(logging.CRITICAL)

_COMPACT_VALUES = re.compile(r"^\s*\[[0-9A-Fa-f]{4}Value\]", re.MULTILINE)


class EdsError(GatewayError):
    """An EDS file that cannot be read, an object that it does not have, or a value that does not fit the object."""

    def __init__(self, found: str, allowed: str) -> None:
        super().__init__(f"{found}; allowed: {allowed}")
        self.found = found
        self.allowed = allowed


def read_eds(file: str) -> canopen.ObjectDictionary:
    """The objects of a file; a DCF's Node-ID stands for $NODEID in it.

    Raises:
        EdsError: it cannot be read; says what is wrong and where.
    """
    name = Path(file).name
    text = _text(file)
    if _COMPACT_VALUES.search(text):
        raise EdsError(
            f"{name}: cannot be read: values in a compact [....Value] section", "ParameterValue at each object"
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # of the library, about itself
            objects: canopen.ObjectDictionary = reader.import_eds(_Named(text), None)  # type: ignore[no-untyped-call]
    except Exception as error:  # the library lets through whatever a broken file leads to
        raise EdsError(f"{name}: cannot be read: {_reason(error)}", _ALLOWED) from error
    if not objects:
        raise EdsError(f"{name}: cannot be read: no object in it", _ALLOWED)
    return objects


def is_dcf(file: str) -> bool:
    """It says the values of one device, not those of all of its kind."""
    return Path(file).suffix.lower() == ".dcf"


class _Named(StringIO):
    """Text of a file for `configparser`, which puts the name into its errors."""

    name = "file"


def _text(file: str) -> str:
    try:
        data = Path(file).read_bytes()
    except OSError as error:
        reason = error.strerror or str(error)
        raise EdsError(f"{Path(file).name}: cannot be read: {reason}", _ALLOWED) from error
    for encoding in _ENCODINGS:
        try:
            return data.decode(encoding).replace("\r\n", "\n")
        except UnicodeDecodeError as error:
            place = data.count(b"\n", 0, error.start) + 1
            found = f"{Path(file).name}: cannot be read: the byte {data[error.start]:#04x} in line {place}"
    raise EdsError(found, "text in UTF-8 or Windows-1252")


def _reason(error: Exception) -> str:
    """What is wrong, and where as far as it is known."""
    match error:
        case configparser.MissingSectionHeaderError(lineno=line):
            return f"text in line {line} before the first [section]"
        case configparser.DuplicateSectionError(section=section, lineno=line):
            return f"a second section [{section}] in line {line}"
        case configparser.DuplicateOptionError(section=section, option=option, lineno=line):
            return f"a second {option} in section [{section}], line {line}"
        case configparser.ParsingError(errors=errors) if errors:
            return f"line {errors[0][0]} is neither a [section] nor KEY=VALUE"
        case configparser.NoOptionError(section=section, option=option):
            return f"section [{section}] without {option}"
        case ValueError():
            return f"a value that is no number ({error})"
        case KeyError():
            return f"a sub-object without the section of its object: {error.args[0]}"
    return str(error) or type(error).__name__
