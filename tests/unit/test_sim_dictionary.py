"""The object dictionary of the simulated drive, against what `canopen` and the standards say."""

from importlib.resources import files

import canopen

from drive_gateway.sim.dictionary import key_of, load_dictionary


def test_dictionary_has_every_object_of_the_eds() -> None:
    parsed = canopen.import_od(str(files("drive_gateway.sim") / "cia402_drive.eds"), node_id=5)
    assert load_dictionary().indices == set(parsed)


def test_dictionary_is_loaded_once() -> None:
    assert load_dictionary() is load_dictionary()


def test_device_type_says_servo_drive_of_cia_402() -> None:
    assert load_dictionary().entries[key_of(0x1000)].default == 0x00020192


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
    entries = load_dictionary(3).entries
    assert entries[key_of(0x6864)].name == entries[key_of(0x7064)].name == entries[key_of(0x6064)].name
    assert key_of(0x1840, 1) in entries
    assert key_of(0x1440 + 0x40, 1) in entries
    assert entries[key_of(0x1A40, 1)].default >> 16 == (entries[key_of(0x1A00, 1)].default >> 16) + 0x800
    assert key_of(0x1840, 1) not in load_dictionary(1).entries
