"""Full steps of a native FMU from C against those of an older build, in one run: ratios after / before.

python -m benchmarks.step_ratio BEFORE_native.fmu AFTER_native.fmu
"""

from __future__ import annotations

import sys
from pathlib import Path

from benchmarks.run import from_c

RUNS = 3


def main() -> None:
    before, after = (Path(name) for name in sys.argv[1:])
    best: dict[tuple[Path, str], float] = {}
    for _ in range(RUNS):
        for fmu in (before, after):
            for label, value, unit in from_c(fmu):
                if unit == "us" and "full step" in label:
                    kind = label.rsplit(", ", 1)[1]
                    best[fmu, kind] = min(value, best.get((fmu, kind), value))
    for kind in dict.fromkeys(kind for _, kind in best):
        old, new = best[before, kind], best[after, kind]
        print(f"{kind:16s} {old:7.3f} us -> {new:7.3f} us: {new / old:.3f}")


if __name__ == "__main__":
    main()
