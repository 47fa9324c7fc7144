"""Figure of the probability of ghosts, drawn from the record of docs/validation.

    python bench/ghosts.py docs/validation/ghosts.json docs/images

writes ghosts.png.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from tools.figures.ghosts import ghost_picture

if __name__ == "__main__":
    record = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    (Path(sys.argv[2]) / "ghosts.png").write_bytes(ghost_picture(record).png())
