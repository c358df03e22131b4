"""The kinematics of every robot, as far as its file is good."""

from cell.commands.checks.readings import NamedFiles
from cell.config.problem import Problem, refuses
from robot_agent.kinematics import KinematicsError, Model, model_of


def kinematic_models(named: NamedFiles) -> tuple[dict[str, Model], list[Problem]]:
    """Kinematics by robot, and what keeps a file without other problems from having any."""
    models: dict[str, Model] = {}
    problems: list[Problem] = []
    for robot, document, file in named.usable_models():
        if refuses(named.models[robot].problems):
            continue
        try:
            model = model_of(file.description(document.file.parent))
            model.forward(model.home)
        except KinematicsError as error:
            allowed = f"a robot of family {file.family.value}"
            problems.append(document.problem(("geometry",), str(error), allowed, at_key=True))
        else:
            models[robot] = model
    return models, problems
