"""The layout with which Foxglove shows a recording."""

from foxglove import layouts as fox

from cell.recording.cell_files import RecordedCell
from cell.recording.scene import WORLD

LAYOUT = "layout.json"
"""The attachment's name."""


def layout_of(cell: RecordedCell) -> str:
    """The cell in space, modes and zones over time, the joints of every robot, and what happened, as JSON."""
    robots, zones = list(cell.settings.robots), list(cell.settings.zones)
    drawn = [*(f"/scene/{robot}" for robot in robots), "/scene/zones", "/scene/things"]
    topics = {topic: fox.BaseRendererSceneUpdateTopicSettings(visible=True) for topic in drawn}
    space = fox.ThreeDeePanel(config=fox.ThreeDeeConfig(fixed_frame=WORLD, follow_tf=WORLD, topics=dict(topics)))
    states = [
        *(fox.StateTransitionsSeries(value=f"/robot/{robot}/state.mode", label=robot) for robot in robots),
        *(fox.StateTransitionsSeries(value=f"/manager/state.zones.{zone}.state", label=zone) for zone in zones),
    ]
    over_time = fox.StateTransitionsPanel(config=fox.StateTransitionsConfig(paths=states))
    joints = [
        fox.PlotSeries(value=f"/robot/{robot}/state.joints[{i}]", label=f"{robot} {name}")
        for robot in robots
        for i, name in enumerate(cell.joints.get(robot, ()))
    ]
    curves = fox.PlotPanel(config=fox.PlotConfig(paths=joints))
    happened = fox.LogPanel(config=fox.LogConfig(topic_to_render="/log"))
    beside = [fox.SplitItem(proportion=1.0, content=each) for each in (over_time, curves, happened)]
    content = fox.SplitContainer(
        direction="row",
        items=[
            fox.SplitItem(proportion=2.0, content=space),
            fox.SplitItem(proportion=1.0, content=fox.SplitContainer(direction="column", items=beside)),
        ],
    )
    return fox.Layout(content=content).to_json()
