"""One I/O node as the gateway sees it: what its inputs last said, and what its outputs are told."""

from cell.messages.gateway_state import IoStatus
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.io_map import DIGITAL_OUTPUTS
from drive_gateway.config.image import INPUTS_EVERY, io_image_of
from drive_gateway.config.settings import GatewaySettings, IoSettings
from drive_gateway.gateway.drives.output_frames import OutputSender
from drive_gateway.gateway.nodes.node import Node
from drive_gateway.gateway.nodes.program import io_node_program
from drive_gateway.gateway.playout.outputs import Outputs


class IoNode:
    """The inputs and outputs of `node`, for all robots that name some of them.

    Args:
        io: what the drives file says of it.
        settings: of the bus.
    """

    def __init__(self, io: IoSettings, settings: GatewaySettings) -> None:
        self.io = io
        self.label = f"node {io.node_id} (I/O {io.name})"
        self.operational = False
        """Its node is."""
        self.image = io_image_of(io)
        self.strange = ""
        """What was wrong with its newest TPDO, for people; empty when nothing was."""
        self._settings = settings
        self._sender = None if self.image.outputs is None else OutputSender(self.image.outputs)
        self._switched_by: dict[str, Outputs] = {}
        self._inputs: int | None = None
        """`None`: not measured since the node's start."""
        self._inputs_at = 0.0
        self.node = Node(io.node_id, self.label, io, settings, io_node_program(io, settings, self._word))
        self.node.attach(self)

    def serve(self, robot: str, outputs: Outputs) -> None:
        """A robot may have outputs at this node."""
        self._switched_by[robot] = outputs

    def describe(self) -> IoStatus:
        emergency = self.node.emergency
        return IoStatus(
            name=self.io.name,
            node_id=self.io.node_id,
            nmt="unknown" if self.node.nmt is None else self.node.nmt.words,
            operational=self.operational,
            problem=self.node.problem,
            emergency_code=None if emergency is None else emergency.code,
            emergency_text="" if emergency is None else emergency.meaning,
            outputs={robot: outputs.shown(io=self.io.name) for robot, outputs in self._switched_by.items()},
        )

    def said(self) -> str:
        """Its state in a few words, for the answer to a call."""
        if not self.operational:
            return f"{self.label}: {self.node.problem or self.node.phase.value}"
        emergency = self.node.emergency
        return f"{self.label}: operational" + (f", {emergency.code:04X}h {emergency.meaning}" if emergency else "")

    # Inputs

    def on_inputs(self, data: bytes, now: float) -> None:
        """A TPDO with its inputs."""
        if len(data) != self.io.input_bytes:
            self.strange = f"the newest had {len(data)} bytes instead of {self.io.input_bytes}"
            return
        self.strange = ""
        self._inputs, self._inputs_at = int.from_bytes(data, "little"), now

    def digital_inputs(self, now: float) -> int | None:
        """The newest inputs, those of the first byte lowest; `None` when they are too old to be believed."""
        patience_s = self._settings.tpdo_timeout_s + INPUTS_EVERY * self._settings.cycle_s
        return self._inputs if self.operational and now - self._inputs_at <= patience_s else None

    # Outputs

    def due(self, now: float) -> CanFrame | None:
        """The frame that tells its outputs, where it must be sent in this cycle; it acts with the next SYNC."""
        if self._sender is None or not (self.operational or self.node.lost):
            return None
        return self._sender.due(self._word(), now)

    def output_object(self, bit: int) -> tuple[int, int, int]:
        """Index and sub-index of the object that shows an output, and its bit there."""
        return DIGITAL_OUTPUTS, bit // 8 + 1, bit % 8

    def _word(self) -> int:
        word = 0
        for outputs in self._switched_by.values():
            word |= outputs.word(io=self.io.name)
        return word

    # What its node tells

    @property
    def measured(self) -> bool:
        """Its inputs have come since the node's start, where it has some."""
        return self._inputs is not None or self.image.inputs is None

    def started(self, now: float) -> None:  # noqa: ARG002 - inputs are as old as they are
        self.operational = True

    def silent_s(self, now: float, tick: int) -> float:  # noqa: ARG002 - its inputs do not come with every SYNC
        return 0.0 if self.image.inputs is None else now - self._inputs_at

    def lost(self) -> None:
        self.operational = False

    def forget(self) -> None:
        self._inputs = None
        self.strange = ""

    def ask_error(self) -> None:
        """A node with one module has one error: the newest emergency says it."""
