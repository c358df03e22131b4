"""The painter with a visual on each link, and with links beside its chain."""

from pathlib import Path

from tests.unit.config_world import CONFIGS

ORIGINS = {
    "base": ("0.1 -0.2 0.3", "0.4 -0.5 0.6"),
    "carousel": ("0 0 0", "0 0 1.2"),
    "upper_arm": ("0 0.05 0.4", "1.1 0.2 -2.9"),
    "forearm": ("0.5 0 0", "0 1.5707963 0"),
    "wrist_2": ("0.01 0.02 0.03", "-1 -2 -3"),
    "wrist_3": ("0 0 0.2", "0.3 0 0"),
    "flange": ("0.02 0 0", "0 0.7 0.1"),
    "plate": ("0 0.1 0", "0.2 0.1 0"),
    "finger": ("0 0 0.1", "0 0 0.5"),
}
ASIDE = """
  <link name="plate"/>
  <link name="finger"/>
  <joint name="plate_mount" type="fixed">
    <parent link="forearm"/> <child link="plate"/> <origin xyz="0.1 0.2 0.3" rpy="0.1 0.2 0.3"/>
  </joint>
  <joint name="finger_slide" type="prismatic">
    <parent link="wrist_3"/> <child link="finger"/> <origin xyz="0.2 0 0" rpy="0 0.4 0"/> <axis xyz="0 1 0"/>
    <limit lower="-0.1" upper="0.1" velocity="1" effort="1"/>
  </joint>
</robot>"""


def visual(origin: tuple[str, str], geometry: str) -> str:
    return f'<visual><origin xyz="{origin[0]}" rpy="{origin[1]}"/><geometry>{geometry}</geometry></visual>'


def arm(folder: Path, geometry: str = '<mesh filename="ball.obj" scale="0.001 0.002 -0.001"/>') -> Path:
    """The painter, each link seen by a visual with an origin of its own, with a plate and a finger beside its chain."""
    text = (CONFIGS / "models" / "painter.urdf").read_text().replace("</robot>", ASIDE)
    for link, origin in ORIGINS.items():
        text = text.replace(f'<link name="{link}"/>', f'<link name="{link}">{visual(origin, geometry)}</link>')
    file = folder / "painter.urdf"
    file.write_text(text)
    return file
