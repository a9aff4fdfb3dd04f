"""The paper, reproduced: every table and figure, ours beside what is printed, with a verdict that code comes to."""
