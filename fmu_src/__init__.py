"""Code that runs inside an FMU. The builder copies these files, and those of ``models`` that they import, into it."""
