"""Seeds and what each was used for; a proof needs one that nobody has opened."""

from __future__ import annotations

# Opened while the diagnosis was developed: thresholds were set on the first, open forms, the search for thermostats and
# some rules made while looking at others.
OWN_DEVELOPMENT = (1, *range(2026, 2038), 2039, 2041, 2042, 2043, 3501)
OWN_PROOF = 2044  # the next one; once opened it belongs above
ZOO_DEVELOPMENT = (*range(1, 1000), 3000, 3001, 3002)  # anybody may look; the last three were proofs
ZOO_LEARNING = range(1000, 3000)  # priors and model error may be learnt from
ZOO_PROOF = range(3003, 4000)  # each is opened once


def role_of(plant: str, seed: int) -> str:
    """Use of a seed: ``development``, ``learning`` or ``proof``.

    Parameters
    ----------
    plant : str
        ``own`` or ``zoo``; given recordings are open, so they are ``development``

    Examples
    --------
    >>> role_of("own", 2041), role_of("own", 2044), role_of("zoo", 1500), role_of("given", 0)
    ('development', 'proof', 'learning', 'development')
    """
    if plant == "own":
        return "development" if seed in OWN_DEVELOPMENT else "proof"
    if plant == "zoo":
        return "development" if seed in ZOO_DEVELOPMENT else "learning" if seed in ZOO_LEARNING else "proof"
    return "development"
