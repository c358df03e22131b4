"""What keeps a cell from starting is said in a sentence, with the next step, and leaves no process behind."""

import shutil
import signal
import socket
from pathlib import Path

import pytest
from live_cell import LiveCell, Process, wait_until


def ended_with_a_sentence(process: Process, *texts: str) -> None:
    assert process.wait(60.0) == 1, process.output
    for text in texts:
        assert text in process.output
    assert "Traceback" not in process.output


def test_every_process_refuses_what_cell_check_refuses_with_the_same_lines(live: LiveCell) -> None:
    drives = live.file.parent / "left_drives.yaml"
    drives.write_text(drives.read_text().replace("node: 2", "node: 1"))
    program = live.settings.robots["left"].program
    program.write_text(program.read_text().replace("WAIT 0.2", "WAIT soon"))
    check = live.start("cell", "check", str(live.file))
    tried = [live.up(), live.manager(), live.agent("right"), live.gateway("right_bus")]
    tried.append(live.start("drive-gateway", "simulate", str(live.file), "right_bus"))
    assert check.wait(60.0) == 1
    problems = [line for line in check.output.splitlines() if ": found " in line]
    assert len(problems) == 2
    for process in tried:
        ended_with_a_sentence(process, "next: ")
        assert [line.strip() for line in process.output.splitlines() if ": found " in line] == problems


def test_a_foreign_program_at_an_endpoint_is_said(live: LiveCell) -> None:
    port = int(live.settings.manager_endpoint.rpartition(":")[2])
    with socket.create_server(("127.0.0.1", port)):
        up, manager = live.up(), live.manager()
        for process in (up, manager):
            ended_with_a_sentence(
                process, f"{live.settings.manager_endpoint} is in use", "a program that does not speak Zenoh"
            )


def test_a_can_channel_that_does_not_exist_ends_the_start(live: LiveCell) -> None:
    drives = live.file.parent / "left_drives.yaml"
    drives.write_text(drives.read_text().replace("interface: virtual, channel:", "interface: socketcan, channel: no_"))
    up = live.up()
    ended_with_a_sentence(
        up, "gateway left_bus ended with exit code 1", "CAN bus socketcan:no_", "start it again with: drive-gateway run"
    )
    assert live.pids() == []


def test_a_journal_that_cannot_be_read_ends_the_manager(live: LiveCell) -> None:
    live.state_dir.mkdir()
    (live.state_dir / "manager.sqlite3").write_bytes(b"no database" * 100)
    ended_with_a_sentence(live.manager(), "journal ", "file is not a database", "--state-dir")


def test_an_agent_with_another_configuration_is_refused(live: LiveCell) -> None:
    gateway = live.gateway("left_bus")
    elsewhere = live.folder / "elsewhere"
    shutil.copytree(live.folder / "cell_configs", elsewhere)
    cell = elsewhere / "two_arms" / "cell.yaml"
    cell.write_text(f"{cell.read_text()}\nseparation: {{margin: 31}}\n")
    agent = live.start("robot-agent", str(cell), "left", "--state-dir", str(elsewhere / "state"))
    ended_with_a_sentence(agent, "the agent's configuration is ", "start both with the same cell file")
    gateway.signal(signal.SIGINT)
    assert gateway.wait(20.0) == 0


@pytest.mark.parametrize("what_is_there", ["nothing", "a first process", "all processes"])
def test_ctrl_c_while_the_cell_starts_leaves_nothing_behind(live: LiveCell, what_is_there: str) -> None:
    up = live.up("--run")
    if what_is_there == "nothing":
        wait_until(lambda: "site-packages" in Path(f"/proc/{up.pid}/maps").read_text(), 30.0, "the first imports")
    else:
        count = 2 if what_is_there == "a first process" else 6
        wait_until(lambda: len(live.pids()) >= count, 30.0, what_is_there)
    up.signal(signal.SIGINT)
    assert up.wait(30.0) in (-signal.SIGINT, 0)
    assert "Traceback" not in up.output
    assert live.pids() == []
