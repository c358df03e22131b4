"""What a gateway tells about its bus, a few times per second."""

from dataclasses import dataclass, field
from typing import Annotated

from cell.messages.common import ClockStatus, Count, Duration, Few, Heard, Name, Number, Text
from cell.messages.drives import AxisStatus
from cell.messages.state import state


@dataclass(frozen=True, slots=True)
class NodeStatus:
    """One drive node: its NMT state as last heard, the drive state, and the newest emergency code with its meaning."""

    node_id: Count
    robot: Name
    axis: Name
    nmt: Name
    drive: AxisStatus
    emergency_code: Count | None = None
    emergency_text: Text = ""
    referenced: bool = True
    """The drive knows where its axis is."""
    reference_missing: Text = ""
    """Why it does not, and what to do, for people."""
    warning: bool = False
    """Bit 7 of its statusword: something is near a limit of the drive, or it can only go one way."""
    following_error: Number | None = None
    """[rad or m] the largest one since the robot was enabled; `None`: it has not been."""
    outputs: Annotated[dict[Name, bool], Few] = field(default_factory=dict)
    """Its digital outputs by name: on or off."""
    current_a: Number | None = None
    """Of its motor, positive where it drives the axis upwards, read about once a second; `None`: not told lately."""
    temperature_c: Number | None = None
    """What its `temperature` in the drives file measures, likewise."""


@dataclass(frozen=True, slots=True)
class IoStatus:
    """One I/O node (CiA 401): its NMT state as last heard, and the newest emergency code with its meaning."""

    name: Name
    node_id: Count
    nmt: Name
    operational: bool
    """It is configured, was started, and is heard."""
    problem: Text = ""
    """Why it is not, for people; empty when it is or when its first attempt goes on."""
    emergency_code: Count | None = None
    emergency_text: Text = ""
    outputs: Annotated[dict[Name, Annotated[dict[Name, bool], Few]], Few] = field(default_factory=dict)
    """Robot: its digital outputs at this node by name, on or off."""


@dataclass(frozen=True, slots=True)
class BusCounters:
    """What the cycle loop counts since the start."""

    ticks: Count
    late_cycles: Count
    worst_lateness_s: Number
    missing_tpdos: Count
    blocks_accepted: Count
    blocks_refused: Count
    bus_load: Number
    """Share of the wire time that what is configured takes, 0 to 1, worst-case stuffing."""
    measured_load: Number | None = None
    """Share of the wire time that all frames took in the newest second, the same way; `None` in the first one."""
    phase_error_s: Number | None = None
    """How much the newest SYNC was behind a multiple of the cycle by the cell clock; `None`: no manager is heard."""


@state("gateway/{gateway}/state")
@dataclass(frozen=True, slots=True)
class GatewayState:
    """The bus and its drives as the gateway knows them."""

    gateway: Name
    boot: Name
    sequence: Count
    cycle_s: Duration
    interface: Name
    ready: bool
    """All nodes are configured and operational, but for I/O nodes whose loss is only told (`on_loss`), and it is known
    which of them are referenced."""
    problem: Text
    """Why it is not ready, for people; empty when it is."""
    owners: Annotated[dict[Name, Name], Few]
    """Robot: boot of the agent that owns it."""
    estop_confirmed: Name | None
    """Id of the emergency stop under which all robots of this bus are measured at rest and switched off, if any."""
    nodes: Annotated[tuple[NodeStatus, ...], Few]
    counters: BusCounters
    setup: Annotated[tuple[Name, ...], Few] = ()
    """Robots whose drives are to make motions of their own, or make them, or may still do so."""
    heard: Heard | None = None
    """Newest manager state that the gateway received."""
    digest: Name = ""
    """Of its configuration."""
    era: Count = 0
    """Grows from one run of the gateway to the next: the number of the first claim of this run."""
    io_nodes: Annotated[tuple[IoStatus, ...], Few] = ()
    inputs: Annotated[dict[Name, Annotated[dict[Name, bool | None], Few]], Few] = field(default_factory=dict)
    """Robot: its named digital inputs, of drives and I/O nodes: true is closed (1), null is not known, because nobody
    has measured it lately."""
    forced: Annotated[dict[Name, Annotated[dict[Name, Text], Few]], Few] = field(default_factory=dict)
    """Robot: its digital outputs that are forced, each with the operator who did it."""
    estop: Name | None = None
    """Id of the oldest emergency stop in force here, confirmed or not; it ends only after the manager heard of it."""
    clock: ClockStatus | None = None
    """None before a manager's state has answered this gateway."""
