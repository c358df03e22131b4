"""What docs/language.md shows of the language."""

import re

from tests.unit.repository import ROOT

PAGE = (ROOT / "docs" / "language.md").read_text()
TABLE = re.findall(r"^\| (`.*`) \|", PAGE, re.M)
EXAMPLES = [example for cell in TABLE for example in re.findall("`(.*?)`", cell)]
PROGRAMS = re.findall(r"^```\n(.*?)^```", PAGE, re.M | re.S)
