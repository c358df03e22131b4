"""The object dictionary of the simulated drive, against what `canopen` and the standards say."""

from configparser import RawConfigParser
from dataclasses import replace
from importlib.resources import files
from io import StringIO

import canopen

from drive_gateway.sim.drives.cyclic_modes import CYCLIC_SYNCHRONOUS_POSITION, CYCLIC_TORQUE, INTERPOLATED_POSITION
from drive_gateway.sim.drives.setup_modes import SETUP_MODES
from drive_gateway.sim.services.dictionary import key_of, load_dictionary

LISTS = ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")


class EdsFile(StringIO):
    name = "node.eds"


def test_dictionary_has_every_object_of_the_eds() -> None:
    parsed = canopen.import_od(str(files("drive_gateway.sim") / "cia402_drive.eds"), node_id=5)
    assert load_dictionary().indices == set(parsed)


def test_dictionary_is_loaded_once() -> None:
    assert load_dictionary() is load_dictionary()


def test_device_type_says_servo_drive_of_cia_402() -> None:
    assert load_dictionary().entries[key_of(0x1000)].default == 0x00020192


def test_every_mode_that_the_drive_takes_is_one_that_it_says_to_support() -> None:
    supported = load_dictionary().entries[key_of(0x6502)].default
    cyclic = INTERPOLATED_POSITION, CYCLIC_SYNCHRONOUS_POSITION, CYCLIC_TORQUE
    assert supported == sum(1 << mode - 1 for mode in (*cyclic, *SETUP_MODES))


def test_limits_come_from_the_type_where_the_eds_names_none() -> None:
    entry = load_dictionary().entries[key_of(0x607A)]
    assert (entry.low, entry.high) == (-(2**31), 2**31 - 1)


def test_limits_come_from_the_eds_where_it_names_them() -> None:
    entry = load_dictionary().entries[key_of(0x60C2, 2)]
    assert (entry.low, entry.high) == (-6, 0)


def test_pdo_identifiers_depend_on_the_node() -> None:
    entry = load_dictionary().entries[key_of(0x1801, 1)]
    assert entry.relative
    assert entry.default == 0xC0000280


def test_each_further_axis_has_its_own_objects_800h_and_its_pdos_64_on() -> None:
    entries, of_one = load_dictionary(3).entries, load_dictionary().entries
    assert replace(entries[key_of(0x7064)], key=key_of(0x6064), name="") == replace(of_one[key_of(0x6064)], name="")
    assert entries[key_of(0x6864)].name == "Position actual value in counts, axis 2"
    assert key_of(0x1440 + 0x40, 1) in entries
    assert key_of(0x1840, 1) not in of_one
    assert entries[key_of(0x1A40, 1)].default >> 16 == (entries[key_of(0x1A00, 1)].default >> 16) + 0x800
    once = [key for key in of_one if 0x1000 <= key >> 8 < 0x1400]
    assert {key for key in entries if 0x1000 <= key >> 8 < 0x1400} == set(once)


def test_a_node_with_several_axes_says_so_and_keeps_an_eds_that_has_them_all() -> None:
    entries = load_dictionary(2).entries
    assert entries[key_of(0x1000)].default == 0xFFFF0192
    assert [entries[key_of(index)].default for index in (0x67FF, 0x6FFF)] == [0x00020192, 0x00020192]
    kept = entries[key_of(0x1021)].text.decode()
    read_back = canopen.import_od(EdsFile(kept), node_id=0)
    assert set(read_back) == load_dictionary(2).indices
    listed = RawConfigParser()
    listed.read_string(kept)
    every = {int(index, 16) for kind in LISTS for key, index in listed[kind].items() if key != "supportedobjects"}
    assert every == set(read_back)
    assert sum(int(listed[kind]["SupportedObjects"]) for kind in LISTS) == len(every)
