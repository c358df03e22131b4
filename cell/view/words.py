"""What states say, in words for people: why a robot stands, what was set, what is not known."""

from collections.abc import Iterable

from cell.messages import GatewayState, Mode, RobotState

ALARMED = frozenset({Mode.FAULT, Mode.ESTOP})


def program_text(state: RobotState) -> str:
    """The program line being executed, or the program's name and state when there is none."""
    program = state.program
    return program.text or f"{program.name} ({program.state.value})"


def why(state: RobotState) -> str:
    """Why the robot does not move as planned: alarms first, then the program's error, then what it waits for."""
    longest_first = sorted(dict.fromkeys(state.alarms), key=len, reverse=True)
    told = [alarm for i, alarm in enumerate(longest_first) if not any(alarm in longer for longer in longest_first[:i])]
    waiting = state.waiting_for if state.mode is Mode.RETURNING else ""
    return "; ".join(told) or waiting or state.program.error or state.waiting_for


def pace_text(state: RobotState) -> str:
    """What an operator has set and who rules the rate of a running robot; empty when it simply follows its plan."""
    pace, governor = state.pace, state.governor
    override = f"override {100.0 * pace.override:.0f} %"
    parts = [override] if pace.override != 1.0 else []
    parts += ["manual"] if pace.manual else []
    parts += ["step"] if pace.stepping else []
    ruled_by = governor.ruled_by if governor is not None and state.mode is Mode.RUNNING else ""
    if governor is not None and ruled_by not in ("", override) and not state.waiting_for:
        parts.append(f"rate {100.0 * governor.rate:.0f} %, ruled by {ruled_by}")
    return ", ".join(parts)


def mounted_text(state: RobotState) -> str:
    """What the robot holds, or that nobody has said it; empty for nothing."""
    tool = f"tool {state.tool}" if state.tool else ""
    if state.tool is None:
        tool = f"its tool is unknown: cell tool {state.robot}"
    part = f"holds {state.part}" if state.part else ""
    if state.part is None:
        part = f"what it holds is unknown: cell part {state.robot}"
    return ", ".join(filter(None, (tool, part)))


def forced_text(state: RobotState) -> str:
    """What is forced, and to what; empty for nothing."""
    inputs = ", ".join(f"{name} {'on' if on else 'off'}" for name, on in state.forced.items())
    return f"forced for its programs: {inputs}" if inputs else ""


def forced_outputs(gateway: GatewayState) -> list[str]:
    """Each output that an operator has forced, and who he is."""
    forced = ((robot, name, by) for robot, outputs in gateway.forced.items() for name, by in outputs.items())
    return [f"output {name} of {robot} is FORCED by {by}" for robot, name, by in forced]


def set_text(state: RobotState) -> str:
    """The parameters that are set; empty for none."""
    values = (f"{name} {each.value:g} {each.unit}" for name, each in state.parameters.items())
    return f"set: {told}" if (told := ", ".join(values)) else ""


def virtual_text(state: RobotState) -> str:
    """What a virtual run does, and why it waits; empty without one."""
    seen = state.virtual
    if seen is None:
        return ""
    waits = f", waits: {seen.waiting_for}" if seen.waiting_for else ""
    return f"virtual run {seen.mode.value}, line {seen.program.line} {seen.program.text or seen.program.name}{waits}"


def virtual_place(state: RobotState) -> str:
    """Where the TCP of a virtual run is; empty without one."""
    position_m = None if state.virtual is None else state.virtual.tcp_position_m
    return "" if position_m is None else f", TCP at {' '.join(f'{1000.0 * value:.1f}' for value in position_m)}"


def waited_text(state: RobotState) -> str:
    """How long the program has waited at its WAIT DI, IF or M; empty elsewhere."""
    waits_s = state.program.waits_s
    return f" (since {waits_s:.0f} s)" if waits_s is not None and state.waiting_for else ""


def unreferenced(gateways: Iterable[GatewayState]) -> dict[str, str]:
    """Which axes do not know where they are, why, and what to do, by robot; of buses whose drives are all heard."""
    lost: dict[str, dict[str, list[str]]] = {}
    for gateway in gateways:
        for node in gateway.nodes if gateway.ready else ():
            if not node.referenced:
                lost.setdefault(node.robot, {}).setdefault(node.reference_missing, []).append(node.axis)
    return {
        robot: "; ".join(f"{', '.join(axes)}: {reason}" for reason, axes in reasons.items())
        for robot, reasons in lost.items()
    }
