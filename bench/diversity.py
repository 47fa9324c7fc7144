"""Figure of the suppression by diversity, from the record of docs/validation.

    python bench/diversity.py docs/validation/diversity.json docs/images

writes diversity.png.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from tools.figures.diversity import diversity_picture

if __name__ == "__main__":
    record = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    (Path(sys.argv[2]) / "diversity.png").write_bytes(diversity_picture(record).png())
