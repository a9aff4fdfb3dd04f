"""The paper, reproduced: every table and figure, ours next to the print, with a verdict from checks in code."""
