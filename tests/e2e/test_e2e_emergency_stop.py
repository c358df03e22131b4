"""An emergency stop that is asked for goes out, whatever else is broken; a listener stands for the cell."""

import os
import queue
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import pytest
import zenoh
from live_cell import ROOT, LiveCell, Recorder
from zenoh.handlers import Callback

from cell.commands.emergency.recipients import recipients_of, store
from cell.messages import Estop
from cell.net.options import Link, ZenohOptions, zenoh_config
from cell.net.session import CellSession

HEARD_S = 30.0
RUN = ("-m", "cell.commands.main")
NOBODY = "import os; os.getuid = lambda: 54321\nfrom cell.commands.main import main; main()"


@contextmanager
def listener(live: LiveCell, endpoint: str) -> Iterator[Recorder]:
    link = Link("peer", listen=(endpoint,))
    with CellSession(live.settings.name, link, "test", "test", "t1") as session:
        yield Recorder(session, "estop")


@contextmanager
def estop(*words: str, python: tuple[str, ...] = RUN, **options: object) -> Iterator["subprocess.Popen[bytes]"]:
    """The command `cell estop`, killed at the end: with a listener alone nobody confirms."""
    given: dict[str, object] = {"cwd": ROOT, "stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, **options}
    process = subprocess.Popen([sys.executable, *python, "estop", *words], **given)  # type: ignore[call-overload]
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def heard(listening: Recorder) -> Estop:
    return listening.wait_for(Estop, lambda stop: stop.active, HEARD_S, "an emergency stop")


def environment(**changes: str | None) -> dict[str, str]:
    return {name: value for name, value in {**os.environ, **changes}.items() if value is not None}


def break_file(live: LiveCell) -> None:
    folder = live.file.parent / ".zencell" / live.settings.name
    folder.mkdir(parents=True)
    store(folder, recipients_of(live.settings))
    live.file.write_text("cell: [")


def remove_file(live: LiveCell) -> None:
    break_file(live)
    live.file.unlink()


def add_unknown_key(live: LiveCell) -> None:
    live.file.write_text(live.file.read_text() + "lights: green\n")


def write_in_utf_16(live: LiveCell) -> None:
    live.file.write_text(live.file.read_text(), encoding="utf-16")


@pytest.mark.parametrize("damage", [break_file, remove_file, add_unknown_key, write_in_utf_16])
def test_a_stop_goes_out_with_a_cell_file_that_is_refused(live: LiveCell, damage: Callable[[LiveCell], None]) -> None:
    damage(live)
    with listener(live, live.settings.manager_endpoint) as listening, estop("-f", str(live.file)):
        assert heard(listening).reason == "operator"


def test_a_stop_goes_out_with_nothing_but_an_endpoint(live: LiveCell) -> None:
    """The name of the cell is that of whoever is alive there."""
    endpoint = live.settings.manager_endpoint
    link = Link("peer", listen=(endpoint,))
    with CellSession(live.settings.name, link, "robot", "left", "b1") as session:
        session.declare_alive()
        listening = Recorder(session, "estop")
        with estop("-f", str(live.folder / "nowhere" / "cell.yaml"), "-e", endpoint):
            heard(listening)


@contextmanager
def another_cell(endpoint: str) -> Iterator[Recorder]:
    """A process of a cell that no cell file here names."""
    with CellSession("elsewhere", Link("peer", listen=(endpoint,)), "robot", "left", "b1") as session:
        session.declare_alive()
        yield Recorder(session, "estop")


def free_endpoint() -> str:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return f"tcp/127.0.0.1:{server.getsockname()[1]}"


@pytest.mark.parametrize("by", ["folder", "environment"])
def test_a_door_is_asked_who_is_there_whatever_cell_file_lies_about(live: LiveCell, by: str) -> None:
    """The doors of the file that lies about open, too: they keep nothing from those that were named."""
    door, manager = free_endpoint(), live.settings.manager_endpoint
    lies = environment(ZENCELL_FILE=str(live.file) if by == "environment" else None)
    with (
        another_cell(door) as there,
        listener(live, manager) as own,
        estop("-e", door, cwd=live.file.parent, env={**lies, "PYTHONPATH": str(ROOT)}),
    ):
        heard(there)
        heard(own)


def test_a_door_at_which_nobody_is_of_the_named_cell_stops_all_that_are_there(live: LiveCell) -> None:
    door = free_endpoint()
    with another_cell(door) as there, estop("-f", str(live.file), "-e", door):
        heard(there)


def test_a_door_at_which_somebody_is_of_the_named_cell_stops_no_other_cell(live: LiveCell) -> None:
    door, cells = free_endpoint(), (live.settings.name, "elsewhere")
    with zenoh.open(zenoh_config(Link("peer", listen=(door,)), ZenohOptions())) as session:
        tokens = [session.liveliness().declare_token(f"cell/{cell}/alive/robot/left/b1") for cell in cells]
        stops: queue.SimpleQueue[zenoh.Sample] = queue.SimpleQueue()
        session.declare_subscriber("cell/*/estop", Callback(stops.put, indirect=False))
        with estop("-f", str(live.file), "-e", door):
            keys = {str(stops.get(timeout=HEARD_S).key_expr) for _ in range(30)}
    assert keys == {f"cell/{live.settings.name}/estop"}
    assert len(tokens) == len(cells)


def test_a_cell_of_which_nobody_knows_who_belongs_to_it_is_named(live: LiveCell) -> None:
    door = free_endpoint()
    with another_cell(door), listener(live, live.settings.manager_endpoint):
        command = live.order("estop", "-e", door)
    assert command.exit_code() == 1
    assert live.settings.manager_endpoint in command.output
    assert f"emergency stop sent through {door} to all cells that are there: elsewhere" in command.output
    assert "nobody can say who belongs to elsewhere" in command.output


def test_a_message_that_nobody_can_read_does_not_end_the_stop(live: LiveCell) -> None:
    config = zenoh_config(Link("peer", listen=(live.settings.manager_endpoint,)), ZenohOptions())
    with zenoh.open(config) as session:
        stops: queue.SimpleQueue[zenoh.Sample] = queue.SimpleQueue()
        session.declare_subscriber(f"cell/{live.settings.name}/estop", Callback(stops.put, indirect=False))
        with estop("-f", str(live.file)):
            for _ in range(30):
                stops.get(timeout=HEARD_S)
                session.put(f"cell/{live.settings.name}/robot/x/presence", b"[" * 100_000)


def close_standard_streams() -> None:
    for number in range(3):
        os.close(number)


def test_a_stop_goes_out_with_stdout_and_stderr_closed(live: LiveCell) -> None:
    with (
        listener(live, live.settings.manager_endpoint) as listening,
        estop("-f", str(live.file), preexec_fn=close_standard_streams),
    ):
        heard(listening)


def test_a_stop_goes_out_and_on_when_nobody_reads_what_it_prints(live: LiveCell) -> None:
    reads, writes = os.pipe()
    os.close(reads)
    with (
        listener(live, live.settings.manager_endpoint) as listening,
        estop("-f", str(live.file), stdout=writes, stderr=writes),
    ):
        for _ in range(30):
            heard(listening)
    os.close(writes)


def test_a_stop_goes_out_without_a_terminal_and_with_a_reason_that_is_no_utf_8(live: LiveCell) -> None:
    bare = environment(LANG="C", LC_ALL="C", PYTHONUTF8="0", PYTHONCOERCECLOCALE="0", TERM=None)
    with (
        listener(live, live.settings.manager_endpoint) as listening,
        estop("-f", str(live.file), "--reason", b"T\xfcr offen\n", env=bare),  # type: ignore[arg-type]
    ):
        assert heard(listening).reason == "Tür offen"


def test_a_stop_goes_out_with_a_setting_of_zenoh_that_it_cannot_read(live: LiveCell) -> None:
    with (
        listener(live, live.settings.manager_endpoint) as listening,
        estop("-f", str(live.file), env=environment(ZENOH_RUNTIME="garbage")),
    ):
        heard(listening)


def test_a_stop_goes_out_for_a_user_without_a_name(live: LiveCell) -> None:
    nameless = environment(USER=None, LOGNAME=None, USERNAME=None, LNAME=None)
    with (
        listener(live, live.settings.manager_endpoint) as listening,
        estop("-f", str(live.file), python=("-c", NOBODY), env=nameless),
    ):
        assert heard(listening).by.startswith("uid 54321@")


def test_a_stop_goes_out_with_a_misspelled_option(live: LiveCell) -> None:
    with listener(live, live.settings.manager_endpoint) as listening, estop("--raeson", "x", "-f", str(live.file)):
        heard(listening)


def test_a_stop_goes_out_though_the_terminal_is_gone(live: LiveCell) -> None:
    with listener(live, live.settings.manager_endpoint) as listening, estop("-f", str(live.file)) as command:
        heard(listening)
        command.send_signal(signal.SIGHUP)
        for _ in range(10):
            heard(listening)


class Tarpit:
    """Accepts connections and says nothing, as a frozen process does."""

    def __init__(self) -> None:
        self._server = socket.create_server(("127.0.0.1", 0))
        self.endpoint = f"tcp/127.0.0.1:{self._server.getsockname()[1]}"
        self.given_up = threading.Event()
        self._thread = threading.Thread(target=self._accept, daemon=True)
        self._thread.start()

    def _accept(self) -> None:
        try:
            connection, _ = self._server.accept()
            with connection:
                while connection.recv(1000):
                    pass
        except OSError:
            pass
        self.given_up.set()

    def __enter__(self) -> "Tarpit":
        return self

    def __exit__(self, *error: object) -> None:
        self._server.close()


def test_a_stop_goes_out_while_dead_doors_are_still_being_tried(live: LiveCell) -> None:
    with ExitStack() as stack:
        dead = [stack.enter_context(Tarpit()) for _ in range(3)]
        words = [word for door in dead for word in ("-e", door.endpoint)]
        gateway = live.settings.gateways["right_bus"].endpoint
        listening = stack.enter_context(listener(live, gateway))
        stack.enter_context(estop(*words, "-e", "nonsense", "-f", str(live.file)))
        heard(listening)
        assert not any(door.given_up.is_set() for door in dead)


def test_without_a_live_door_it_points_to_the_hard_wired_emergency_stop(live: LiveCell) -> None:
    command = live.order("estop", "-e", "nonsense")
    assert command.exit_code() == 1
    assert "NO emergency stop was sent: nobody answers at nonsense" in command.output
    assert f"nobody answers at {live.settings.manager_endpoint}" in command.output
    assert "next: use the hard-wired emergency stop" in command.output


def test_who_does_not_confirm_and_which_doors_are_dead_is_named(live: LiveCell) -> None:
    with listener(live, live.settings.manager_endpoint):
        command = live.order("estop")
    assert command.exit_code() == 1
    assert f"emergency stop sent through {live.settings.manager_endpoint}" in command.output
    for door in live.settings.gateways.values():
        assert f"nobody answers at {door.endpoint}" in command.output
    assert "not confirmed in time by: gateway left_bus, gateway right_bus, robot left, robot right" in command.output
