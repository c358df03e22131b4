"""What a gateway tells about its bus, a few times per second."""

from dataclasses import dataclass, field

from cell.messages.common import Heard
from cell.messages.drives import AxisStatus


@dataclass(frozen=True, slots=True)
class NodeStatus:
    """One drive node: its NMT state as last heard, the drive state, and the newest emergency code with its meaning."""

    node_id: int
    robot: str
    axis: str
    nmt: str
    drive: AxisStatus
    emergency_code: int | None = None
    emergency_text: str = ""
    referenced: bool = True
    """The drive knows where its axis is."""
    reference_missing: str = ""
    """Why it does not, and what to do, for people."""
    warning: bool = False
    """Bit 7 of its statusword: something is near a limit of the drive, or it can only go one way."""
    following_error: float | None = None
    """[rad or m] the largest one since the robot was enabled; `None`: it has not been."""
    outputs: dict[str, bool] = field(default_factory=dict)
    """Its digital outputs by name: on or off."""


@dataclass(frozen=True, slots=True)
class BusCounters:
    """What the cycle loop counts since the start."""

    ticks: int
    late_cycles: int
    worst_lateness_s: float
    missing_tpdos: int
    blocks_accepted: int
    blocks_refused: int
    bus_load: float
    """Share of the wire time that what is configured takes, 0 to 1, worst-case stuffing."""
    measured_load: float | None = None
    """Share of the wire time that all frames took in the newest second, the same way; `None` in the first one."""
    phase_error_s: float | None = None
    """How much the newest SYNC was behind a multiple of the cycle by the cell clock; `None`: no manager is heard."""


@dataclass(frozen=True, slots=True)
class GatewayState:
    """The bus and its drives as the gateway knows them."""

    gateway: str
    boot: str
    sequence: int
    cycle_s: float
    interface: str
    ready: bool
    """All nodes are configured and operational, and it is known which of them are referenced."""
    problem: str
    """Why it is not ready, for people; empty when it is."""
    owners: dict[str, str]
    """Robot: boot of the agent that owns it."""
    estop_confirmed: str | None
    """Id of the emergency stop under which all robots of this bus are measured at rest and switched off, if any."""
    nodes: tuple[NodeStatus, ...]
    counters: BusCounters
    setup: tuple[str, ...] = ()
    """Robots whose drives are to make motions of their own, or make them, or may still do so."""
    heard: Heard | None = None
    """Newest manager state that the gateway received."""
    digest: str = ""
    """Of its configuration."""
