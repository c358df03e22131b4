"""A second process for a place that is taken ends with a sentence."""

from live_cell import LiveCell


def test_a_second_agent_on_this_host_is_told_who_runs(live: LiveCell) -> None:
    live.up().wait_for_output("all robots enabled", 60.0)
    second = live.agent("left")
    assert second.wait(30.0) == 1
    assert "robot-left is already running" in second.output
    assert "next: " in second.output


def test_a_second_agent_from_elsewhere_is_refused_by_the_gateway(live: LiveCell) -> None:
    live.up().wait_for_output("all robots enabled", 60.0)
    second = live.start("robot-agent", str(live.file), "left", "--state-dir", str(live.folder / "elsewhere"))
    assert second.wait(40.0) == 1
    assert "is owned by boot" in second.output


def test_a_second_manager_of_the_same_cell_is_told_so(live: LiveCell) -> None:
    live.up().wait_for_output("all robots enabled", 60.0)
    second = live.start("cell", "manager", str(live.file), "--state-dir", str(live.folder / "elsewhere"))
    assert second.wait(40.0) == 1
    assert f"{live.settings.manager_endpoint} is in use" in second.output
    assert "Traceback" not in second.output
