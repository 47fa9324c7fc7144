"""Figure of the detection probability of the coherent receiver, from the record of docs/validation.

    python bench/receivers.py docs/validation/receiver.json docs/images

writes receivers.png.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from tools.figures.receivers import receiver_picture

if __name__ == "__main__":
    record = json.loads(Path(sys.argv[1]).read_text(encoding="utf-8"))
    (Path(sys.argv[2]) / "receivers.png").write_bytes(receiver_picture(record).png())
