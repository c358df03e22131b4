"""Events are kept by the manager, over its death and restart, and shown as they come."""

import signal

from live_cell import LiveCell

DEADLINE_S = 30.0


def test_events_survive_the_death_of_the_manager_and_are_followed(live: LiveCell) -> None:
    manager = live.manager()
    manager.wait_for_output("manager at", DEADLINE_S)
    follow = live.start("cell", "events", "--follow", "-f", str(live.file))
    follow.wait_for_output("[manager_started]", DEADLINE_S)
    live.order("estop", "--reason", "trial")
    follow.wait_for_output(": trial", DEADLINE_S)

    manager.signal(signal.SIGKILL)
    manager.wait(5.0)
    follow.wait_for_output("events are not kept meanwhile", DEADLINE_S)
    alone = live.order("events", "--state-dir", str(live.state_dir))
    assert alone.exit_code() == 0, alone.output
    assert f"these events are from {live.state_dir / 'events.sqlite3'}" in alone.output
    assert "alarm: manager: emergency stop by" in alone.output

    live.manager()
    follow.wait_for_output("the manager answers again", DEADLINE_S)
    assert live.order("events").exit_code() == 0
    live.order("reset")
    follow.wait_for_output("[estop_cleared]", DEADLINE_S)
    listed = [line for line in live.order("events", "--since", "1h").output.splitlines() if "Z " in line]
    codes = [line.rpartition("[")[2].rstrip("]") for line in listed]
    assert codes == ["manager_started", "estop", "manager_started", "estop_cleared"]
    assert listed == sorted(listed)
    followed = [line for line in follow.output.splitlines() if "Z " in line]
    assert followed == listed

    follow.signal(signal.SIGINT)
    assert follow.wait(10.0) == 0
    alarms = live.order("events", "--severity", "alarm", "-n", "1", "--json")
    assert '"code": "estop"' in alarms.output
    assert len(alarms.output.splitlines()) == 1


def test_without_a_manager_and_its_file_it_is_said_how_to_start_one(live: LiveCell) -> None:
    nobody = live.order("events")
    assert nobody.exit_code() == 1
    assert "no manager of cell two_arms answers" in nobody.output
    assert "cell manager" in nobody.output
