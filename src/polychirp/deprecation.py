"""Deprecation: an old name keeps working for one minor version, and says which name replaces it.

docs/reference/api.md states the rule.
"""

import warnings


def warn_deprecated(old: str, *, new: str, removed_in: str, stacklevel: int = 2) -> None:
    """Warn that a name is deprecated; the warning points at the caller of the caller.

    Parameters
    ----------
    old, new : the name that is deprecated, and the one that replaces it
    removed_in : version of polychirp that no longer has the old name
    stacklevel : number of calls between this function and the code that uses the old name

    Examples
    --------
    >>> import warnings
    >>> with warnings.catch_warnings(record=True) as caught:
    ...     warnings.simplefilter("always")
    ...     warn_deprecated("polychirp.Rx", new="polychirp.CoherentReceiver", removed_in="0.3")
    >>> print(caught[0].message)
    polychirp.Rx is deprecated and will be removed in polychirp 0.3; use polychirp.CoherentReceiver
    """
    warnings.warn(
        f"{old} is deprecated and will be removed in polychirp {removed_in}; use {new}",
        DeprecationWarning,
        stacklevel=stacklevel + 1,
    )
