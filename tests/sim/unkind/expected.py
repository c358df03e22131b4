"""What becomes of a robot with a drive that has a trait, and the table of `docs/drives.md` that says so.

python -m tests.sim.unkind.expected      prints the table
"""

from dataclasses import dataclass

from drive_gateway.canopen.emcy import Meaning
from drive_gateway.canopen.pdo_map import OwnPdo
from drive_gateway.config.settings import OwnObject
from tests.sim.unkind.bench import Changes
from tests.sim.unkind.traits.register import TRAITS

COMES_UP = "runs like any other drive"


@dataclass(frozen=True, slots=True)
class Expected:
    """A robot that does not come as far as others."""

    then: str
    """For the table."""
    tells: tuple[str, ...]
    """Parts of the sentence that people are told: the object, and the remedy."""
    helped_by: Changes | None = None
    """What the drives file can say so that it runs."""


TOOL = "set it with the maker's tool"
_NO_SETUP = "no set-up before its units are in the drives file: stopped within 0.03 deg"
_FACTOR = tuple(OwnObject(0x6096, sub, "velocity factor", (1).to_bytes(4, "little")) for sub in (1, 2))
_TOO_FAST = ("moves faster than it was told", "correct velocity_unit and counts_per_turn")

REFUSED = {
    "no_boot_up": Expected(
        "not brought up: no boot-up",
        ("sent no boot-up within 1 s after NMT reset", "a longer boot_timeout_s"),
    ),
    "very_slow_sdo": Expected(
        "not brought up; runs with `sdo_timeout_s: 1`",
        ("1018h:01 (vendor-ID): No SDO response received", "raise sdo_timeout_s"),
        Changes({"sdo_timeout_s": 0.9}, {}),
    ),
    "slow_dc_link": Expected(
        "not switched on; runs with `switch_on_s: 5`",
        ("got no further than switching on: node 1 (left J1): Ready to Switch On", "more time by switch_on_s"),
        Changes({}, {"switch_on_s": 5.0}),
    ),
    "restarts_under_load": Expected(
        "stopped with the whole robot, and brought up again at rest, switched off",
        ("node 1 (left J1) restarted by itself and lost its configuration", "check its supply"),
    ),
    "fixed_mapping_of_another_kind": Expected(
        "not brought up: the entry that differs",
        ("keeps 1A00h:02 (mapping of TPDO 1) at 60610008h, needed is 60640020h", TOOL),
    ),
    "mapping_of_cia_402": Expected(
        "not brought up: the entry that differs; runs with `number: 3` of `command` and `status` below `pdos`",
        ("keeps 1600h:00 (mapping of RPDO 1) at 1, needed is 2", "name the PDOs that have this by pdos"),
        Changes({}, {"own_pdos": {"command": OwnPdo(3), "status": OwnPdo(3)}}),
    ),
    "status_with_mode": Expected(
        "not brought up: the entry that differs; runs with its `mapping` of `status` below `pdos`",
        ("keeps 1A00h:00 (mapping of TPDO 1) at 3, needed is 2", "name the PDOs that have this by pdos"),
        Changes({}, {"own_pdos": {"status": OwnPdo(mapping=(0x60410010, 0x60610008, 0x60640020))}}),
    ),
    "fixed_event_driven": Expected(
        "not brought up: 1800h:02",
        ("keeps 1800h:02 (transmission type of TPDO 1) at 255, needed is 1", TOOL),
    ),
    "emergency_storm": Expected(
        "stopped as by any error; runs with `severity: warning` for its code",
        ("reports 4310h", "let the motor cool down"),
        Changes({}, {"emergencies": {0x4310: Meaning("motor hot", "let it cool down", stops=False)}}),
    ),
    "overrun_that_stays": Expected(
        "stopped as by any error; runs with `severity: warning` for its code",
        ("reports 8110h", "check the bus load"),
        Changes({}, {"emergencies": {0x8110: Meaning("CAN overrun", "check the bus load", stops=False)}}),
    ),
    "hunts at rest": Expected(
        "no set-up: it moves against what it is told; runs with `rest_window`",
        ("moves against the direction that it was told", "correct direction"),
        Changes({}, {"rest_window": 1e-3}),
    ),
    "speeds in rpm": Expected(_NO_SETUP, _TOO_FAST),
    "speeds by a velocity factor": Expected(
        f"{_NO_SETUP}; runs with 6096h:01 and 6096h:02 at 1 below `objects`",
        _TOO_FAST,
        Changes({}, {"objects": _FACTOR}),
    ),
    "speeds in rpm, as 60A9h says": Expected(_NO_SETUP, _TOO_FAST),
    "accelerations in 0.1 rpm/s": Expected(_NO_SETUP, _TOO_FAST),
    "speeds in 0.0001 rpm": Expected(
        _NO_SETUP, ("moves slower than it was told", "correct velocity_unit, acceleration_unit and counts_per_turn")
    ),
    "velocities against positions": Expected(
        "no set-up before `direction` or the drive's polarity (607Eh) is right",
        ("moves against the direction that it was told", "the drive's polarity (607Eh)"),
    ),
    "unused_pdo_collides": Expected(
        "not brought up: 1803h:01",
        ("1803h:01 (TPDO 4, which is not used): abort 06090030h", TOOL),
    ),
    "fixed_cycle_period": Expected(
        "not brought up: 1006h; runs at its own `cycle_s`",
        ("keeps 1006h:00 (communication cycle period in us) at 10000, needed is 4000", "choose a cycle_s"),
        Changes({"cycle_s": 0.01}, {}),
    ),
    "another_quick_stop": Expected(
        "not brought up: 605Ah; runs with `quick_stop_option: 2`",
        ("keeps 605Ah:00 (quick-stop option) at 2, needed is 6", "this drive takes: quick_stop_option"),
        Changes({}, {"quick_stop_option": 2}),
    ),
    "coarse_heartbeat": Expected(
        "not brought up: 1017h; runs with `heartbeat_producer_s: 0.1`",
        ("was told 1017h:00 (heartbeat of the node) as 50 and still shows 0", "heartbeat_producer_s"),
        Changes({"heartbeat_producer_s": 0.1}, {}),
    ),
    "heartbeat_pauses": Expected(
        "stopped as by any loss; runs with a longer `heartbeat_timeout_s`",
        ("node 1 (left J1) sent no heartbeat for 0.2", "raise heartbeat_timeout_s"),
        Changes({"heartbeat_timeout_s": 0.5}, {}),
    ),
    "guarding_only": Expected(
        "not brought up: 1017h; runs with `error_control: guarding`",
        ("refused write of 1017h:00 (heartbeat of the node): abort 06020000h", "say error_control: guarding"),
        Changes({}, {"guarded": True}),
    ),
    "one_following_time": Expected(
        "not brought up: 6066h; runs with `following_time_s: 0.01`",
        ("keeps 6066h:00 (following-error time) at 10, needed is 50", "this drive takes: following_time_s"),
        Changes({}, {"following_time_s": 0.01}),
    ),
    "mode_is_not_shown": Expected(
        "not brought up: 6061h",
        ("refused read of 6061h:00 (mode of operation, expected 8): abort 08000024h", "a drive, or a firmware of it"),
    ),
    "ramp_with_an_end": Expected(
        "not brought up: 6085h; runs with a smaller `quick_stop`",
        ("keeps 6085h:00 (quick-stop deceleration) at 100000, needed is 4000000", "this drive takes: quick_stop"),
        Changes({}, {"quick_stop": 9.99, "acceleration": 9.0}),
    ),
}
"""By trait; all others run like any other drive."""

TOLD = {"unused_pdos_stay": "keeps TPDO 3 (1802h:01) on the bus, which is not used"}
"""What is told of drives that run (`object_missing`)."""


def then(name: str) -> str:
    """What the gateway makes of a drive with this trait."""
    if name in REFUSED:
        return REFUSED[name].then
    return f"{COMES_UP}; its PDOs are told" if name in TOLD else COMES_UP


def table() -> str:
    """Every trait, by name."""
    rows = [f"| `{name}` | {trait.says} | {trait.source} | {then(name)} |" for name, trait in sorted(TRAITS.items())]
    return "\n".join(["| drive | what it does | known from | then it |", "|---|---|---|---|", *rows])


if __name__ == "__main__":
    print(table())
