"""``python -m polychirp`` is the command ``polychirp``."""

from polychirp.cli.app import main

raise SystemExit(main())
