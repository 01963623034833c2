"""The environment of the programs that this package starts."""

from __future__ import annotations

import os


def child_environment(**variables: str) -> dict[str, str]:
    """The environment of this process without this package's own variables, one of which is the viewer's token."""
    inherited = {name: value for name, value in os.environ.items() if not name.startswith("ISOSPLINE_")}
    return {**inherited, **variables}
